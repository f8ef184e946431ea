"""Samples that were measured before an experiment, read from a table without a service."""

from collections.abc import Iterator, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

from gaplab.api.library.robots import AnyRobot, read_robot
from gaplab.schemas.measurements import KnownSample
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.samples import CellError, SamplesRead
from gaplab.schemas.traces import TracesSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.csv_tables import read_csv
from gaplab.services.replay.traces import evaluated, expected_in
from gaplab.services.specs.assembly import engine_of
from gaplab.services.specs.defaults import default_engine
from gaplab.services.specs.sample_tables import checked, collected
from gaplab.services.specs.sample_tables import read_samples as read_table
from gaplab.services.specs.simulation import Simulation
from gaplab.services.world.logs import read_trace
from gaplab.services.world.robots.base import Robot


def read_samples(path: str | Path, robot: AnyRobot, *, confirmed: bool = False) -> list[dict[str, Any]]:
    """Return the samples of a CSV file, for `reality.samples` of a spec.

        spec["reality"] = {"kind": "physical", "samples": gaplab.read_samples("runs.csv", "quadruped")}

    The columns are `gene_0`, `gene_1` and so on; `value`, or `value_1`, `value_2` and so on for repeats; and optionally
    readings like `roll@0.75`, or `roll@0.75#2` of repeat 2. In place of values and readings, `trace`, or `trace_1`,
    `trace_2` and so on, may name recordings in CSV beside the file, from which its code computes both;
    `lag_s`, or `lag_s_1` and so on, may state when the motion began on their clocks.

    Args:
        path: the file.
        robot: what was measured: its name; its robot file, URDF or MJCF; or a spec, like that of an experiment.
            `client.bench.check_samples` knows the robots that a service has.
        confirmed: take traces that are unlikely: with gaps, with another start, or of another drive.

    Raises:
        InvalidSamples: the file or a trace has errors, or a trace is unlikely and not `confirmed`; all are named.
        InvalidSpec: the robot does not exist, or is refused.
        TypeError: it is neither a name, a file nor a spec.
    """
    file = Path(path)
    return samples_of(file, read_robot(robot), confirmed=confirmed).checked(file)


def samples_of(file: Path, robot: Robot, *, confirmed: bool) -> SamplesRead:
    """Return the samples of a table, or everything that is wrong; of a trace that it names, what its code computes.

    The motion that is expected is that in the robot's own world and engine. A trace that is missing, wrong, or
    doubtful and not confirmed is an error of its line.
    """
    text = file.read_text("utf-8", "replace")
    head, rows, _ = read_csv(text)
    repeats = [name.removeprefix("trace") for name in head.cells if name.startswith("trace")]
    if not repeats:
        return read_table(text, robot)

    def found() -> Iterator[KnownSample | CellError]:
        for row in rows:
            cells = dict(zip(head.cells, row.cells, strict=False))
            try:
                sample = _measured(robot, cells, repeats, file.parent, confirmed=confirmed)
            except (InvalidSpec, OSError, KeyError, ValueError) as error:
                yield CellError(line=row.line, message=row.error or f"{type(error).__name__}: {error}")
            else:
                yield from checked(row.line, sample, robot)

    return collected(found())


def _measured(
    robot: Robot, cells: Mapping[str, str], repeats: Sequence[str], folder: Path, *, confirmed: bool
) -> KnownSample:
    """Return the sample of a line, whose cells name a recording of each repeat or are empty."""
    genes = [float(cells[f"gene_{place}"]) for place in range(robot.space.size)]
    named, genome = [each for each in repeats if cells.get(f"trace{each}")], frozen(genes)
    contents = [(folder / cells[f"trace{each}"]).read_bytes() for each in named]
    lags = tuple(float(lag) if (lag := cells.get(f"lag_s{each}")) else None for each in named)
    traces = [read_trace(content.decode("utf-8", "replace"), "/traces", robot.world) for content in contents]
    spec = TracesSpec(traces=tuple(sha256(content).hexdigest() for content in contents), lags_s=lags)
    simulation = Simulation(robot, engine_of(PluginRef(name=default_engine(robot))), ())
    expected, _ = expected_in(simulation, robot, genome, frozen([]))
    found = evaluated(robot, genome, traces, expected, spec)
    if found.doubts and not confirmed:
        raise ValueError(f"{'; '.join(found.doubts)}; if that is right, read with confirmed=True")
    return KnownSample(genome=tuple(genes), values=found.values, readings=found.readings)
