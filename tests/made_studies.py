"""Archives of studies of the toy function whose recorded fitnesses are made: what follows from them is known."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from shutil import copyfileobj
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.records import StudyRead
from gaplab.schemas.spec import StudySpec
from gaplab.services.archives import export
from gaplab.services.core.arrays import frozen
from gaplab.services.core.types import Cost, Measured, Probed, Sample, Selected, Simulator, Step, Transferred, Tuned
from gaplab.services.experiments import lifecycle, submission
from gaplab.services.running import execution
from gaplab.services.store.lease import TimedStep
from gaplab.services.store.session import Store

STEP_S = 36.0
GENOME, SIMULATOR = frozen([0.5]), Simulator(frozen([1.0, 0.8, 0.0]), 0.01)


class Made(NamedTuple):
    """A curve: its means, and the deviations of a repetition and of its single values."""

    means: Sequence[float]
    deviation: float = 0.01
    wiggle: float = 0.003


class Study(NamedTuple):
    """A study to make; more repetitions may be planned for it, before it is stopped."""

    curves: Mapping[str, Made]
    repetitions: int = 12
    samples: int = 10
    changes: Mapping[str, Any] = {}
    more: int = 0


def standard(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Random numbers whose mean and deviation over the first axis are exactly 0 and 1."""
    drawn = rng.normal(size=shape)
    drawn -= drawn.mean(axis=0)
    return drawn / drawn.std(axis=0, ddof=1)


def values(strategy: str, made: Made, repetitions: int, counts: int) -> np.ndarray:
    """`(repetitions, counts)`"""
    rng = np.random.default_rng(crc32(strategy.encode()))
    each = made.deviation * standard(rng, repetitions, 1) + made.wiggle * standard(rng, repetitions, counts)
    return np.array(made.means[:counts]) + each


def log(recorded: Sequence[float]) -> Iterator[Step]:
    for iteration, value in enumerate(recorded):
        if iteration:
            yield Selected(iteration, GENOME, Cost(30))
            yield Measured(iteration, Sample(GENOME, 0.1))
        yield Tuned(iteration, (SIMULATOR,), Cost(60) if iteration else Cost())
        yield Transferred(iteration, GENOME, 0.5, Cost(60))
        yield Probed(iteration, float(value), float(value))


def archive(store: Store, label: str, study: Study, folder: Path) -> Path:
    """Run a study, whose fitness is made, and export it."""
    exported = export(store, make(store, label, study).id)
    path = folder / f"{label}.zip"
    with exported.file as source, path.open("wb") as target:
        copyfileobj(source, target)
    return path


def make(store: Store, label: str, study: Study) -> StudyRead:
    """Run a study, whose fitness is made, and return it as it was submitted."""
    spec: dict[str, Any] = {"name": f"made: {label}", "strategies": list(study.curves), "robot": "toy_function"}
    spec |= {
        "budget": "smoke",
        "iterations": study.samples,
        "repetitions": study.repetitions + study.more,
        "seed": 7,
        **study.changes,
    }
    made = submission.submit(store, StudySpec.model_validate(spec))
    recorded = {
        each.id: values(
            each.strategy, study.curves[each.strategy], study.repetitions, 1 if each.level else study.samples + 1
        )
        for each in made.experiments
    }
    every = execution.claim(store, "test", limit=10_000)
    claims = [claim for claim in every if claim.number < study.repetitions]
    steps = [(claim, log(recorded[claim.experiment_id][claim.number])) for claim in claims]
    execution.record_all(store, [(claim, [TimedStep(step, STEP_S) for step in each]) for claim, each in steps])
    assert all(execution.complete(store, claim) for claim in claims)
    if study.more:
        execution.hand_back(store, *(claim for claim in every if claim not in claims))
        lifecycle.ask(store, made.id, Verb.STOP)
    return made
