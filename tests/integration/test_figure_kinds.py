"""What is in the figures of one experiment: simulators, predictions, squared error, and curves against their cost."""

import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any
from warnings import catch_warnings

import pytest

from gaplab.schemas.costs import CostModel
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.core.types import Cost, Measured, Probed, Sample, Selected, Simulator, Transferred
from gaplab.services.core.types import Tuned as TunedStep
from gaplab.services.figures.kinds.curves import curves_figure
from gaplab.services.figures.kinds.predictions import AFTER, BEFORE, predictions_figure
from gaplab.services.figures.kinds.simulators import MOST, REALITY, simulators_figure
from gaplab.services.figures.kinds.squared_error import ErrorKind, squared_error_figure
from gaplab.services.figures.marks import Diagonal, FigureDefinition, Label, Level, Line, Mark, Points, Polylines
from gaplab.services.figures.matplotlib.files import render_file
from gaplab.services.figures.plotly.chart import chart
from gaplab.services.results import curves
from gaplab.services.results.comparisons import compare
from gaplab.services.results.costs import cost_axis
from gaplab.services.results.tuned_simulators import setting_coordinates, tuned_simulators
from gaplab.services.running import execution
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.session import Store
from tests.experiments import cancel, run, submit_one, toy
from tests.figures import DIMENSIONS, DIRECT, ERRORS, PREDICTIONS, TRUTH, coordinates, curve, point, prediction, tuned


def marks(figure: FigureDefinition, panel: int = 0) -> dict[str, Mark]:
    return {mark.name: mark for mark in figure.panels[panel].marks}  # type: ignore[union-attr]


def test_three_tunables_are_drawn_pair_by_pair_and_iterations_from_light_to_dark() -> None:
    figure = simulators_figure(tuned(3), DIMENSIONS[:3], truth=None)

    labels = [(each.x.label, each.y.label) for each in figure.panels]
    points = marks(figure)["Best simulator of a repetition"]
    assert labels == [
        ("Static friction", "Dynamic friction"),
        ("Static friction", "Body mass (kg)"),
        ("Dynamic friction", "Body mass (kg)"),
    ]
    assert all(each.square for each in figure.panels)
    assert points.shades == (0, 0, 0, 1, 1, 1, 2, 2, 2)  # type: ignore[union-attr]
    assert points.x[:3] == pytest.approx((0.1, 0.2, 0.3))  # type: ignore[index, union-attr]
    assert points.y[:3] == pytest.approx((0.3, 0.4, 0.5))  # type: ignore[index, union-attr]
    assert points.hover[4] == "repetition 1, iteration 1"  # type: ignore[union-attr]
    assert "3\N{NO-BREAK SPACE}repetitions" in figure.caption
    assert "once its experiments have ended" in figure.caption


@pytest.mark.parametrize("tunables", [1, 4])
def test_one_tunable_or_very_many_are_drawn_against_iterations(tunables: int) -> None:
    figure = simulators_figure(tuned(tunables), DIMENSIONS[:tunables], truth=TRUTH)

    assert [each.x.label for each in figure.panels] == ["Iteration"] * tunables
    assert marks(figure)["Best simulator of a repetition"].x == (0, 0, 0, 1, 1, 1, 2, 2, 2)  # type: ignore[union-attr]
    assert marks(figure)[REALITY].value == 1.0  # type: ignore[union-attr]


def test_reality_is_a_point_where_both_are_known_a_level_where_one_is_and_within_the_frame() -> None:
    far = {"static_friction": 9.0, "dynamic_friction": 0.8}
    figure = simulators_figure(tuned(3), DIMENSIONS[:3], truth=far)

    both, one = marks(figure, 0)[REALITY], marks(figure, 1)[REALITY]
    assert isinstance(both, Points)
    assert (both.x, both.y) == ((9.0,), (0.8,))
    assert isinstance(one, Level)
    assert (one.value, one.upright) == (9.0, True)
    assert figure.panels[0].x.limits[1] > 9.0
    assert "where reality has 9;" in figure.alt
    assert "ended" not in figure.caption


