"""Predictions: the fitness of samples in simulation, before and after tuning on them, computed on request."""

from collections.abc import Sequence
from hashlib import sha256
from time import monotonic

import numpy as np

from gaplab.schemas.replays import Prediction, Predictions
from gaplab.services.replay.process import AnswerCache, Key, RolloutProcess
from gaplab.services.replay.sent_specs import SentSpec, received, sent
from gaplab.services.specs.assembly import refuse_missing, simulation_of
from gaplab.services.specs.robots import robot_of, unit
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.queries import experiments, replays
from gaplab.services.store.queries.replays import TunedSample
from gaplab.services.store.session import Store

SECONDS = 2.0
"""Time limit of the rollouts of one request; the rest stays pending."""

MOST_AT_ONCE = 2_000
"""Samples that are sent to the process in one request."""

SIZE_BYTES = 300
"""Approximate size of a cached prediction."""

MOST_KEPT = 20_000
"""Samples of one experiment that are predicted: those of its first repetitions.

The cache then has room for eight such experiments. An experiment of the paper has 400 samples.
"""

Fitness = float | None
Pair = tuple[Fitness, Fitness]
"""Fitness before and after tuning."""


def predictions(store: Store, process: RolloutProcess, experiment_id: str, *, seconds: float = SECONDS) -> Predictions:
    """Return the predictions of an experiment's samples that are computed so far.

    Each request computes more of them, early iterations first, for `seconds`. The rest counts as pending: repeat the
    request. Samples beyond `MOST_KEPT` are left out.

    Raises:
        NotFound: no such experiment.
        InvalidSpec: its robot, its engine or a tunable is no longer installed.
        EngineUnavailable: the library of its engine is not installed.
        EngineInterrupted: the physics ended its process.
        LimitReached: earlier requests took too long.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        every = replays.tuned_samples(session, row)
    samples = every[:MOST_KEPT]
    spec = spec_of(row.spec)
    sent_spec = sent(spec)
    unknown = [each for each in samples if process.answers.get(_key(row.id, each)) is None]
    unknown.sort(key=lambda each: (each.iteration, each.repetition))
    if unknown:
        refuse_missing(spec)
        pairs = process.call(predict, sent_spec, unknown[:MOST_AT_ONCE], seconds, plugins=sent_spec.plugins)
        for sample, pair in zip(unknown, pairs, strict=False):
            process.answers.keep(_key(row.id, sample), pair, SIZE_BYTES)
    items = _items(row.id, samples, process.answers)
    return Predictions(
        experiment=row.id,
        unit=unit(spec),
        items=items,
        pending=len(samples) - len(items),
        left_out=len(every) - len(samples),
    )


def predict(spec: SentSpec, samples: Sequence[TunedSample], seconds: float) -> list[Pair]:
    """Return the fitness of samples before and after tuning: of the first, and of as many others as time permits."""
    read = received(spec)
    robot = robot_of(read)
    simulate = simulation_of(read, robot)
    found: list[Pair] = []
    until = monotonic() + seconds
    for sample in samples:
        before, after = simulate(np.array([sample.genome]), np.array([sample.before or sample.after, sample.after]))[
            0
        ].tolist()
        found.append((_finite(before) if sample.before else None, _finite(after)))
        if monotonic() > until:
            break
    return found


def _items(experiment: str, samples: Sequence[TunedSample], answers: AnswerCache) -> tuple[Prediction, ...]:
    found: list[tuple[TunedSample, Pair | None]] = [(each, answers.get(_key(experiment, each))) for each in samples]
    return tuple(
        Prediction(
            repetition=sample.repetition,
            iteration=sample.iteration,
            simulated_before=pair[0],
            simulated_after=pair[1],
            fitness=sample.fitness,
        )
        for sample, pair in found
        if pair is not None
    )


def _key(experiment: str, sample: TunedSample) -> Key:
    """Return the key of a prediction; a correction may change the sample of an iteration and its simulators."""
    computed_from = repr((sample.genome, sample.before, sample.after))
    return "prediction", experiment, sample.repetition, sample.iteration, sha256(computed_from.encode()).hexdigest()


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
