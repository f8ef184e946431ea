"""Interleaved evolution: who is similar, and what goes on."""

from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.loop import repetition
from gaplab.services.core.strategies.interleaved import shared
from gaplab.services.core.tuners import tuners
from gaplab.services.core.types import Selected, Transferred
from tests.fakes import Recorder, flat, small_setting

EQUAL = np.full(3, 1 / 3)


def test_simulators_that_predict_alike_share_their_weight() -> None:
    fitnesses = np.array([[1.0, 1.0, 0.2], [0.9, 0.9, 0.1]])

    assert shared(EQUAL, fitnesses, 2, 0.1).tolist() == pytest.approx([0.25, 0.25, 0.5])
    assert shared(EQUAL, fitnesses, 2, 1e-9).tolist() == pytest.approx([0.25, 0.25, 0.5])
    assert shared(EQUAL, fitnesses * 0, 2, 0.1).tolist() == pytest.approx(EQUAL.tolist())


def test_only_the_best_controllers_tell_and_failed_physics_is_similar_to_none() -> None:
    best, worse = [1.0, 1.0, 0.9], [0.0, 0.5, 0.0]

    assert shared(EQUAL, np.array([worse, best]), 1, 0.05).tolist() == pytest.approx([0.25, 0.25, 0.5])
    failed = shared(np.array([0.5, 0.5, 0.0]), np.array([[1.0, 1.0, np.nan]]), 1, 0.05)
    assert failed.tolist() == pytest.approx([0.5, 0.5, 0.0])


def test_each_search_begins_with_the_final_population_of_the_one_before_and_the_log_has_it() -> None:
    simulate, search = Recorder(), tuners.create(PluginRef(name="search", options={"warm_start": True}))
    setting = small_setting("interleaved", {"simulators": 5}, tuner=search, simulate=simulate)

    steps: list[Any] = list(repetition(setting))

    searched = [step for step in steps if isinstance(step, Selected | Transferred)]
    assert all(step.members.shape == (5, 2) for step in searched)
    assert all(step.cost.saved == 0 for step in searched)
    for stopped_after in range(len(steps)):
        assert flat(next(repetition(setting, steps[:stopped_after]))) == flat(steps[stopped_after])
    fitness = [step.fitness for step in steps if isinstance(step, Transferred)]
    assert fitness[-1] == pytest.approx(1.0, abs=0.01)
