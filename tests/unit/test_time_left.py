"""The interval of the time left, from the pace of the whole work so far."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from gaplab.schemas.records import StepRead
from gaplab.services.experiments.progress import busy_s, interval, progress_of, span
from gaplab.services.store.queries.progress import Tally

START = datetime(2026, 1, 1, tzinfo=UTC)


def attempt(begin: float, end: float) -> tuple[datetime, datetime]:
    return START + timedelta(seconds=begin), START + timedelta(seconds=end)


def test_the_time_left_is_not_known_before_a_pace_is_measured() -> None:
    assert interval(0, 1000, 100.0) is None
    assert interval(500, 500, 9.0) is None
    assert interval(99, 901, 100.0) is None
    assert interval(0, 1000, 1000.0) is None
    assert interval(100, 900, 100.0) is not None
    assert interval(1000, 0, 100.0) is None


def test_of_a_long_study_it_is_known_after_two_minutes_and_no_wider_than_at_a_tenth_of_the_work() -> None:
    short, long = interval(100, 900, 100.0), interval(10, 9_990, 120.0)

    assert short
    assert long
    assert long.low_s < 119_880 < long.high_s
    assert long.high_s / long.low_s == pytest.approx(short.high_s / short.low_s)


def test_pauses_do_not_count_as_slowness_and_attempts_at_once_count_once() -> None:
    assert busy_s([attempt(1000, 1060), attempt(0, 30), attempt(20, 40), attempt(5, 10)]) == 100.0
    assert busy_s([]) == 0.0


@pytest.mark.parametrize("acceleration", [0.9, 1.0, 1.1])
def test_the_interval_contains_the_true_time_although_the_pace_changes(acceleration: Any) -> None:
    done = lambda second: second**acceleration  # noqa: E731
    whole = done(1000)

    for second in range(150, 1000, 50):
        found = interval(int(done(second)), int(whole - done(second)), float(second))
        assert found
        assert found.low_s <= 1000 - second <= found.high_s


def test_the_interval_narrows_and_contains_the_true_time_of_progress_in_bursts() -> None:
    found = [interval(second - second % 30, 1000 - second + second % 30, float(second)) for second in range(200, 900)]

    assert all(each and each.low_s <= 1000 - second <= each.high_s for second, each in enumerate(found, 200))
    assert found[0]
    assert found[-1]
    assert found[-1].high_s / found[-1].low_s < found[0].high_s / found[0].low_s


@pytest.mark.parametrize(
    ("low", "high", "shown"),
    [
        (8, 15, "less than 1 min"),
        (40, 100, "less than 2 min"),
        (125, 200, "2 to 4 min"),
        (3000, 9000, "50 to 150 min"),
        (28_800, 45_000, "8 to 13 h"),
    ],
)
def test_an_interval_is_in_whole_minutes_or_hours(low: Any, high: Any, shown: Any) -> None:
    assert span(low, high) == shown


def test_failures_and_steps_under_way_are_named_where_there_are_any() -> None:
    done = Tally(repetitions=4_000, completed=1, counted_iterations=15, counted_iterations_done=15, rollouts=1_000)
    steps = tuple(StepRead(repetition=0, kind="tuning", iteration=3, rollouts=419, budget=1_000) for _ in range(6))

    plain = progress_of(replace(done, rollouts_done=900))
    broken = progress_of(
        replace(
            done, failed=2, counted_iterations=0, rollouts_done=90, rollouts_failed=3, rollouts_saved=950, steps=steps
        )
    )

    assert (plain.share, plain.text) == (0.9, "1 of 4,000 repetitions; 15 of 15 iterations; 900 of 1,000 rollouts")
    assert broken.share == 1.0
    assert broken.text == (
        "1 of 4,000 repetitions, 2 failed; 90 of 1,000 rollouts, 950 saved, physics failed in 3; "
        f"{'; '.join(['tuning 3: 41 %'] * 5)}; …"
    )
