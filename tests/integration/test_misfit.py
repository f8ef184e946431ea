"""Misfit from stored results."""

import csv
import io
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.misfit import Identification
from gaplab.services.core.errors import NotFound
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Measured, Sample, Selected, Simulator, Transferred, Tuned
from gaplab.services.experiments import reading
from gaplab.services.results.misfit import misfit, misfit_csv
from gaplab.services.results.tuned_simulators import tuned_simulators
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.store.queries import experiments
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.queries.replays import tuned_samples
from gaplab.services.store.queries.results import page_of_simulators
from gaplab.services.store.session import Store
from tests.experiments import run, some_log, submit_one, toy

SECRET = 0.987654321


def stored_log(store: Store, repetition: Any) -> Any:
    with store.reading() as session:
        return logs(session, [repetition])[repetition]


def test_the_misfit_is_that_of_the_best_simulator_of_each_repetition(store: Store) -> None:
    experiment = submit_one(store, toy(repetitions=2)).id
    for claim in execution.claim(store, "me", 2):
        run(store, claim)

    found = misfit(store, experiment)

    assert (found.experiment, found.unit) == (experiment, "m/s")
    assert [(each.iteration, each.error.n) for each in found.points] == [(0, 0), (1, 0), (2, 2)]
    last = found.points[-1]
    assert last.error.mean == pytest.approx(1e-150)  # of one sample: the other measurement failed
    assert (last.tunables[0].name, last.tunables[0].mean, last.tunables[0].upper) == ("static_friction", 0.1, 1.5)
    assert [each.gap.n for each in found.points] == [2, 0, 0]  # it failed in reality, then in simulation
    assert found.points[0].gap.mean == pytest.approx(1 / 3)
    assert found.remarks[0].startswith("at 2 real-world evaluations the best simulators err by 1e−150 m/s a sample")


def test_repetitions_that_are_under_way_count_as_far_as_they_are(store: Store) -> None:
    experiment = submit_one(store, toy(repetitions=2)).id
    first, second = execution.claim(store, "me", 2)
    run(store, first)
    for step in list(some_log())[:6]:  # up to the tuning of iteration 1
        execution.record(store, second, step)

    found = misfit(store, experiment)

    assert [each.tunables[0].n for each in found.points] == [2, 2, 1]


def test_advice_counts_samples_and_not_iterations(store: Store) -> None:
    """The repetitions disagree, and 40 samples are from before: two more do not tell whether more would help."""
    known = [{"genome": [0.5], "values": [0.5]}] * 40
    spec = toy(repetitions=5, reality={"kind": "physical", "samples": known})
    experiment = submit_one(store, spec).id
    for number, claim in enumerate(execution.claim(store, "me", 5)):
        found = Simulator(np.array([0.3 * number, 0.2 * number]), 0.04)
        for step in some_log():
            execution.record(store, claim, replace(step, simulators=(found,)) if isinstance(step, Tuned) else step)

    told = misfit(store, experiment)

    assert [each.error.n for each in told.points] == [5, 5, 5]
    assert [each.verdict for each in told.verdicts] == [Identification.NOT] * 2
    assert not any("more samples" in sentence for each in told.verdicts for sentence in each.helps)


def test_a_coefficient_at_its_bound_is_remarked_on(store: Store) -> None:
    experiment = submit_one(store, toy(repetitions=1, iterations=1)).id
    (claim,) = execution.claim(store, "me", 1)
    simulators = (Simulator(np.array([1.5, 0.7]), 0.04),)
    log = [
        *some_log(0),
        Selected(1, np.array([0.5])),
        Measured(1, Sample(np.array([0.5]), 0.3)),
        Tuned(1, simulators),
        Transferred(1, np.array([0.1]), 0.5),
    ]
    for step in log:
        execution.record(store, claim, step)

    found = misfit(store, experiment)

    assert found.remarks == (
        "at 1 real-world evaluation the best simulator errs by 0.2 m/s a sample",
        "static_friction is at its upper bound, 1.5, in 100 % of 1 repetition",
    )


