"""Specs and logs for the tests that have a store, and short ways to run them."""

from collections.abc import Iterator
from math import inf, isnan, nan
from typing import Any

import numpy as np

from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.records import ExperimentRead
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.types import Cost, Measured, Probed, Sample, Selected, Simulator, Step, Transferred, Tuned
from gaplab.services.experiments import lifecycle, listing, submission
from gaplab.services.experiments.listing import ListFilter
from gaplab.services.running import execution
from gaplab.services.store.lease import Claim
from gaplab.services.store.session import Store

AWKWARD = (0.1 + 0.2, 1e-320, -1.7976931348623157e308, 2.0**-1074, 1 / 3, 5e-324, -0.0, 123456789.12345679)
"""Numbers that a careless store changes."""


def toy(**changes: object) -> ExperimentSpec:
    """A small experiment on the toy function; resolved, its repetitions have two iterations beside number 0."""
    small = {
        "strategy": "simulated_fit",
        "robot": "toy_function",
        "iterations": 2,
        "repetitions": 3,
        "tunables": ["static_friction", "dynamic_friction"],
        "budget": "smoke",
    }
    return ExperimentSpec.model_validate(small | changes)


def some_log(iterations: int = 2, recorded: float = 1.0) -> Iterator[Step]:
    """A log with every kind of step and awkward number: failed measurements, hopeless simulators."""
    for iteration in range(iterations + 1):
        if iteration:
            yield Selected(iteration, frozen(AWKWARD), Cost(30, 1))
            yield Measured(iteration, Sample(frozen(AWKWARD), nan if iteration == 1 else 1 / 3))
        simulators = (Simulator(frozen([0.1, 1 / 3]), 1e-300), Simulator(frozen([1.5, 0.0]), inf))
        yield Tuned(iteration, simulators, Cost(60, 2) if iteration else Cost())
        yield Transferred(iteration, frozen(AWKWARD[::-1]), nan if iteration == 2 else 2 / 3, Cost(60, 3))
        yield Probed(iteration, nan if iteration == 1 else recorded, recorded + iteration)


def run(store: Store, claim: Claim, log: Iterator[Step] | None = None) -> None:
    """Record a whole repetition and complete it."""
    for step in log if log is not None else some_log():
        assert execution.record(store, claim, step, seconds=0.5)
    assert execution.complete(store, claim)


def finish(store: Store) -> None:
    """Run whatever is queued, the repetitions of a claim to different fitnesses."""
    while claims := execution.claim(store, "test", limit=10):
        for number, claim in enumerate(claims):
            iterations = 0 if claim.spec.strategy.name == "direct" else claim.spec.iterations
            run(store, claim, some_log(iterations, recorded=1 + number / 10))


def submit_one(store: Store, spec: ExperimentSpec) -> ExperimentRead:
    """Submit an experiment, alone in its study."""
    return submission.submit(store, spec).experiments[0]


def listed(store: Store, **wanted: Any) -> list[ExperimentRead]:
    """All experiments of the listed studies, the newest study first."""
    found = listing.list_studies(store, ListFilter(**wanted), limit=1_000).items
    return [each for study in found for each in study.experiments]


def cancel(store: Store, experiment: str) -> ExperimentRead:
    """Cancel an experiment."""
    return lifecycle.ask(store, experiment, Verb.CANCEL).experiments[0]


def same(first: object, second: object) -> bool:
    """Whether two steps, or tuples of them, are equal to the bit; nan equals nan."""
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        return first.dtype == second.dtype and bool(np.array_equal(first, second, equal_nan=True))
    if isinstance(first, float) and isinstance(second, float):
        return first == second or (isnan(first) and isnan(second))
    if isinstance(first, tuple) and isinstance(second, tuple):
        return len(first) == len(second) and all(map(same, first, second))
    if type(first) is type(second) and hasattr(first, "__dataclass_fields__"):
        return all(same(getattr(first, name), getattr(second, name)) for name in first.__dataclass_fields__)
    return first == second
