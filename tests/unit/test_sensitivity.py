"""The sensitivity check: what is nothing, rough or smooth, and that it is the same whenever it is asked."""

from typing import Any

import numpy as np
import pytest

from gaplab.schemas.sensitivity import Verdict
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.space import Space
from gaplab.services.findings.sensitivity import (
    Effort,
    Subject,
    alike,
    check,
    controllers,
    effect_and_roughness,
    sensitivity,
    spread_between,
    verdict,
    warning,
)
from tests.fakes import Recorder, paraboloid

EFFORT = Effort(points=17, evaluations=40)
BOX = Space.box([0.0, 0.0], [1.0, 1.0])
VALUES = np.linspace(0.0, 1.0, 17)


def subject(simulate: Any = paraboloid) -> Any:
    return Subject(simulate, BOX, np.array([0.3, 0.6]), BOX, ("first", "second"))


def found(simulate: Any = paraboloid) -> Any:
    return check(subject(simulate), SteadyState(), EFFORT)


def jumping(genomes: Any, parameters: Any) -> Any:
    """The second tunable is noise: a number that its digits decide."""
    noise = np.modf(np.sin(1e5 * parameters[:, 1] + 7 * genomes[:, :1]) * 4e4)[0]
    return paraboloid(genomes, np.column_stack([parameters[:, 0], np.full(len(parameters), 0.5)])) + 0.3 * noise


def test_a_tunable_that_changes_nothing_is_found_out() -> None:
    ignoring = lambda genomes, parameters: paraboloid(genomes, parameters * [1.0, 0.0])  # noqa: E731

    first, second = found(ignoring)

    assert first.verdict is Verdict.SMOOTH
    assert (second.verdict, second.effect, second.roughness) == (Verdict.NOTHING, 0.0, 0.0)
    assert (
        warning(second)
        == "second over 0 to 1 does nothing: its effect on fitness is 0 % of the spread between controllers"
    )
    assert warning(first) is None


def test_a_tunable_whose_effect_is_noise_is_rough() -> None:
    _, second = found(jumping)

    assert second.verdict is Verdict.ROUGH
    assert second.roughness == pytest.approx(1.0, abs=0.2)
    assert "the less certain its tuned value" in warning(second)
    assert "Leave it out of the tunables" in warning(second)


def test_only_what_is_called_rough_is_warned_of() -> None:
    below, above = (rough(roughness) for roughness in (0.46, 0.52))  # static friction of the quadruped has 0.46

    assert (below.verdict, above.verdict) == (Verdict.SMOOTH, Verdict.ROUGH)
    assert warning(below) is None
    assert "called rough above 50 %" in warning(above)


def rough(roughness: float) -> Any:
    """The result of a profile with this roughness."""
    shown = sensitivity("grip", VALUES, np.tile(VALUES, (3, 1)), spread=0.1)
    return shown.model_copy(update={"roughness": roughness, "verdict": verdict(1.0, roughness)})


def test_a_straight_line_has_no_roughness_and_its_standard_deviation_as_its_effect() -> None:
    effect, roughness = effect_and_roughness(np.array([2.0 * VALUES, -2.0 * VALUES]))

    assert effect == pytest.approx(2.0 * VALUES.std(ddof=1))
    assert roughness == pytest.approx(0.0, abs=1e-12)


def test_white_noise_has_a_roughness_of_one() -> None:
    _, roughness = effect_and_roughness(np.random.default_rng(1).normal(size=(400, 17)))

    assert roughness == pytest.approx(1.0, abs=0.03)


def test_a_step_is_not_rough_for_tuning_can_find_it() -> None:
    _, roughness = effect_and_roughness(np.where(VALUES > 0.5, 1.0, 0.0)[None, :])

    assert verdict(1.0, roughness) is Verdict.SMOOTH


def test_a_controller_on_which_a_tunable_acts_counts_for_more_than_many_that_stand_still() -> None:
    still = np.random.default_rng(1).normal(scale=0.001, size=(7, 17))
    moving = VALUES[None, :]

    effect, roughness = effect_and_roughness(np.concatenate([still, moving]))

    assert effect == pytest.approx(VALUES.std(ddof=1) / 8**0.5, rel=0.01)
    assert roughness < 0.1


def test_failed_physics_counts_in_no_number_but_that_of_failures() -> None:
    line = np.tile(VALUES, (3, 1))
    line[0] = np.nan
    line[1, 5] = np.nan

    shown = sensitivity("grip", VALUES, line, spread=0.1)

    assert shown.failures == 18
    assert shown.verdict is Verdict.SMOOTH
    assert shown.roughness == pytest.approx(0.0, abs=1e-12)
    assert shown.fitness[1][5] is None
    assert shown.effect == pytest.approx(VALUES.std(ddof=1), rel=0.02)


