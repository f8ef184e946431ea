"""Which tunables are identified, from what repetitions have found."""

from math import inf, nan
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.misfit import Identification, MisfitPoint
from gaplab.services.core.arrays import frozen
from gaplab.services.core.identification import FEWEST, Means, overfitting, verdicts
from gaplab.services.core.misfit import Tuning, misfit_point
from gaplab.services.core.space import Space
from gaplab.services.core.tuners.abc_smc import _moved

SPACE = Space.box([0.0], [2.0])


def point(iteration: int, *values: float, interval: Any = None, posterior: Any = None, **changes: Any) -> MisfitPoint:
    tunings = [
        Tuning(
            frozen([value]),
            changes.get("squared_error", 0.04),
            samples=iteration,
            simulated=1.0,
            real=1.0,
            held_out_error=changes.get("held_out_error", nan),
            held_out=changes.get("held_out", 0),
            interval=None if interval is None else frozen([interval]),
            posterior=None if posterior is None else frozen([posterior]),
        )
        for value in values
    ]
    return misfit_point(iteration, tunings, ["grip"], SPACE)


def verdict(*points: MisfitPoint, **means: Any) -> Any:
    (found,) = verdicts(points, Means(**means))
    return found


AGREEING, PARTLY, SCATTERED = (1.0, 1.05, 0.95, 1.1, 0.9), (0.8, 1.2, 1.0, 1.2, 0.7), (0.1, 1.9, 1.0, 0.4, 1.6)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (AGREEING, Identification.IDENTIFIED),
        (PARTLY, Identification.PARTLY),
        (SCATTERED, Identification.NOT),
        (AGREEING[: FEWEST - 1], Identification.UNKNOWN),
    ],
)
def test_the_spread_over_repetitions_is_measured_against_uniform_draws(values: Any, expected: Any) -> None:
    assert verdict(point(3, *values)).verdict is expected


def test_uniform_draws_have_all_of_the_uncertainty_left() -> None:
    draws = np.random.default_rng(0).random(2_000) * 2

    assert verdict(point(3, *draws)).remaining == pytest.approx(1.0, abs=0.03)


def test_an_interval_or_a_posterior_speaks_for_a_single_repetition() -> None:
    assert verdict(point(3, 1.0, interval=(0.9, 1.1))).verdict is Identification.IDENTIFIED
    assert verdict(point(3, 1.0, interval=(0.0, 2.0))).remaining == pytest.approx(1 / 0.95)
    assert verdict(point(3, 1.0, posterior=2 / 12**0.5)).remaining == pytest.approx(1.0)


def test_the_most_uncertain_sign_decides() -> None:
    found = verdict(point(3, *AGREEING, interval=(0.9, 1.1), posterior=0.5))

    assert found.remaining == pytest.approx(0.5 / (2 / 12**0.5))
    assert found.verdict is Identification.NOT


def test_before_the_first_sample_there_is_no_verdict() -> None:
    assert verdicts([], Means()) == ()
    assert verdicts([point(0, *SCATTERED)], Means()) == ()
    assert verdicts([point(1, *SCATTERED, squared_error=inf)], Means()) == ()


def test_an_identified_tunable_needs_no_help() -> None:
    found = verdict(point(3, *AGREEING), readings=["readings"])

    assert found.helps == ()
    assert found.sentence == (
        "grip: identified; 1 ± 0.079 over 5 repetitions, with 14 % of the uncertainty before any sample"
    )


def test_what_would_help_follows_from_what_was_not_used() -> None:
    found = verdict(point(1, *AGREEING[:2]), readings=["readings"], intervals=["abc_smc", "gauss_newton"])

    assert found.helps == (
        "at least 5 repetitions",
        "the discrepancy readings: a fitness is one number a sample, sensors say more",
        "a tuner with intervals: abc_smc or gauss_newton",
        "more samples",
    )


def test_more_samples_help_as_long_as_they_have_helped() -> None:
    falling = verdict(point(1, *SCATTERED), point(2, *SCATTERED), point(3, *PARTLY))
    staying = verdict(point(1, *SCATTERED), point(2, *SCATTERED), point(3, *SCATTERED))

    assert falling.helps == ("more samples: 132 % were left at half of them",)
    assert staying.helps == ("another strategy, or a fixed value: more samples of this kind have not helped",)


def test_a_tunable_at_its_bounds_may_need_wider_ones() -> None:
    found = verdict(point(1, 0.0, 2.0, 0.0, 2.0, 1.0))

    assert "wider bounds, if they make sense: it often ends at one" in found.helps


def test_a_larger_error_on_held_out_samples_is_overfitting() -> None:
    honest = point(4, 1.0, held_out_error=0.01, held_out=1)
    overfitted = point(4, 1.0, held_out_error=0.36, held_out=1)

    assert overfitting(point(4, 1.0), "m/s") == ""
    assert (
        overfitting(honest, "m/s") == "on held-out samples the best simulators err by 0.1 m/s, on those tuned on by 0.1"
    )
    assert overfitting(overfitted, "m/s").endswith("by 0.1: they fit their samples better than new ones")


def test_two_particles_move_although_they_span_no_volume() -> None:
    space = Space.box([0.0] * 3, [1.0] * 3)
    particles = np.array([[0.2, 0.3, 0.4], [0.7, 0.1, 0.9]])
    for weights in ([0.5, 0.5], [0.9, 0.1]):
        moved, densities = _moved(particles, np.array(weights), space, 20, np.random.default_rng(0))
        assert np.all(np.isfinite(moved))
        assert np.all((space.lower <= moved) & (moved <= space.upper))
        assert densities.sum() == pytest.approx(1.0)
