"""The figure of curves: what is in it."""

from dataclasses import replace
from typing import Any

import pytest

from gaplab.schemas.curves import CurvePoint
from gaplab.services.core.strategies import strategies
from gaplab.services.figures.kinds.curves import CostAxis, curves_figure
from gaplab.services.figures.marks import Arrow, Axis, Bars, FigureDefinition, Label, Level, Line, Points
from gaplab.services.figures.style import COLORS, STRATEGIES, strategy_style, strategy_styles, style_of
from gaplab.services.figures.words import limits, power, spoken
from tests.figures import DIRECT, RISING, curve, point


def lines(figure: FigureDefinition) -> list[Line]:
    return [mark for mark in figure.panels[0].marks if isinstance(mark, Line)]


def levels(figure: FigureDefinition) -> list[Level]:
    return [mark for mark in figure.panels[0].marks if isinstance(mark, Level)]


def test_a_curve_becomes_a_line_with_its_interval_and_the_baseline_a_level_with_its_own() -> None:
    figure = curves_figure([RISING, DIRECT])

    (line,), (level,), (panel,) = lines(figure), levels(figure), figure.panels
    assert line.name == "Simulated fit"
    assert (line.x, line.y) == ((0, 1, 2), (0.9, 1.2, 1.3))
    assert line.upper[1] == pytest.approx(1.4)
    assert line.hover[0] == "0.900 ± 0.100 (n = 30)"
    assert (level.value, level.lower, level.upper) == pytest.approx((1.33, 1.13, 1.53))
    assert level.style.ink
    assert panel.y.label == "Fitness in reality (m/s)"
    assert panel.x.label == "Number of real-world evaluations"
    assert panel.x.limits == pytest.approx((-0.04, 2.04))


def test_transferred_controllers_alone_are_thin_lines_beside_the_recorded_ones() -> None:
    alone = curve("simulated_fit", point(0, 0.9), point(1, 1.0), point(2, 1.1))
    figure = curves_figure([RISING, DIRECT], beside=[alone])

    recorded, thin = lines(figure)
    assert (thin.y, thin.style, recorded.style.thin) == ((0.9, 1.0, 1.1), replace(recorded.style, thin=True), False)
    assert figure.caption.count("Thin lines: transferred controllers alone.") == 1


def test_fewer_than_five_repetitions_are_drawn_with_their_sd() -> None:
    few = curves_figure([curve("a", point(0, 1.0, n=4)), DIRECT])

    assert "standard deviation" in few.caption
    assert lines(few)[0].upper[0] == pytest.approx(1.1)


def test_the_caption_says_n_and_what_the_bands_are() -> None:
    interval = curves_figure([RISING, DIRECT]).caption.replace("\N{NO-BREAK SPACE}", " ")
    deviation = curves_figure([curve("a", point(0, 1, n=2), point(1, 1, n=5))], band="sd").caption

    assert "Mean over 30 repetitions; bands: 95 % interval of the mean." in interval
    assert "1.33 ± 0.10 SD (n = 100)" in interval
    assert "2\N{EN DASH}5\N{NO-BREAK SPACE}repetitions" in deviation
    assert "standard deviation" in deviation


def test_a_sentence_tells_what_cannot_be_seen() -> None:
    told = curves_figure([RISING, DIRECT]).alt

    assert told == (
        "Fitness in reality (m/s) against number of real-world evaluations: "
        "Simulated fit goes from 0.9 to 1.3; Direct is at 1.33."
    )
    assert "no results yet" in curves_figure([]).alt


def test_points_that_no_repetition_has_reached_are_left_out_and_one_repetition_has_no_band() -> None:
    figure = curves_figure([curve("a", point(0, 1.0, n=1, sd=None), point(1, None, n=0, sd=None))])

    (line,) = lines(figure)
    assert (line.y, line.lower, line.upper) == ((1.0,), (None,), (None,))
    assert figure.caption == "Mean over 1\N{NO-BREAK SPACE}repetition."


def test_each_repetition_has_a_thin_line_behind_the_mean_if_asked_for() -> None:
    values = ((0.8, 1.0), (1.1, None))
    points = [point(at, 0.9).model_copy(update={"values": each}) for at, each in enumerate(values)]
    figure = curves_figure([curve("a", *points), curve("b")], each=True)

    (thin,) = [mark for mark in lines(figure) if mark.faint]
    assert thin.x == (0, 1, None, 0, 1, None)
    assert thin.y == (0.8, 1.1, None, 1.0, None, None)
    assert "Faint lines: single repetitions." in figure.caption