def test_where_all_physics_fails_nothing_is_known() -> None:
    first, _ = found(lambda genomes, parameters: np.full((len(genomes), len(parameters)), np.nan))

    assert first.verdict is Verdict.UNKNOWN
    assert (first.effect, first.relative_effect, first.roughness) == (None, None, None)
    assert first.failures == 8 * 17
    assert "physics failed in 136" in warning(first)


def test_where_controllers_do_not_differ_an_effect_has_no_relation_to_them() -> None:
    same = np.tile(VALUES, (8, 1))

    assert spread_between(same) == 0.0
    assert sensitivity("grip", VALUES, same, 0.0).relative_effect is None
    assert sensitivity("grip", VALUES, same, 0.0).verdict is Verdict.SMOOTH
    assert sensitivity("grip", VALUES, np.ones((8, 17)), 0.0).verdict is Verdict.NOTHING


@pytest.mark.parametrize(
    ("relative", "roughness", "expected"),
    [
        (0.0, 0.0, Verdict.NOTHING),
        (0.01, 1.0, Verdict.NOTHING),
        (0.011, 0.5, Verdict.SMOOTH),
        (0.011, 0.51, Verdict.ROUGH),
        (float("nan"), 0.0, Verdict.UNKNOWN),
        (1.0, float("nan"), Verdict.UNKNOWN),
    ],
)
def test_the_thresholds_are_as_documented(relative: Any, roughness: Any, expected: Any) -> None:
    assert verdict(relative, roughness) is expected


def test_a_check_takes_the_rollouts_that_it_says_and_no_more() -> None:
    recorder = Recorder()

    found(recorder)

    assert recorder.rollouts <= EFFORT.rollouts(2) == 8 * 2 * 17 + 4 * 40
    assert recorder.rollouts > 0.9 * EFFORT.rollouts(2)


def test_a_check_is_the_same_to_the_bit_whenever_it_is_asked() -> None:
    assert found() == found()


def test_the_others_stay_in_the_middle_of_their_bounds() -> None:
    asked = []

    def listening(genomes: Any, parameters: Any) -> Any:
        asked.append(parameters)
        return paraboloid(genomes, parameters)

    found(listening)

    first, second = asked[-2:]
    np.testing.assert_array_equal(first, np.column_stack([VALUES, np.full(17, 0.5)]))
    np.testing.assert_array_equal(second, np.column_stack([np.full(17, 0.5), VALUES]))


def test_evolved_controllers_are_fitter_than_random_ones() -> None:
    def hill(genomes: Any, parameters: Any) -> Any:
        return np.repeat(paraboloid(genomes, np.array([[0.5, 0.5]])), len(parameters), axis=1)

    genomes = controllers(subject(hill), SteadyState(), 100)

    fitness = hill(genomes, np.zeros((1, 2)))[:, 0]
    np.testing.assert_array_equal(genomes[0], [0.3, 0.6])
    assert len(genomes) == 8
    assert fitness[4:].min() > fitness[1:4].max()


def summing(weights: Any) -> Any:
    """The second tunable adds to the first, times a weight of each controller, which the first gene decides."""

    def simulate(genomes: Any, parameters: Any) -> Any:
        sizes = np.sin(9 * genomes[:, :1]) + 0.2
        return sizes * parameters[:, 0] + weights(genomes[:, :1]) * parameters[:, 1] + 0.1 * genomes[:, 1:]

    return simulate


def test_tunables_that_stand_in_for_each_other_are_told() -> None:
    (sentence,) = alike(found(summing(lambda first: -3 * (np.sin(9 * first) + 0.2))))

    assert sentence.startswith(
        "first and second act alike on the fitness of all controllers of the check (cosine 1.00)"
    )


def test_tunables_that_act_on_other_controllers_are_told_apart() -> None:
    assert alike(found(summing(lambda first: np.cos(9 * first)))) == ()


def test_failed_physics_and_profiles_that_are_no_lines_say_nothing() -> None:
    known = found(summing(lambda first: -3 * (np.sin(9 * first) + 0.2)))
    broken = [each.model_copy(update={"fitness": ((None,) * 17,) * 5 + each.fitness[5:]}) for each in known]
    curved = found(lambda genomes, parameters: (genomes[:, :1] + 1) * np.cos(6.3 * parameters.sum(axis=1)))

    assert alike(known) != ()
    assert alike(broken) == ()
    assert alike(curved) == ()