def test_a_reality_of_another_engine_has_no_place_among_the_simulators(store: Store) -> None:
    elsewhere = submit_one(store, toy(repetitions=1)).id
    (claim,) = execution.claim(store, "test", limit=1)
    run(store, claim)
    with store.transaction() as session:
        row = session.get_one(ExperimentRow, elsewhere)
        row.spec = row.spec | {"reality": row.spec["reality"] | {"engine": {"name": "a_lab", "options": {}}}}

    found = tuned_simulators(store, elsewhere)
    truth, engine = found.truth, found.real_engine
    figure = simulators_figure(found.simulators, found.dimensions, truth=truth, real_engine=engine)

    assert truth == {}
    assert REALITY not in marks(figure)
    assert "Reality is the engine A lab: no setting of the simulators is reality." in figure.caption


def test_of_very_many_simulators_the_first_repetitions_are_drawn() -> None:
    figure = simulators_figure(tuned(2, repetitions=4000, iterations=1), DIMENSIONS[:2], truth=None)

    assert len(marks(figure)["Best simulator of a repetition"].x) == MOST  # type: ignore[arg-type, union-attr]
    assert "2500\N{NO-BREAK SPACE}repetitions of 4000" in figure.caption


def test_simulators_of_nothing_do_not_tell_where_reality_is() -> None:
    figure = simulators_figure([], DIMENSIONS[:2], truth=TRUTH)

    assert figure.empty
    assert figure.panels[0].marks == ()


def test_parallel_coordinates_have_one_line_for_each_and_axes_with_their_ends() -> None:
    figure = coordinates()

    (panel,) = figure.panels
    (lines,) = [mark for mark in panel.marks if isinstance(mark, Polylines)]
    labels = {(mark.x, mark.text) for mark in panel.marks if isinstance(mark, Label)}
    assert lines.shades == (0.25, 0.5, 0.75)
    assert lines.rows[0] == (0.0, pytest.approx(0.2 / 1.5), 0.0, 0.5)
    assert lines.rows[1][2] is None
    assert lines.rows[2] == (1.0, pytest.approx(1 / 1.5), 1.0, 0.5)
    assert {(1, "0"), (1, "1.5"), (0, "random"), (3, "8")} <= labels
    assert [words for _, words in panel.x.ticks] == ["Strategy", "Static friction", "RMS error (m/s)", "Repetitions"]
    assert "3\N{NO-BREAK SPACE}experiments" in figure.caption
    assert figure.table is not None
    assert figure.table.rows[1] == ("random", "0.4", "", "8")
    assert coordinates(0).empty


def test_the_coordinates_of_experiments_are_the_settings_that_differ_and_their_fitness(sqlite_store: Store) -> None:
    ids = [submit_one(sqlite_store, toy(seed=seed)).id for seed in (1, 2)]
    for claim in execution.claim(sqlite_store, "test", limit=10):
        run(sqlite_store, claim)

    figure = setting_coordinates(sqlite_store, ids)

    assert figure.table is not None
    assert figure.table.head == ("Seed", "Rollouts", "Final fitness (m/s)")
    assert [row[0] for row in figure.table.rows] == ["1", "2"]


def test_predictions_are_drawn_before_and_after_with_the_line_of_agreement() -> None:
    figure = predictions_figure(PREDICTIONS, unit="m/s", pending=2, left_out=3)

    found = marks(figure)
    (panel,) = figure.panels
    assert (found[BEFORE].x, found[BEFORE].y) == ((1.0, 1.0), (0.5, 1.5))  # type: ignore[union-attr]
    assert (found[AFTER].x, found[AFTER].y) == ((1.0, 1.0), (0.9, 1.1))  # type: ignore[union-attr]
    assert any(isinstance(each, Diagonal) for each in panel.marks)
    assert panel.x.limits == panel.y.limits
    assert (panel.x.label, panel.y.label) == ("Fitness in reality (m/s)", "Fitness in simulation (m/s)")
    told = figure.caption.replace("\N{NO-BREAK SPACE}", " ")
    assert "4 samples of 2 repetitions" in told
    assert "Before tuning on it: root-mean-square error 0.5 m/s." in told
    assert "After tuning on it: root-mean-square error 0.1 m/s." in told
    assert "2 samples left out: a measurement or the physics failed." in told
    assert "3 samples of later repetitions left out: there are too many." in told
    assert "2 samples still being computed." in told


def test_predictions_that_are_on_their_way_say_so() -> None:
    assert predictions_figure([], pending=3).nothing == "being computed"
    assert predictions_figure([]).nothing == "no results yet"
    assert predictions_figure([]).empty