def test_curves_are_drawn_against_what_they_cost_where_that_is_known() -> None:
    cost = CostAxis("Time (h)", "Time: of everything.", {(RISING.experiment, 0): 2.5, (RISING.experiment, 2): 7.0})
    figure = curves_figure([RISING, DIRECT], against=cost)

    (line,) = lines(figure)
    assert (line.x, line.y) == ((2.5, 7.0), (0.9, 1.3))
    assert figure.panels[0].x.label == "Time (h)"
    assert not figure.panels[0].x.whole
    assert "Time: of everything." in figure.caption
    assert levels(figure)


BEST = DIRECT.model_copy(update={"best_of": (1.33, 1.4, 1.45, 1.48)})


def test_the_best_of_as_many_direct_searches_as_a_strategy_makes_is_a_line() -> None:
    figure = curves_figure([RISING, BEST])

    (_, best) = lines(figure)
    assert (best.name, best.x, best.y) == ("Direct, best of as many searches", (0, 1, 2), (1.33, 1.4, 1.45))
    assert figure.panels[0].y.limits[1] > 1.45
    assert figure.table is not None
    assert figure.table.rows[-1] == (best.name, "1.330 (best of 1)", "1.400 (best of 2)", "1.450 (best of 3)")
    assert figure.caption.endswith("drawn at e evaluations; their own evaluations are not counted.")
    assert figure.alt.endswith("Direct is at 1.33; Direct, best of as many searches, ends at 1.45.")


def test_the_caption_says_that_the_best_of_few_searches_ends_early() -> None:
    few = curves_figure([RISING, BEST.model_copy(update={"best_of": (1.33, 1.4)})])

    assert few.caption.endswith("It ends at half of them.")


def test_direct_baselines_and_the_best_of_their_searches_have_dashes_of_their_own() -> None:
    others = [
        curve(name, point(0, 1.0)).model_copy(update={"level": True, "strategy": name})
        for name in ("domain_randomization", "noise_envelope", "mine")
    ]
    figure = curves_figure([RISING, *others, BEST, DIRECT.model_copy(update={"experiment": "another"})])

    (_, best) = lines(figure)
    assert len({best.style.dash, *(level.style.dash for level in levels(figure) if level.style.ink)}) == 3


@pytest.mark.parametrize(
    ("curves", "against"),
    [
        ([RISING, DIRECT], None),
        ([RISING, BEST], CostAxis("Time (h)", "", {(RISING.experiment, 0): 2.5})),  # each search costs, too
        ([BEST], None),  # nothing to compare with
    ],
)
def test_there_is_no_such_line_where_it_says_nothing(curves: Any, against: Any) -> None:
    figure = curves_figure(curves, against=against)

    assert all("est of as many" not in text for text in (*(line.name for line in lines(figure)), figure.caption))


@pytest.mark.parametrize("band", ["interval", "sd"])
def test_nothing_that_is_drawn_is_cut_off_by_the_frame(band: Any) -> None:
    wide = CurvePoint(evaluations=1, n=2, mean=1.2, sd=3.0, lower=-50, upper=50, values=(-8.1, 9.3))
    figure = curves_figure([curve("a", point(0, 1.0), wide), DIRECT], band=band, each=True)

    least, most = figure.panels[0].y.limits
    drawn = [y for line in lines(figure) for ys in (line.y, line.lower, line.upper) for y in ys if y is not None]
    drawn += [end for level in levels(figure) for end in (level.lower, level.upper) if end is not None]
    assert min(drawn) == (-50 if band == "interval" else -8.1)
    assert least < min(drawn) < max(drawn) < most


def test_a_strategy_keeps_its_colour_and_mark_whatever_is_drawn_beside_it() -> None:
    named = [curve(name).model_copy(update={"strategy": name, "points": (point(0, 1.0),)}) for name in STRATEGIES]
    own = curve("mine", point(0, 1.0)).model_copy(update={"strategy": "mine"})

    together = {line.name: line.style for line in lines(curves_figure([*named, own]))}
    alone = {line.name: line.style for each in (own, *named) for line in lines(curves_figure([each]))}

    assert together == alone
    assert len({style.color for style in together.values()}) == len(COLORS)
    assert together["Mine"] not in [strategy_style(name) for name in STRATEGIES]


