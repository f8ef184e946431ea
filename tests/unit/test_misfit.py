"""Misfit after tuning, from what repetitions have found."""

from math import inf, nan
from typing import Any

import numpy as np
import pytest

from gaplab.services.core.space import Space
from gaplab.services.findings.misfit import Tuning, misfit_point
from gaplab.services.findings.simulator_sentences import remarks

SPACE = Space.box([0.0, 1.0], [1.0, 3.0])
NAMES = ("grip", "bounce")


def tuning(
    first: Any = 0.5,
    second: Any = 2.0,
    squared_error: Any = 0.04,
    samples: Any = 4,
    simulated: Any = 1.0,
    real: Any = 0.9,
) -> Any:
    return Tuning(np.array([first, second]), squared_error, samples, simulated, real)


def point(*tunings: Any, iteration: Any = 4) -> Any:
    return misfit_point(iteration, tunings, NAMES, SPACE)


def test_the_remaining_error_is_the_root_mean_square_over_samples_and_spread_over_repetitions() -> None:
    error = point(tuning(squared_error=0.04), tuning(squared_error=0.16)).error

    assert (error.n, error.mean, error.least, error.greatest) == pytest.approx((2, 0.15, 0.1, 0.2))
    assert error.sd == pytest.approx(0.1 / 2**0.5)


def test_an_error_is_unknown_without_samples_and_where_the_physics_failed() -> None:
    found = point(tuning(samples=0, squared_error=0.0), tuning(squared_error=inf), tuning(squared_error=0.04))

    assert (found.error.n, found.error.mean, found.error.sd) == (1, pytest.approx(0.1), None)


def test_the_gap_is_what_reality_makes_of_the_controller_that_was_evolved() -> None:
    found = point(tuning(simulated=1.0, real=0.7), tuning(simulated=0.7, real=0.8), tuning(real=nan))

    assert (found.gap.n, found.gap.mean) == (2, pytest.approx(0.2))


def test_a_tunable_has_its_spread_over_repetitions() -> None:
    grip, bounce = point(tuning(0.2, 1.5), tuning(0.4, 2.5)).tunables

    assert (grip.name, grip.mean, grip.least, grip.greatest) == ("grip", pytest.approx(0.3), 0.2, 0.4)
    assert (bounce.lower, bounce.upper, bounce.n) == (1.0, 3.0, 2)
    assert bounce.sd == pytest.approx(0.5**0.5)


def test_a_coefficient_within_a_hundredth_of_its_bounds_is_stuck_at_one() -> None:
    grip, bounce = point(tuning(0.0, 2.98), tuning(0.01, 2.97), tuning(0.02, 3.0), tuning(0.99, 2.0)).tunables

    assert (grip.at_lower, grip.at_upper) == (0.5, 0.25)
    assert (bounce.at_lower, bounce.at_upper) == (0.0, 0.5)


def test_remarks_say_what_is_left_what_it_was_and_what_is_stuck() -> None:
    before = point(tuning(samples=0, simulated=1.0, real=0.4), iteration=0)
    after = point(tuning(0.0, 2.0), tuning(0.0, 2.1, squared_error=0.16, real=0.9), tuning(0.5, 2.2))

    assert remarks([before, after], "m/s") == (
        "at 4 real-world evaluations the best simulators err by 0.13 m/s a sample "
        "(SD 0.058, 0.1 to 0.2 over 3 repetitions)",
        "the controller evolved in them differs by 0.1 m/s in reality, and by 0.6 before tuning",
        "grip is at its lower bound, 0, in 67 % of 3 repetitions",
    )


def test_before_the_first_sample_there_is_nothing_to_remark() -> None:
    assert remarks([], "m/s") == ()
    assert remarks([point(tuning(samples=0), iteration=0)], "m/s") == ()


def test_one_repetition_has_no_spread_and_can_be_remarked_on() -> None:
    (error, *_) = remarks([point(tuning(), iteration=1)], "m/s")

    assert error.endswith("the best simulator errs by 0.1 m/s a sample")
