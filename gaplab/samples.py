"""Samples that were measured before an experiment, read from a table without a service."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.robots import robots
from gaplab.services.core.sample_tables import read_samples as read_table


class InvalidSamples(ValueError):
    """A table of samples has errors.

    Attributes:
        errors: each with its `line`, `column`, `value`, `message` and `permitted`.
    """

    def __init__(self, path: Path, errors: tuple[Any, ...], more: int) -> None:
        self.errors = errors
        lines = [
            f"{path.name}:{each.line}{f', {each.column}' if each.column else ''}: {each.message}" for each in errors
        ]
        super().__init__("\n".join([*lines, *([f"and {more} more"] if more else [])]))


def read_samples(path: str | Path, robot: str, options: Mapping[str, Any] | None = None) -> list[dict[str, Any]]:
    """Return the samples of a CSV file, for `reality.samples` of a spec.

        spec["reality"] = {"kind": "physical", "samples": gaplab.read_samples("runs.csv", "quadruped")}

    The columns are `gene_0`, `gene_1` and so on; `value`, or `value_1`, `value_2` and so on for repeats; and optionally
    readings like `roll@0.75`, or `roll@0.75#2` of repeat 2.

    Args:
        path: the file.
        robot: name of the robot that was measured.
        options: its options; left out: their defaults.

    Raises:
        InvalidSamples: the file has errors; all are named.
        InvalidSpec: the robot does not exist.
    """
    file = Path(path)
    found = read_table(
        file.read_text("utf-8", "replace"), robots.create(PluginRef(name=robot, options=dict(options or {})))
    )
    if found.errors:
        raise InvalidSamples(file, found.errors, found.more)
    return [sample.model_dump(mode="json", exclude_none=True) for sample in found.samples]
