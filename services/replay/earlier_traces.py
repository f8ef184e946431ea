"""Traces of earlier runs: a table of samples may name recordings in place of values and readings."""

import csv
import io
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.samples import CellError, InvalidSamples
from gaplab.schemas.traces import TracesSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.csv_tables import CsvRow, lines_of, rows_of
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.trace_tables import read_trace
from gaplab.services.core.traces import Trace
from gaplab.services.replay.traces import evaluated, expected_in, refuse_other_bodies
from gaplab.services.specs.assembly import engine_of
from gaplab.services.specs.default_engines import default_engine
from gaplab.services.specs.simulation import Simulation


def with_traces(file: Path, robot: Robot, *, confirmed: bool) -> str:
    """Return the text of a table of samples, with values and readings in place of the traces that it names.

    The motion that is expected is that in the robot's own world and engine.

    Raises:
        InvalidSamples: a trace is missing, wrong, or doubtful and not confirmed; all are named.
        InvalidSpec: traces of this robot's base say nothing about it.
    """
    text = file.read_text("utf-8", "replace")
    head, *rows = [*rows_of(lines_of(text)), CsvRow(1, [])]
    repeats = [name.removeprefix("trace") for name in head.cells if name.startswith("trace")]
    if not repeats:
        return text
    refuse_other_bodies(robot.world)
    numbers = range(1, len(repeats) + 1)
    genes = [f"gene_{place}" for place in range(robot.space.size)]
    sensed = [f"{name}#{number}" for number in numbers for name in robot.sensors.columns]
    made: list[list[object]] = [[]] * (head.line - 1)
    made.append([*genes, *(f"value_{number}" for number in numbers), *sensed])
    errors = list[CellError]()
    for row in rows[:-1]:
        made += [[]] * (row.line - 1 - len(made))
        cells = dict(zip(head.cells, row.cells, strict=False))
        try:
            genome = [float(cells[gene]) for gene in genes]
            made.append([*genome, *_measured(robot, genome, cells, repeats, file.parent, confirmed=confirmed)])
        except (InvalidSpec, OSError, KeyError, ValueError) as error:
            errors.append(CellError(line=row.line, message=f"{type(error).__name__}: {error}"))
    if errors:
        raise InvalidSamples(file, tuple(errors), 0)
    csv.writer(written := io.StringIO()).writerows(made)
    return written.getvalue()


def _measured(
    robot: Robot, genes: list[float], cells: Mapping[str, str], repeats: Sequence[str], folder: Path, *, confirmed: bool
) -> list[object]:
    """Return the values of all repeats of a line, and then their readings; None for what there is not."""
    named, genome = [each for each in repeats if cells.get(f"trace{each}")], frozen(genes)
    contents = [(folder / cells[f"trace{each}"]).read_bytes() for each in named]
    lags = tuple(float(lag) if (lag := cells.get(f"lag_s{each}")) else None for each in named)
    traces = [read_trace(content.decode("utf-8", "replace"), "/traces") for content in contents]
    spec = TracesSpec(traces=tuple(sha256(content).hexdigest() for content in contents), lags_s=lags)
    simulation = Simulation(robot, engine_of(PluginRef(name=default_engine(robot))), ())
    times_s, poses, _ = expected_in(simulation, robot, genome, frozen([]))
    found = evaluated(robot, genome, traces, Trace(times_s, poses[:, :3], poses[:, 3:]), spec)
    if found.doubts and not confirmed:
        raise ValueError(f"{'; '.join(found.doubts)}; if that is right, read with confirmed=True")
    blanks = [None] * (len(repeats) - len(named))
    readings = [each for repeat in found.readings or () for row in repeat for each in row]
    return [*found.values, *blanks, *readings, *blanks * robot.sensors.size]
