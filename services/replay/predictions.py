"""Fitness of samples in the simulators before and after they were tuned on them: physics at the time of asking."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import monotonic

import numpy as np

from gaplab.schemas.predictions import Prediction, Predictions
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.robots import robots
from gaplab.services.replay.process import Key, Memory, Physics
from gaplab.services.specs.assembly import Simulation, edits_of, engine_of, refuse_missing
from gaplab.services.specs.resolution import spec_of, unit
from gaplab.services.store.queries import experiments, replays
from gaplab.services.store.queries.replays import SampleBetween
from gaplab.services.store.session import Store

SECONDS = 2.0
"""That one question may compute for; the rest is pending."""

MOST_ASKED = 2_000
"""Samples that one question may compute."""

WEIGHT = 300
"""Bytes of memory that a prediction takes, about."""

MOST_KEPT = 20_000
"""Samples of one experiment, so that those of eight have room in memory at once; else one would push out the other.

The paper's experiments have 400. Of more, those of the first repetitions, which are as good as any others.
"""

Fitness = float | None
Pair = tuple[Fitness, Fitness]
"""Before and after."""


@dataclass(frozen=True)
class Asked:
    """One sample: its genome, and the parameters of the best simulators before and after."""

    genome: tuple[float, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]


def predictions(store: Store, physics: Physics, experiment_id: str, *, seconds: float = SECONDS) -> Predictions:
    """The predictions of every sample that simulators were tuned on.

    What is not known yet is computed for so many seconds, in the order of iterations over all repetitions; the rest is
    counted as pending, and computed when it is asked for again. What there is no room for is left out.

    Raises:
        NotFound: no such experiment.
        InvalidSpec: its robot, its engine or a tunable has gone from here.
        EngineUnavailable: its engine is not installed here.
        EngineInterrupted: the physics died.
        LimitReached: others were asking for too long.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        every = replays.samples_between(session, experiment_id)
    samples = every[:MOST_KEPT]
    spec = spec_of(row.spec)
    unknown = [each for each in samples if physics.memory.get(_key(row.id, each)) is None]
    unknown.sort(key=lambda each: (each.iteration, each.repetition))
    if unknown:
        refuse_missing(spec)
        asked = [Asked(tuple(each.genome), tuple(each.before), tuple(each.after)) for each in unknown[:MOST_ASKED]]
        pairs = physics.ask(predict, spec.model_dump_json(), asked, seconds)
        for each, pair in zip(unknown, pairs, strict=False):
            physics.memory.keep(_key(row.id, each), pair, WEIGHT)
    found = _read(row.id, unit(spec), samples, physics.memory)
    return found.model_copy(update={"left_out": len(every) - len(samples)})


def predict(spec: str, asked: Sequence[Asked], seconds: float) -> list[Pair]:
    """Fitness before and after of the first of those asked for: at least one, and as many as there is time for.

    Args:
        spec: resolved, as JSON.
        asked: samples with their simulators.
        seconds: after which no other is begun.
    """
    read = ExperimentSpec.model_validate_json(spec)
    robot = robots.create(read.robot)
    simulate = Simulation(robot, engine_of(read.engine), edits_of(ref.name for ref in read.tunables))
    found: list[Pair] = []
    until = monotonic() + seconds
    for each in asked:
        before, after = simulate(np.array([each.genome]), np.array([each.before, each.after]))[0].tolist()
        found.append((_finite(before), _finite(after)))
        if monotonic() > until:
            break
    return found


def _read(experiment: str, unit_: str, samples: Sequence[SampleBetween], memory: Memory) -> Predictions:
    items, pending = [], 0
    for each in samples:
        pair: Pair | None = memory.get(_key(experiment, each))
        if pair is None:
            pending += 1
            continue
        before, after = pair
        items.append(
            Prediction(
                repetition=each.repetition,
                iteration=each.iteration,
                simulated_before=before,
                simulated_after=after,
                fitness=each.fitness,
            )
        )
    return Predictions(experiment=experiment, unit=unit_, items=tuple(items), pending=pending)


def _key(experiment: str, sample: SampleBetween) -> Key:
    return "prediction", experiment, sample.repetition, sample.iteration


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