def test_squared_errors_have_their_median_and_quartiles_and_failures_are_counted() -> None:
    figure = squared_error_figure({1: {0: 1.0, 1: 2.0, 2: 9.0}, 2: {0: 4.0, 1: None}}, ErrorKind("m/s"))

    line = marks(figure)["Best simulator"]
    assert (line.x, line.y) == ((1, 2), (2.0, 4.0))  # type: ignore[union-attr]
    assert (line.lower, line.upper) == ((1.5, None), (5.5, None))  # type: ignore[union-attr]
    assert (figure.panels[0].title, figure.panels[0].y.label) == ("Sum of squared errors", "Sum ((m/s)²)")
    assert not figure.panels[0].y.log
    told = figure.caption.replace("\N{NO-BREAK SPACE}", " ")
    assert "Median over 1\N{EN DASH}3 repetitions" in told
    assert "1 value left out, since the physics failed." in told


def test_the_error_per_sample_stands_beside_the_sum_which_grows_with_the_samples() -> None:
    figure = squared_error_figure(
        {1: {0: 0.04, 1: 0.16}, 2: {0: 0.08, 1: None}, 3: {0: 0.12, 1: 0.3}},
        ErrorKind("m/s"),
        samples={1: {0: 1, 1: 1}, 2: {0: 2, 1: 2}, 3: {0: 3, 1: 0}},
    )

    per_sample, total = (marks(figure, panel)["Best simulator"] for panel in (0, 1))
    assert [panel.y.label for panel in figure.panels] == ["Per sample (m/s)", "Sum ((m/s)²)"]
    assert [panel.title for panel in figure.panels] == ["Error per sample", "Sum of squared errors"]
    assert per_sample.y == pytest.approx((0.3, 0.2, 0.2))  # type: ignore[union-attr]
    assert total.y == pytest.approx((0.1, 0.08, 0.21))  # type: ignore[union-attr]
    assert "root mean square" in figure.caption
    assert figure.table
    assert figure.table.rows[1] == ("2", "0.2", "", "", "0.08", "", "", "1")
    assert len(figure.table.head) == 8
    assert "error per sample (m/s): 0.3 after iteration 1" in figure.alt


def test_squared_errors_of_many_magnitudes_are_on_a_logarithmic_axis_without_zeros() -> None:
    figure = squared_error_figure(ERRORS, each=True)

    (panel,) = figure.panels
    line, thin = panel.marks
    assert panel.y.log
    assert isinstance(line, Line)
    assert isinstance(thin, Line)
    assert thin.y == (1e-6, None, None, 1e-4, 1.0, None, None, 0.5, None)
    assert all(each > 0 for each in line.lower)
    assert panel.y.limits[0] > 0


def test_squared_errors_that_are_all_zero_or_failed_are_drawn_as_they_are() -> None:
    perfect, failed = squared_error_figure({1: {0: 0.0}}), squared_error_figure({1: {0: None}})

    assert marks(perfect)["Best simulator"].y == (0.0,)  # type: ignore[union-attr]
    assert not perfect.panels[0].y.log
    assert failed.empty


def test_the_band_of_squared_errors_is_told_of_only_where_there_is_one() -> None:
    alone, several = squared_error_figure({1: {0: 1.0}}), squared_error_figure({1: {0: 1.0, 1: 2.0}, 2: {0: 1.0}})

    assert alone.caption.endswith("Median over 1\N{NO-BREAK SPACE}repetition.")
    assert "band: from the first to the third quartile." in several.caption


def test_a_sample_that_misses_one_of_its_points_is_left_out_of_both_so_that_they_are_of_the_same_samples() -> None:
    halves = [prediction(None, 0.3, 0.3), prediction(0.3, None, 0.3, 1)]
    figure = predictions_figure([prediction(0.5, 0.4, 0.3), prediction(0.1, 0.2, 0.3, 1), *halves])

    assert "2\N{NO-BREAK SPACE}samples left out" in figure.caption
    assert "Before tuning on it: root-mean-square error 0.2." in figure.caption
    assert "before tuning on it, the root-mean-square error of 2\N{NO-BREAK SPACE}samples is 0.2" in figure.alt
    assert predictions_figure(halves).empty