def test_an_experiment_without_results_has_no_misfit_yet_and_the_direct_baseline_never(store: Store) -> None:
    waiting = submit_one(store, toy()).id
    execution.claim(store, "me", 9)
    direct = submit_one(store, toy(strategy="direct", repetitions=1)).id
    (claim,) = execution.claim(store, "me", 9)
    run(store, claim, some_log(iterations=0))

    for each in (waiting, direct):
        assert (misfit(store, each).points, misfit(store, each).remarks) == ((), ())


def test_a_strategy_that_tunes_nothing_has_no_misfit_and_no_tuned_simulators(store: Store) -> None:
    untuned = submit_one(store, toy(strategy="transferability", robot="quadruped", repetitions=1, held_out=0.5)).id
    (claim,) = execution.claim(store, "me", 9)
    run(store, claim)

    found = misfit(store, untuned)

    assert (found.points, found.remarks, found.verdicts) == ((), (), ())
    assert tuned_simulators(store, untuned).simulators == ()
    with store.reading() as session:
        row = experiments.get_experiment(session, untuned)
        assert not tuned_samples(session, row)
        assert {each.error for each in page_of_simulators(session, untuned).items} == {None}


def test_nothing_of_reality_is_shown(store: Store) -> None:
    spec = toy(repetitions=1, reality={"parameters": {"static_friction": SECRET}})
    experiment = submit_one(store, spec).id
    run(store, execution.claim(store, "me", 1)[0])

    assert str(SECRET) not in misfit(store, experiment).model_dump_json()


def test_the_misfit_of_an_unknown_experiment_is_not_found(store: Store) -> None:
    with pytest.raises(NotFound, match="no-such"):
        misfit(store, "no-such")


def test_held_out_samples_are_stored_and_their_error_is_shown_beside_the_other(store: Store) -> None:
    experiment = submit_one(store, toy(repetitions=1, held_out=0.5)).id
    (claim,) = execution.claim(store, "me", 1)
    for step in repetition(setting(claim.spec, 0)):
        assert execution.record(store, claim, step)

    found = misfit(store, experiment)

    tuned = [step.simulators[0] for step in stored_log(store, claim.id) if isinstance(step, Tuned)]
    assert [each.held_out_error is None for each in tuned] == [True, True, False]
    last = found.points[-1]
    assert found.held_out == 0.5
    assert last.held_out_error.mean == pytest.approx(tuned[-1].held_out_error ** 0.5)  # type: ignore[operator]
    assert last.error.mean == pytest.approx(tuned[-1].squared_error ** 0.5)  # of sample 1 alone
    assert found.points[1].held_out_error.n == 0
    assert found.remarks[-1].startswith("on held-out samples the best simulators err by")
    assert [each.verdict for each in found.verdicts] == [Identification.UNKNOWN] * 2
    shown = reading.list_simulators(store, experiment).items
    assert [each.held_out_error for each in shown] == [each.held_out_error for each in tuned]
    assert shown[-1].error == last.error.mean
    table = list(csv.DictReader(io.StringIO(misfit_csv(found))))
    (line,) = (row for row in table if row["iteration"] == "2" and row["what"] == "held_out_error")
    assert float(line["mean"]) == last.held_out_error.mean


def test_a_posterior_and_intervals_say_what_a_single_repetition_knows(store: Store) -> None:
    experiment = submit_one(store, toy(repetitions=1, iterations=1)).id
    (claim,) = execution.claim(store, "me", 1)
    interval = np.array([[0.9, 1.1], [0.0, 1.5]])
    simulators = (
        Simulator(np.array([1.0, 0.7]), 0.04, interval, 0.5),
        Simulator(np.array([1.1, 0.9]), 0.05, None, 0.5),
    )
    log = [*some_log(0), Selected(1, np.array([0.5])), Measured(1, Sample(np.array([0.5]), 0.3)), Tuned(1, simulators)]
    for step in log:
        execution.record(store, claim, step)

    static, dynamic = misfit(store, experiment).verdicts

    assert (static.verdict, dynamic.verdict) == (Identification.IDENTIFIED, Identification.NOT)
    assert static.remaining == pytest.approx(0.2 / (0.95 * 1.5))
    assert misfit(store, experiment).points[-1].tunables[0].posterior == pytest.approx(0.05 / (1.5 / 12**0.5))
