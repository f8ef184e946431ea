"""Which tunables are identified, from what repetitions have found."""

from math import inf, nan
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.misfit import Identification, MisfitPoint
from gaplab.services.core.arrays import frozen
from gaplab.services.core.space import Space
from gaplab.services.core.tuners.abc_smc import _moved
from gaplab.services.findings.identification import FEWEST, Means, verdicts
from gaplab.services.findings.misfit import Tuning, misfit_point
from gaplab.services.findings.simulator_sentences import overfitting

SPACE = Space.box([0.0], [2.0])


def point(iteration: int, *values: float, interval: Any = None, posterior: Any = None, **changes: Any) -> MisfitPoint:
    tunings = [
        Tuning(
            frozen([value]),
            changes.get("squared_error", 0.04),
            samples=changes.get("samples", iteration),
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


def verdict(*points: MisfitPoint, earlier: int = 0, **means: Any) -> Any:
    """The verdict after one sample for each iteration, and some from before the experiment."""
    (found,) = verdicts(points, [earlier + each.iteration for each in points], Means(**means))
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
    assert verdict(point(3, 1.0, interval=(0.0, 2.0))).remaining == 1.0  # 1 / 0.95 of uniform draws is not more
    assert verdict(point(3, 1.0, posterior=2 / 12**0.5)).remaining == pytest.approx(1.0)


def test_the_most_uncertain_sign_decides() -> None:
    found = verdict(point(3, *AGREEING, interval=(0.9, 1.1), posterior=0.5))

    assert found.remaining == pytest.approx(0.5 / (2 / 12**0.5))
    assert found.verdict is Identification.NOT


def test_before_the_first_sample_there_is_no_verdict() -> None:
    assert verdicts([], [], Means()) == ()
    assert verdicts([point(0, *SCATTERED)], [0], Means()) == ()
    assert verdicts([point(1, *SCATTERED, squared_error=inf)], [1], Means()) == ()


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

    assert falling.helps == ("more samples: 100 % were left at half of them",)
    assert staying.helps == ("another strategy, or a fixed value: more samples of this kind have not helped",)


def tuned(iteration: int, *values: float, earlier: int) -> MisfitPoint:
    return point(iteration, *values, samples=iteration + earlier)


def test_samples_from_before_the_experiment_count() -> None:
    """With 40 of them, one or four more do not show whether more would help; 40 more do."""
    first, second, last = (tuned(number, *SCATTERED, earlier=40) for number in (0, 1, 4))

    assert verdict(first, second, earlier=40).helps == ()
    assert verdict(first, second, last, earlier=40).helps == ()
    assert verdict(first, second, tuned(40, *PARTLY, earlier=40), earlier=40).helps == (
        "more samples: 100 % were left at half of them",
    )


def test_the_comparison_is_with_at_most_half_of_the_samples() -> None:
    """After five, with the second: the third has more than half of them."""
    points = [point(number, *(SCATTERED if number <= 2 else PARTLY)) for number in range(1, 6)]

    assert verdict(*points).helps == ("more samples: 100 % were left at half of them",)
    assert verdict(*points[2:]).helps == ()


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
        for redraw in (True, False):
            moved, densities = _moved(particles, np.array(weights), space, 20, np.random.default_rng(0), redraw=redraw)
            assert np.all(np.isfinite(moved))
            assert np.all((space.lower <= moved) & (moved <= space.upper))
            assert densities.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(("redraw", "expected"), [(True, 0.1), (False, 0.113)])
def test_particles_that_all_fit_are_uniform_up_to_the_bound_if_they_are_drawn_again(
    redraw: bool, expected: float
) -> None:
    """All simulators up to 0.2 fit equally well; of their weight, a tenth belongs below 0.02."""
    space, shares = Space.box([0.0], [1.0]), []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        particles, weights = space.draw(1000, rng), np.full(1000, 1e-3)
        for number in range(4):
            if number:
                particles, weights = _moved(particles, weights, space, 1000, rng, redraw=redraw)
            fits = np.flatnonzero(particles[:, 0] < 0.2)[:200]
            particles, weights = particles[fits], weights[fits] / weights[fits].sum()
        shares.append(weights[particles[:, 0] < 0.02].sum())

    assert np.mean(shares) == pytest.approx(expected, abs=0.004)