def test_what_exploding_physics_says_is_drawn_too() -> None:
    predicted = predictions_figure([prediction(1e200, 1.0, 1.0)])
    tuning = squared_error_figure({1: {0: 1e-300}, 2: {0: 1e300}})

    assert "root-mean-square error 1e+200" in predicted.caption
    assert render_file(predicted, "svg")
    # matplotlib looks for ticks beyond the greatest number
    with catch_warnings(action="ignore", category=RuntimeWarning):
        assert render_file(tuning, "svg")


def test_what_is_too_large_to_be_reckoned_with_is_left_out_as_what_failed() -> None:
    huge = 1.7e308
    predicted = predictions_figure([prediction(huge, -huge, 1.0), prediction(0.5, 1.0, 1.0, 1)])
    tuning = squared_error_figure({1: {0: huge, 1: huge, 2: 1.0}, 2: {0: huge, 1: huge}}, each=True)

    assert marks(predicted)[BEFORE].y == (0.5,)  # type: ignore[union-attr]
    assert "1\N{NO-BREAK SPACE}sample left out" in predicted.caption
    assert marks(tuning)["Best simulator"].x[0] == 1  # type: ignore[index, union-attr]
    assert "4\N{NO-BREAK SPACE}values left out" in tuning.caption
    assert squared_error_figure({1: {0: huge}}).empty


@pytest.mark.parametrize("large", [pytest.param(1e300, marks=pytest.mark.release), 1.7e308])
def test_every_figure_is_drawn_however_large_its_numbers_are(large: float) -> None:
    ends = [point(at, value, sd=large) for at, value in enumerate((large, -large, 1.0))]
    figures = [
        curves_figure([curve("a", *ends)], band="sd", each=True),
        curves_figure([curve("a", *ends)], band="interval"),
        curves_figure([curve("a", point(0, large, sd=large)).model_copy(update={"level": True})]),
        curves_figure([curve("a", *ends), DIRECT.model_copy(update={"best_of": (large, None, 1.0)})]),
        predictions_figure([prediction(large, -large, large), prediction(0.5, 1.0, 1.0, 1)]),
        squared_error_figure({1: {0: large, 1: large, 2: 1.0}, 2: {0: large}}, each=True),
        squared_error_figure({1: {0: large}, 2: {0: large, 1: large}}),
    ]

    for figure in figures:
        json.dumps(chart(figure), allow_nan=False)
        with catch_warnings(action="ignore", category=RuntimeWarning):
            assert render_file(figure, "svg")


def log(first: int, *, iterations: int, fitness: float | None = 1.0) -> Iterator[Any]:
    """Every phase of iteration k takes 10 rollouts times what it begins with; the last may have no fitness."""
    for iteration in range(iterations + 1):
        genome = frozen([0.5] * 8)
        if iteration:
            yield Selected(iteration, genome, Cost(10 * first))
            yield Measured(iteration, Sample(genome, 1.0))
        yield TunedStep(iteration, (Simulator(frozen([0.1 * first, 0.5]), 0.25),), Cost(10 * first))
        yield Transferred(iteration, genome, 1.0, Cost(10 * first))
        yield Probed(iteration, 1.0, fitness if fitness is not None else float("nan"))


@pytest.fixture
def experiment(store: Store) -> str:
    """Two repetitions of three that have ended, of 20 and 40 rollouts at first, and 30 and 60 with each iteration."""
    made = submit_one(store, toy(repetitions=3)).id
    for claim in execution.claim(store, "test", limit=2):
        run(store, claim, log(claim.number + 1, iterations=2))
    return made


def test_rollouts_are_counted_from_the_start_over_those_that_got_there(store: Store, experiment: str) -> None:
    found_curves = curves.curves(store, [experiment])

    found = cost_axis(store, found_curves, CostModel(x="rollouts"))

    assert found.label == "Rollouts in simulation"
    assert [found.at[experiment, at] for at in range(3)] == [30, 75, 120]


