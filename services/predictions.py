"""Fitness of samples in the simulators before and after they were tuned on them: physics at the time of asking."""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from threading import Lock
from time import monotonic

import numpy as np

from schemas.predictions import Prediction, Predictions
from schemas.spec import ExperimentSpec
from services.core.robots import robots
from services.core.tunables import tunables
from services.physics import Physics
from services.resolution import spec_of, unit
from services.simulation import Simulation, engine_of
from services.store.repository import experiments, replays
from services.store.repository.replays import SampleBetween
from services.store.session import Store

SECONDS = 2.0
"""That one question may compute for; the rest is pending."""

MOST_KEPT = 100_000
"""Predictions that are remembered, a few MB."""

Fitness = float | None
Key = tuple[str, int, int]
"""An experiment, a repetition and an iteration."""


class Remembered:
    """What was computed, the longest unused forgotten first; a sample and its simulators never change."""

    def __init__(self, most: int = MOST_KEPT) -> None:
        self._most = most
        self._lock = Lock()
        self._found: OrderedDict[Key, tuple[Fitness, Fitness]] = OrderedDict()

    def get(self, key: Key) -> tuple[Fitness, Fitness] | None:
        """Fitness before and after; None if it is not known."""
        with self._lock:
            if key in self._found:
                self._found.move_to_end(key)
            return self._found.get(key)

    def keep(self, key: Key, pair: tuple[Fitness, Fitness]) -> None:
        """Remember it."""
        with self._lock:
            self._found[key] = pair
            while len(self._found) > self._most:
                self._found.popitem(last=False)


@dataclass(frozen=True)
class Asked:
    """One sample: its genome, and the parameters of the best simulators before and after."""

    genome: tuple[float, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]


def predictions(
    store: Store, physics: Physics, remembered: Remembered, experiment_id: str, *, seconds: float = SECONDS
) -> Predictions:
    """The predictions of every sample that simulators were tuned on.

    What is not known yet is computed for so many seconds, in the order of iterations over all repetitions; the rest is
    counted as pending, and computed when it is asked for again.

    Raises:
        NotFound: no such experiment.
        EngineUnavailable: its engine is not installed here.
        EngineInterrupted: the physics died.
        LimitReached: others were asking for too long.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        samples = replays.samples_between(session, experiment_id)
    spec = spec_of(row.spec)
    unknown = [each for each in samples if remembered.get(_key(row.id, each)) is None]
    unknown.sort(key=lambda each: (each.iteration, each.repetition))
    if unknown:
        asked = [Asked(tuple(each.genome), tuple(each.before), tuple(each.after)) for each in unknown]
        found = physics.ask(predict, spec.model_dump_json(), asked, seconds)
        for each, pair in zip(unknown, found, strict=False):
            remembered.keep(_key(row.id, each), pair)
    return _read(row.id, unit(spec), samples, remembered)


def predict(spec: str, asked: Sequence[Asked], seconds: float) -> list[tuple[Fitness, Fitness]]:
    """Fitness before and after of the first of those asked for: at least one, and as many as there is time for.

    Args:
        spec: resolved, as JSON.
        asked: samples with their simulators.
        seconds: after which no other is begun.
    """
    read = ExperimentSpec.model_validate_json(spec)
    robot = robots.create(read.robot)
    simulate = Simulation(robot, engine_of(read.engine), [tunables[ref.name]() for ref in read.tunables])
    found: list[tuple[Fitness, Fitness]] = []
    until = monotonic() + seconds
    for each in asked:
        before, after = simulate(np.array([each.genome]), np.array([each.before, each.after]))[0].tolist()
        found.append((_finite(before), _finite(after)))
        if monotonic() > until:
            break
    return found


def _read(experiment: str, unit_: str, samples: Sequence[SampleBetween], remembered: Remembered) -> Predictions:
    items, pending = [], 0
    for each in samples:
        pair = remembered.get(_key(experiment, each))
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
    return experiment, sample.repetition, sample.iteration


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
