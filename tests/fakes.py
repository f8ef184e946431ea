"""Stand-ins of a few lines: simulations that are formulas, and settings that run in milliseconds."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.loop import Setting
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.optimizers.steady_state import SteadyState, SteadyStateOptions
from gaplab.services.core.registry import Plugin, Registry
from gaplab.services.core.space import Space
from gaplab.services.core.strategies import strategies
from gaplab.services.core.types import Budget, Outcome

TRUTH = np.array([0.7, 0.2])


def paraboloid(genomes: Any, parameters: Any) -> Any:
    """`(n, 2)` × `(m, 2)` -> `(n, m)`: a hill whose summit is where the parameters say; in reality, at TRUTH."""
    return 1.0 - ((genomes[:, None, :] - parameters[None, :, :]) ** 2).sum(axis=2)


class Recorder:
    """A Simulate that remembers the shape of every call."""

    def __init__(self, simulate: Any = paraboloid) -> None:
        self.simulate = simulate
        self.calls: list[Any] = []

    def __call__(self, genomes: Any, parameters: Any) -> Any:
        self.calls.append((len(genomes), len(parameters)))
        return self.simulate(genomes, parameters)

    @property
    def rollouts(self) -> Any:
        return sum(n * m for n, m in self.calls)


class CountedReality:
    """A Reality at TRUTH that counts how often it was asked."""

    def __init__(self, fitness: Any = lambda genome: float(paraboloid(genome[None], TRUTH[None])[0, 0])) -> None:
        self.fitness = fitness
        self.asked = 0

    def __call__(self, genome: Any) -> Any:
        self.asked += 1
        return Outcome(self.fitness(genome))


def small_setting(strategy: Any = "simulated_fit", options: Any = None, **changes: Any) -> Any:
    """A repetition of three iterations on the paraboloid, with a population of 5."""
    chosen = strategies.create(PluginRef(name=strategy, options=options or {}))
    setting = Setting(
        simulate=paraboloid,
        reality=CountedReality(),
        strategy=chosen,
        optimizer=SteadyState(SteadyStateOptions(population=5)),
        controller_optimizer=optimizers[own]() if (own := chosen.controller_optimizer) else None,
        genomes=Space.box([0.0, 0.0], [1.0, 1.0], [True, False]),
        parameters=Space.box([0.0, 0.0], [1.0, 1.0]),
        known=np.array([0.5, 0.5]),
        budget=Budget(controller_evaluations=40, selection_evaluations=30, simulator_evaluations=50),
        iterations=3 if chosen.takes_samples else 0,
        seed=11,
        repetition=4,
        names=("static_friction", "dynamic_friction"),
    )
    return replace(setting, **changes)


def flat(step: Any) -> Any:
    """Everything in a step as plain numbers and names, so that steps compare by content to the last bit."""
    if isinstance(step, np.ndarray):
        return step.tobytes()
    if isinstance(step, tuple):
        return tuple(flat(each) for each in step)
    if hasattr(step, "__dataclass_fields__"):
        return type(step).__name__, *(flat(getattr(step, name)) for name in step.__dataclass_fields__)
    return np.float64(step).tobytes() if isinstance(step, float) else step


CAREFUL = '''
"""A strategy."""

import numpy as np

from gaplab.plugins import Strategy


class Careful(Strategy):
    """Stays in the middle."""

    name = "careful"
    searches = False

    def select(self, belief, search, rng):
        return (belief.space.lower + belief.space.upper) / 2
'''
"""A file with a strategy of one's own."""


def install(monkeypatch: pytest.MonkeyPatch, registry: Registry[Any], plugin: type[Plugin]) -> None:
    """Let this process have one more plug-in until the end of the test."""
    monkeypatch.setattr(registry, "_usable", dict(sorted({**registry, plugin.name: plugin}.items())))
