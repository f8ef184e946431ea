"""Curves and comparisons read from the store."""

import csv
import io
from typing import Any

import pytest

from gaplab.schemas.lifecycle import State
from gaplab.schemas.spec import StudySpec
from gaplab.services.core.errors import InvalidSpec, NotFound
from gaplab.services.experiments import submission
from gaplab.services.results import curves
from gaplab.services.results.comparisons import Margin, compare
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.experiments import run, some_log, submit_one, toy


def study_with_results(store: Store, recorded: Any = (1.0, 2.0)) -> Any:
    """A study of simulated fit and direct, two repetitions each, of which the first strategy's second is half done."""
    spec = toy().model_dump(exclude={"strategy", "name"}) | {
        "repetitions": 2,
        "strategies": ["simulated_fit", "direct"],
    }
    study = submission.submit(store, StudySpec.model_validate(spec))
    claims = execution.claim(store, "me", 9)
    first, second, *direct = sorted(claims, key=lambda each: (each.spec.strategy.name == "direct", each.number))
    run(store, first, some_log(recorded=recorded[0]))
    for step in list(some_log(recorded=recorded[1]))[:8]:
        execution.record(store, second, step)
    for claim, value in zip(direct, recorded, strict=True):
        run(store, claim, some_log(iterations=0, recorded=value))
    return study


@pytest.mark.dialects
def test_a_curve_has_the_recorded_fitness_of_each_repetition_at_each_count(store: Store) -> None:
    study = study_with_results(store)

    found = curves.curve(store, study.experiments[0].id)

    assert (found.experiment, found.strategy, found.unit) == (study.experiments[0].id, "simulated_fit", "m/s")
    assert (found.state, found.direct) == (State.RUNNING, False)
    assert [point.evaluations for point in found.points] == [0, 1, 2]
    assert [point.values for point in found.points] == [(1.0, 2.0), (2.0, 3.0), (3.0, None)]
    assert [point.n for point in found.points] == [2, 2, 1]
    assert found.points[0].mean == 1.5


def test_the_curve_of_direct_is_one_point_at_zero(store: Store) -> None:
    study = study_with_results(store)

    found = curves.curve(store, study.experiments[1].id)

    assert found.direct
    assert [(point.evaluations, point.values) for point in found.points] == [(0, (1.0, 2.0))]


def test_a_curve_is_as_long_as_what_was_computed_and_not_as_the_spec_asks_for(store: Store) -> None:
    experiment = submit_one(store, toy(iterations=1_000)).id
    before = curves.curve(store, experiment)
    (claim,) = execution.claim(store, "me", 1)
    for step in some_log(1):
        assert execution.record(store, claim, step)

    after = curves.curve(store, experiment)

    assert [(point.n, point.mean) for point in before.points] == [(0, None)]
    assert [(point.n, point.mean) for point in after.points] == [(1, 1.0), (1, 2.0)]


def test_a_failed_measurement_is_no_value_of_the_curve(store: Store) -> None:
    experiment = submit_one(store, toy(repetitions=1)).id
    (claim,) = execution.claim(store, "me", 1)
    run(store, claim, some_log(recorded=float("nan")))

    found = curves.curve(store, experiment)

    assert [point.values for point in found.points] == [(None,)] * 3


def test_the_curves_of_a_study_are_those_of_its_experiments_in_order(store: Store) -> None:
    study = study_with_results(store)
    ids = [each.id for each in study.experiments]

    found = curves.curves(store, [study.id])

    assert [each.experiment for each in found] == ids
    assert found == curves.curves(store, ids) == tuple(curves.curve(store, each) for each in ids)


def test_the_curves_of_what_is_not_there_are_not_found(store: Store) -> None:
    study = study_with_results(store)

    with pytest.raises(NotFound, match="no-such"):
        curves.curves(store, [study.experiments[0].id, "no-such"])
    with pytest.raises(NotFound, match="no-such"):
        curves.curves(store, ["no-such"])