def test_the_baseline_which_is_drawn_across_has_no_say_in_the_units_of_the_axis(store: Store, experiment: str) -> None:
    direct = submit_one(store, toy(strategy="direct", repetitions=1)).id
    (claim,) = (each for each in execution.claim(store, "test", limit=2) if each.experiment_id == direct)
    genome = frozen([0.5])
    steps = TunedStep(0, ()), Transferred(0, genome, 1.0, Cost(10_000_000)), Probed(0, 1.0, 1.0)
    run(store, claim, iter(steps))

    found = cost_axis(store, curves.curves(store, [experiment, direct]), CostModel(x="rollouts"))

    assert found.label == "Rollouts in simulation"


def test_time_is_that_of_evaluations_and_of_simulation_as_measured(store: Store, experiment: str) -> None:
    found_curves = curves.curves(store, [experiment])

    simulated, both = (cost_axis(store, found_curves, CostModel(x="time", cost_s=each)) for each in (0, 3600))

    steps = [2, 5, 8]  # of half a second each: to tune, select and transfer; to measure is not simulation
    assert simulated.label == "Time (s)"
    assert [simulated.at[experiment, at] for at in range(3)] == pytest.approx([each / 2 for each in steps])
    assert both.label == "Time (min)"
    assert both.at[experiment, 2] == pytest.approx(120 + 4.0 / 60)
    assert "at 3600\N{NO-BREAK SPACE}s each and simulation as measured" in both.note


def test_a_cost_has_a_price_for_the_machine_for_attention_and_for_wear(store: Store, experiment: str) -> None:
    model = CostModel(x="cost", cost_s=90, rollout_s=12, cores=4, machine=2, attention=40, wear=0.25)

    found = cost_axis(store, curves.curves(store, [experiment]), model)

    rollouts = [30, 75, 120]
    expected = [k * (40 * 90 / 3600 + 0.25) + 2 * each * 12 / 4 / 3600 for k, each in enumerate(rollouts)]
    assert [found.at[experiment, at] for at in range(3)] == pytest.approx(expected)
    assert found.label == "Cost"
    assert "40 an hour of real-world evaluations at 90" in found.note


def test_experiments_are_compared_after_the_last_evaluation_that_each_could_pay_for(
    store: Store, experiment: str
) -> None:
    dear, late = (submit_one(store, toy(strategy="random", repetitions=2, seed=each)).id for each in (1, 2))
    for claim in execution.claim(store, "test", limit=9):
        if claim.experiment_id != experiment:
            steps = list(log(4, iterations=2))  # 80 rollouts, then 120 with each iteration
            probes = [replace(each, recorded=5.0 + each.iteration) for each in steps if isinstance(each, Probed)]
            run(store, claim, iter(probes.pop(0) if isinstance(each, Probed) else each for each in steps))
    ids = [experiment, dear, late]

    cheap, *_ = compare(store, ids, model=CostModel(x="rollouts"))  # the first one has spent 120
    at_100, *_ = compare(store, ids, model=CostModel(x="rollouts"), at=100)
    slow, *_ = compare(store, ids, model=CostModel(x="time", cost_s=9, rollout_s=1, cores=10))

    assert (cheap.cost, cheap.where) == (120, "at 120 rollouts")
    assert (cheap.evaluations_first, cheap.evaluations_second) == (2, 0)
    assert cheap.summary_second.mean.value == 5.0
    assert (at_100.evaluations_first, at_100.evaluations_second) == (1, 0)
    assert slow.cost == pytest.approx(18 + 12)
    assert (slow.evaluations_first, slow.evaluations_second) == (2, 1)
    assert slow.summary_second.mean.value == 6.0
    with pytest.raises(InvalidSpec, match="no experiment has spent 1,000 rollouts; the most is 320 rollouts"):
        compare(store, ids, model=CostModel(x="rollouts"), at=1000)
    with pytest.raises(InvalidSpec, match="or at equal cost"):
        compare(store, ids, to_evaluations=1, model=CostModel(x="rollouts"))


def test_reality_is_among_the_simulators_only_once_all_of_its_study_have_ended(store: Store, experiment: str) -> None:
    running = tuned_simulators(store, experiment)
    cancel(store, experiment)
    ended = tuned_simulators(store, experiment)

    assert running.truth is None
    assert set(ended.truth or {}) == {"static_friction", "dynamic_friction"}
    assert ended.errors == {1: {0: 0.25, 1: 0.25}, 2: {0: 0.25, 1: 0.25}}
    assert [each.name for each in ended.dimensions] == ["static_friction", "dynamic_friction"]
    assert len(ended.simulators) == 6