def test_experiments_of_one_strategy_share_their_colour_and_differ_in_dashes_and_marks() -> None:
    first, second, third = strategy_styles(["random", "random", "random"])

    assert len({first.color, second.color, third.color}) == 1
    assert len({first.dash, second.dash, third.dash}) == len({first.marker, second.marker, third.marker}) == 3
    many = strategy_styles(["random"] * 36)
    assert len({(style.dash, style.marker) for style in many}) == 36
    assert {style.color for style in many} == {first.color}


def test_every_strategy_of_gaplab_with_a_curve_has_a_colour_of_its_own() -> None:
    assert {name for name, strategy in strategies.items() if not strategy.in_reality} >= set(STRATEGIES)
    assert len(STRATEGIES) == len(COLORS)


def test_experiments_of_one_name_are_told_apart_by_their_ids() -> None:
    first, second = RISING, RISING.model_copy(update={"experiment": "another-id"})

    names = [each.name for each in lines(curves_figure([first, second]))]

    assert names == ["Simulated fit (id-of-si)", "Simulated fit (another-)"]


def test_experiments_of_one_name_in_several_studies_are_told_apart_by_their_studies() -> None:
    studies = ("on wood", "on ice", "on ice")
    drawn = [
        RISING.model_copy(update={"experiment": f"id-{place}", "study_name": study})
        for place, study in enumerate(studies)
    ]

    names = [each.name for each in lines(curves_figure(drawn))]

    assert names == ["Simulated fit · on wood", "Simulated fit · on ice (id-1)", "Simulated fit · on ice (id-2)"]


def test_a_name_that_a_person_gave_is_shown_as_it_is() -> None:
    named = [RISING.model_copy(update={"name": name}) for name in ("run_a1_v2", "simulated_fit")]

    assert [each.name for each in lines(curves_figure(named))] == ["run_a1_v2", "Simulated fit"]
    assert [spoken(each) for each in ("cma_es", "mujoco", "known_fit")] == ["CMA-ES", "MuJoCo", "Known fit"]


def test_units_are_shown_only_where_all_curves_share_one() -> None:
    assert curves_figure([RISING, curve("b", unit="m")]).panels[0].y.label == "Fitness in reality"
    assert curves_figure([curve("b", unit="1")]).panels[0].y.label == "Fitness in reality"


def test_thirty_six_lines_differ_in_more_than_colour() -> None:
    styles = [style_of(position) for position in range(36)]

    assert len(set(styles)) == 36
    assert len({each.dash for each in styles[:6]}) == len({each.marker for each in styles[:6]}) == len(COLORS)


@pytest.mark.parametrize("wrong", [float("nan"), float("inf")])
def test_no_mark_takes_a_number_that_json_does_not_have(wrong: float) -> None:
    for make in (
        lambda: Line("a", (0,), (wrong,)),
        lambda: Line("a", (0,), (0,), lower=(wrong,), upper=(0,)),
        lambda: Points("a", (wrong,), (0,)),
        lambda: Level("a", wrong),
        lambda: Bars("a", ((0, wrong, 0),)),
        lambda: Arrow((0, 0), (0, wrong)),
        lambda: Label("a", 0, wrong),
        lambda: Axis("a", (0, wrong)),
    ):
        with pytest.raises(ValueError, match="None"):
            make()


def test_parts_of_a_mark_are_equally_long_and_limits_go_up() -> None:
    with pytest.raises(ValueError, match=r"\[1, 2\]"):
        Points("a", (0, 1), (0,))
    with pytest.raises(ValueError, match="two numbers that ascend"):
        Axis("a", (1, 1))
    with pytest.raises(ValueError, match="above 0"):
        Axis("a", (0, 1), log=True)


def test_limits_have_room_for_one_value_and_for_none() -> None:
    assert limits([None]) == (0.0, 1.0)
    assert limits([0.0, 1.0, None]) == pytest.approx((-0.05, 1.05))
    for value in (0.0, 5.0, -3.0):
        least, most = limits([value])
        assert least < value < most


@pytest.mark.parametrize(("value", "written"), [(1e-6, "10⁻⁶"), (0.01, "0.01"), (3e5, "3·10⁵"), (10.0, "10")])
def test_values_of_a_logarithmic_axis_are_written_as_in_papers(value: float, written: str) -> None:
    assert power(value) == written
