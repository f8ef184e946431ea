"""The time left that a watcher is shown."""

import re
from datetime import UTC, datetime

import pytest
from gaplab.api.clients.progress.pace import Pace, span

from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import ExperimentRead, Progress


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def experiment(done: int, state: State = State.RUNNING) -> ExperimentRead:
    """Return an experiment of a thousand rollouts."""
    nothing = dict.fromkeys(Progress.model_fields, 0)
    progress = Progress.model_validate(nothing | {"rollouts": 1000, "rollouts_done": done, "seconds_left": None})
    names = {"id": "a", "name": "a", "strategy": "simulated_fit"}
    return ExperimentRead(**names, state=state, spec={}, progress=progress, created_at=datetime.now(UTC))


def test_the_time_left_is_not_known_before_a_pace_is_seen() -> None:
    clock = Clock()
    pace = Pace(clock)

    at_once = pace.left(experiment(0))
    clock.now = 100.0
    waited = pace.left(experiment(0))
    clock.now = 109.0
    too_soon = pace.left(experiment(500))
    clock.now = 120.0
    too_little = Pace(clock).left(experiment(500))

    assert (at_once, waited, too_soon, too_little) == (None, None, None, None)


def test_waiting_for_a_core_does_not_count_as_slowness() -> None:
    clock = Clock()
    pace = Pace(clock)
    pace.left(experiment(0))
    clock.now = 1000.0
    pace.left(experiment(0))

    clock.now = 1100.0

    assert pace.left(experiment(250)) == "4 to 7 min"  # 250 rollouts took 100 s, so 750 take 300 s


def test_progress_in_bursts_leaves_the_true_time_in_the_range() -> None:
    clock = Clock()
    pace = Pace(clock)

    for second in range(0, 601, 10):  # a rollout a second, told of every half minute
        clock.now = float(second)
        shown = pace.left(experiment(second - second % 30))
        if second > 200:
            low, high = map(int, re.findall(r"\d+", shown or ""))
            assert low * 60 <= 1000 - second <= high * 60


@pytest.mark.parametrize("state", [State.PAUSED, State.COMPLETED, State.QUEUED])
def test_what_does_not_run_has_no_time_left(state: State) -> None:
    assert Pace().left(experiment(500, state)) is None


@pytest.mark.parametrize(
    ("seconds", "shown"),
    [
        (10, "less than 1 min"),
        (70, "less than 2 min"),
        (150, "2 to 4 min"),
        (3600, "48 to 75 min"),
        (36_000, "8 to 13 h"),
    ],
)
def test_a_range_is_in_whole_minutes_or_hours(seconds: float, shown: str) -> None:
    assert span(seconds) == shown