def test_a_comparison_begins_at_the_last_shared_count_and_direct_counts_at_any(sqlite_store: Store) -> None:
    study = study_with_results(sqlite_store)
    ids = [each.id for each in study.experiments]

    (last,) = compare(sqlite_store, ids)
    (one,) = compare(sqlite_store, ids, to_evaluations=1)
    (whole,) = compare(sqlite_store, ids, from_evaluations=1, to_evaluations=2)

    assert (last.from_evaluations, last.to_evaluations) == (2, 2)
    assert (one.from_evaluations, one.n_first, one.n_second, one.difference) == (1, 2, 2, 1.0)
    assert (whole.n_first, whole.n_second) == (1, 2)  # a repetition that is half done lacks count 2
    assert whole.difference == pytest.approx((2 + 3) / 2 - 1.5)
    assert whole.pooled is not None
    assert (whole.pooled.n_first, whole.pooled.n_second) == (3, 2)
    assert whole.pooled.difference == pytest.approx((2 + 3 + 3) / 3 - 1.5)


def test_a_comparison_is_of_every_pair(sqlite_store: Store) -> None:
    ids = [submit_one(sqlite_store, toy()).id for _ in range(3)]

    found = compare(sqlite_store, ids)

    assert [(each.first, each.second) for each in found] == [(ids[0], ids[1]), (ids[0], ids[2]), (ids[1], ids[2])]
    assert {each.student.p for each in found} == {None}
    assert all(each.shared_streams for each in found)  # one seed and one strategy


def test_a_margin_as_a_share_of_direct_is_in_the_unit_of_fitness(sqlite_store: Store) -> None:
    study = study_with_results(sqlite_store)
    ids = [each.id for each in study.experiments]
    seeds = [submit_one(sqlite_store, toy(seed=seed)).id for seed in (1, 2)]

    (pair,) = compare(sqlite_store, ids, margin=Margin(0.1, of_direct=True))

    assert pair.equivalence is not None
    assert pair.equivalence.margin == pytest.approx(0.1 * 1.5)
    for without in ([seeds[0], ids[0]], seeds):
        margin = Margin(0.1, of_direct=True)
        if ids[0] in without:  # the baseline of its study is taken
            assert compare(sqlite_store, without, margin=margin)[0].equivalence is not None
        else:
            with pytest.raises(InvalidSpec, match="one direct baseline"):
                compare(sqlite_store, without, margin=margin)


@pytest.mark.parametrize("bounds", [(2, 1), (-1, 2), (3, None)])
def test_a_range_that_is_none_is_refused(sqlite_store: Store, bounds: Any) -> None:
    ids = [submit_one(sqlite_store, toy()).id for _ in range(2)]

    with pytest.raises(InvalidSpec, match="range"):
        compare(sqlite_store, ids, from_evaluations=bounds[0], to_evaluations=bounds[1])


def test_a_comparison_needs_two_experiments(sqlite_store: Store) -> None:
    one = submit_one(sqlite_store, toy()).id

    for ids in ([], [one], [one, one]):
        with pytest.raises(InvalidSpec, match="two or more"):
            compare(sqlite_store, ids)


def test_a_name_in_the_csv_is_no_formula(sqlite_store: Store) -> None:
    names = ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "=cmd|' /C calc'!A0"]
    ids = [submit_one(sqlite_store, toy(name=name, repetitions=1)).id for name in names]
    for claim in execution.claim(sqlite_store, "me", len(names)):
        run(sqlite_store, claim, some_log(recorded=-2.0))

    found = curves.curves_csv([curves.curve(sqlite_store, each) for each in ids])
    lines = list(csv.DictReader(io.StringIO(found, newline="")))

    assert {each["name"] for each in lines} == {f"'{name}".replace("\r", "\n") for name in names}
    assert lines[0]["fitness"] == "-2.0"


def test_the_csv_has_a_line_for_each_value(sqlite_store: Store) -> None:
    study = study_with_results(sqlite_store, recorded=(0.1 + 0.2, 1 / 3))

    lines = list(csv.DictReader(curves.curves_csv(curves.curves(sqlite_store, [study.id])).splitlines()))

    assert tuple(lines[0]) == curves.COLUMNS
    assert len(lines) == 5 + 2
    assert [float(each["fitness"]) for each in lines[:2]] == [0.1 + 0.2, 1 / 3]
    assert {each["strategy"] for each in lines} == {"simulated_fit", "direct"}
