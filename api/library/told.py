"""What a person tells: one measurement, with its recordings, or a table of samples; in the words of the service."""

from collections.abc import Mapping, Sequence
from math import isnan
from numbers import Real
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from gaplab.api.clients.bodies import readings_of
from gaplab.api.clients.trace_files import trace_csv
from gaplab.api.library.robots import invalid
from gaplab.samples import samples_of
from gaplab.schemas.measurements import KnownSample, MeasurementSpec
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.traces import TracesRead, TracesSpec
from gaplab.services.core.arrays import Genome, frozen
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.measuring.attachments import store_attachment
from gaplab.services.measuring.telling import Told
from gaplab.services.replay.process import sent
from gaplab.services.replay.traces import said_by_files
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.sample_tables import read_samples
from gaplab.services.store.session import Store

_SAMPLES = TypeAdapter(list[KnownSample])


def samples_in(table: Any, spec: ResolvedSpec, *, confirmed: bool) -> list[Told] | None:  # noqa: ANN401 - anything
    """Return the samples of a file, a data frame or a list of samples; None if it is none of these.

    Raises:
        InvalidSamples: the table has errors; with all of them.
        InvalidSpec: what is in a list is not a sample.
    """
    robot = robot_of(spec)
    if isinstance(table, str | Path):
        table = samples_of(Path(table), robot, confirmed=confirmed).checked(Path(table))
    elif hasattr(table, "to_csv"):
        table = read_samples(table.to_csv(index=False), robot).checked(Path("the data frame"))
    elif not (isinstance(table, Sequence) and table and isinstance(table[0], Mapping)):
        return None
    try:
        samples = _SAMPLES.validate_python(table := list(table))
    except ValidationError as error:
        raise invalid(error, table) from error
    answers = (each.model_dump(exclude={"genome"}) | {"confirmed": confirmed} for each in samples)
    found = zip(samples, answers, strict=True)
    return [(frozen(each.genome), MeasurementSpec.model_validate(answer), None) for each, answer in found]


def measured(fitness: float | Sequence[float | None] | None, readings: Any) -> dict[str, Any]:  # noqa: ANN401 - numbers
    """Return values and readings of the repeats that succeeded, or that none did, as parts of an answer."""
    if fitness is None:
        return {}
    repeats: Any = fitness
    values, tables = (repeats, readings) if hasattr(fitness, "__len__") else ([repeats], [readings])
    if wrong := [value for value in values if not isinstance(value, Real | None)]:
        raise TypeError(f"fitness: a number, one for each repeat, or None for one that failed, not {wrong[0]!r:.100}")
    kept = [place for place, value in enumerate(values) if value is not None and not isnan(value)]
    if not kept:
        return {"failed": "no repeat gave a fitness"}
    found: dict[str, Any] = {"values": [float(values[place]) for place in kept]}
    return found | ({} if readings is None else {"readings": [readings_of(tables[place]) for place in kept]})


def sample_of(
    store: Store,
    spec: ResolvedSpec,
    simulator: Sequence[float],
    genome: Genome,
    traces: Sequence[str | Path],
    columns: Mapping[str, str] | None = None,
    **parts: Any,  # noqa: ANN401 - of an answer
) -> Told:
    """Return one measurement of a genome `(g,)`, whose traces are stored, and read beside a simulator `(p,)`.

    Raises:
        InvalidSpec: it is not an answer, or a trace does not contain the motion; with every violation.
    """
    files = dict(_attached(store, Path(each), columns) for each in traces)
    parts |= {"traces": tuple(files)} if files else {}
    try:
        answer = MeasurementSpec.model_validate(parts)
    except ValidationError as error:
        raise invalid(error, parts) from error
    if answer.traces is None:
        return genome, answer, None
    asked = TracesSpec(traces=answer.traces, lags_s=answer.lags_s)
    found = said_by_files(sent(spec), genome.tolist(), simulator, asked, files)
    if not isinstance(found, TracesRead):
        raise InvalidSpec(found)
    return genome, answer, found


def _attached(store: Store, path: Path, columns: Mapping[str, str] | None) -> tuple[str, bytes]:
    """Store a recording as CSV, and return its hash and its content."""
    content = trace_csv(path, columns)
    return store_attachment(store, content, path.with_suffix(".csv").name, "text/csv").id, content
