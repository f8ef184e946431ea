"""`gaplab.recover`: whether tuning finds truths that are known, with the motions and the sensors of a robot."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import nan
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from gaplab.api.library.computing import shown
from gaplab.api.library.robots import AnyRobot, settings
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import InvalidSpec, PluginBroken, Violation
from gaplab.services.core.loop import repetition
from gaplab.services.core.streams import stream
from gaplab.services.core.tuners import tuners
from gaplab.services.core.types import Sample, Tuned, learnable
from gaplab.services.findings.misfit import Tuning
from gaplab.services.findings.recovery import Draw, RecoveredTunable, drawn, recovered, sentences, table
from gaplab.services.findings.tables import Grid
from gaplab.services.plugins import folders
from gaplab.services.replay.process import SentSpec, received, sent
from gaplab.services.specs.assembly import edits_of, engine_of, parameters_of, setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.simulation import Simulation
from gaplab.services.store.queries.tunings import intervals
from gaplab.services.world.tunables.labels import proper
from gaplab.workers.process_tasks import computed

Count = Annotated[int, Field(strict=True, ge=1, le=100_000)]


class _Asked(ExperimentSpec):
    draws: Count
    samples: Annotated[int, Field(strict=True, ge=1, le=1_000)]
    workers: Count


@dataclass(frozen=True, eq=False)
class Recovery:
    """How often intervals of each tunable contain truths that were drawn, and what the draws say, in sentences."""

    tunables: tuple[RecoveredTunable, ...]
    sentences: tuple[str, ...]
    table: Grid = field(repr=False)
    draws: tuple[Draw, ...] = field(repr=False)

    def __str__(self) -> str:
        rows = (", ".join(map(" ".join, zip(self.table.head, row, strict=True))) for row in self.table.rows)
        return "\n".join((*rows, *self.sentences))


def recover(  # noqa: PLR0913 - each is an option of the command too
    robot: AnyRobot,
    tunables: Sequence[Any] | None = None,
    *,
    draws: int = 40,
    samples: int = 5,
    reality: Mapping[str, float] | None = None,
    workers: int | None = None,
    progress: bool | None = None,
    **fields: Any,  # noqa: ANN401 - as in a spec
) -> Recovery:
    """Return how often 95 % intervals contain truths that are drawn between the bounds, before a robot is touched.

        found = gaplab.recover("a1.urdf", ["mass(trunk)", "max_torque", "friction"])
        print(found)  # which tunables random motions identify, and whether to believe the intervals

    Each truth moves as random controllers say, sensors read it with their noise, and simulators are tuned on that, as
    by `Tuning`. Equal arguments give equal numbers, whatever `workers` is.

    Args:
        robot: its name; its robot file, URDF or MJCF; or a spec of its `robot`, `controller`, `task` and `engine`; all
            else is an argument.
        tunables: labels, or objects with bounds as in a spec; left out: the robot's usual ones.
        draws: number of truths.
        samples: motions that each is tuned on.
        reality: values by label that are not drawn: of tunables, or of others, which reality has and no simulator.
        workers: processes; left out: one for each core.
        progress: show progress; left out: in a terminal or a notebook.
        fields: other fields of the spec of an experiment, like `engine`, `task`, `tuner`, `discrepancy`, `seed`.

    Raises:
        InvalidSpec: an argument is refused; with every violation.
        PluginBroken: a plug-in raised an error, or the physics failed in every draw.
    """
    at_once = os.cpu_count() or 1 if workers is None else workers
    usual = {"tuner": "gauss_newton", "discrepancy": "readings", "budget": "lean"}
    own = {"strategy": "random", "iterations": 1, "repetitions": 1, "reality": {"parameters": dict(reality or {})}}
    numbers = {"draws": draws, "samples": samples, "workers": at_once}
    asked = settings(_Asked, robot, tunables=tunables, **usual | fields | own | numbers)
    spec = _resolved(asked)
    fixed = {proper(label): value for label, value in asked.reality.parameters.items()}
    calls = [partial(_drawn, sent(spec), fixed, samples, number) for number in range(draws)]
    results: dict[int, Draw | None] = {}
    with shown(progress) as show:
        for number, draw in computed(calls, asked.workers):
            results[number] = draw
            show(f"{len(results)} of {draws} draws")
    if not (found := [draw for number in range(draws) if (draw := results[number]) is not None]):
        raise PluginBroken("the physics failed in every motion of every draw")
    each = tuple(recovered(found, [ref.name for ref in spec.tunables], parameters_of(spec.tunables)))
    return Recovery(each, tuple(sentences(each, found, samples)), table(each, len(found), samples), tuple(found))


def _resolved(asked: ExperimentSpec) -> ResolvedSpec:
    spec = resolve_experiment(asked)
    if not tuners[spec.tuner.name].intervals:
        able = [name for name, each in tuners.items() if each.intervals]
        message = f"the tuner {spec.tuner.name} gives no intervals, of which coverage is asked"
        raise InvalidSpec([Violation("/tuner", spec.tuner.name, message, able)])
    return spec


def _drawn(given: SentSpec, fixed: Mapping[str, float], samples: int, number: int) -> Draw | None:
    """Return a truth, by its number, and what tuning finds of it, in any process; None if the physics failed."""
    folders.use(given.plugins)
    spec = received(given)
    names, space = [ref.name for ref in spec.tunables], parameters_of(spec.tunables)
    rng = stream(spec.seed, "recover", number)
    reality = dict(zip(names, space.draw(1, rng)[0].tolist(), strict=True)) | dict(fixed)
    robot = robot_of(spec)
    genomes, values = robot.space.draw(samples, rng), np.array([list(reality.values())])
    seen = Simulation(robot, engine_of(spec.engine), edits_of(reality)).sense(genomes, values)[:, 0]
    seen[:, 1:] += rng.normal(size=seen[:, 1:].shape)
    measured = [Sample(genome, float(row[0]), frozen(row[1:])) for genome, row in zip(genomes, seen, strict=True)]
    if not (succeeded := len(learnable(measured))):
        return None
    whole = replace(setting(spec, number), known_samples=tuple(measured))
    tuned = next(repetition(whole))
    assert isinstance(tuned, Tuned)
    best = tuned.simulators[0]
    wide = intervals(best, [ref.model_dump() for ref in spec.tunables])
    numbers = best.parameters, best.squared_error, succeeded, nan, nan
    tuning = Tuning(*numbers, interval=wide, fit=best.fit, discrepancy=whole.discrepancy)
    return drawn(frozen([reality[name] for name in names]), tuning, names, space)
