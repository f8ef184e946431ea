"""How to compute a study or an experiment again: its spec, and the commands."""

import json
from collections.abc import Iterator, Sequence
from typing import Any

from gaplab.schemas.records import ExperimentRead

APART = {"name", "strategy", "repetitions", "iterations"}
"""Fields that may differ between the experiments of one submitted study."""


def instructions(id_: str) -> Iterator[str]:
    """Yield what to do, in sentences."""
    yield "Save the spec below as spec.json and submit it: gaplab submit spec.json --watch"
    yield "The same spec and seed give the same numbers, to the last bit, with the engines of the provenance above."
    yield f"Every number is in the archive that gaplab export {id_} writes."


def spec_text(experiments: Sequence[ExperimentRead], name: str) -> str:
    """Return the spec to submit, as JSON: of a study if one gives all experiments, else one after another.

    A hidden parameter of reality is left out.
    """
    specs = [_without_hidden(experiment.spec) for experiment in experiments]
    if len(specs) == 1:
        return json.dumps(specs[0], indent=2, ensure_ascii=False)
    found = _study(experiments, specs, name)
    return "\n".join(json.dumps(spec, indent=2, ensure_ascii=False) for spec in ([found] if found else specs))


def _study(experiments: Sequence[ExperimentRead], specs: Sequence[dict[str, Any]], name: str) -> dict[str, Any] | None:
    """Return the spec of a study that resolves to these specs; None if they differ in more than a study can."""
    both = list(zip(experiments, specs, strict=True))
    learned = [spec for experiment, spec in both if not experiment.direct] or list(specs)
    sampled = [spec for experiment, spec in both if not experiment.level] or learned
    baselines = [spec["repetitions"] for experiment, spec in both if experiment.direct]
    shared = _without(sampled[0], "name", "strategy")
    alike = all(_without(spec, "name", "strategy") == shared for spec in sampled)
    alike = alike and len({spec["repetitions"] for spec in learned}) == 1
    rest = _without(shared, "repetitions", "iterations")
    if not alike or any(_without(spec, *APART) != rest for spec in specs) or len(set(baselines)) > 1:
        return None
    direct = {"direct_repetitions": baselines[0]} if baselines else {}
    return {"name": name, "strategies": [spec["strategy"] for spec in specs], **shared, **direct}


def _without(spec: dict[str, Any], *fields: str) -> dict[str, Any]:
    return {field: value for field, value in spec.items() if field not in fields}


def _without_hidden(spec: dict[str, Any]) -> dict[str, Any]:
    reality = spec["reality"]
    known = {name: value for name, value in reality["parameters"].items() if value is not None}
    return {**spec, "reality": {**reality, "parameters": known}}
