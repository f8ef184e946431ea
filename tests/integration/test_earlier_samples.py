"""Samples from before an experiment: whatever counts its real-world evaluations says how many there were."""

from typing import Any

from gaplab.services.experiments.reading import read, read_experiment
from gaplab.services.figures.kinds.curves import curves_figure
from gaplab.services.figures.kinds.toy import toy_figure
from gaplab.services.reports.content import verdict_on
from gaplab.services.results.comparisons import compare
from gaplab.services.results.curves import curves
from gaplab.services.results.misfit import misfit
from gaplab.services.results.toy import toy_iterations
from gaplab.services.store.session import Store
from tests.commands import Gaplab
from tests.experiments import submit_one
from tests.integration.test_bench import bench, finish, truth

GENES = (0.2, 0.7, 0.4, 0.9)


def ended(store: Store, genes: tuple[float, ...] = GENES, **changes: Any) -> str:
    """The id of an experiment that knows the fitness of these genes from before, and has ended."""
    real = truth(bench())
    known = [{"genome": [gene], "values": [real([gene])]} for gene in genes]
    experiment = submit_one(store, bench(**{"held_out": 0.25, "reality": {"samples": known}} | changes))
    finish(store, real)
    return experiment.id


def test_every_count_of_evaluations_says_how_many_samples_were_there_before(
    gaplab: Gaplab, sqlite_store: Store
) -> None:
    id_, without = ended(sqlite_store), ended(sqlite_store, ())

    figure, mixed = (curves_figure(curves(sqlite_store, ids)) for ids in ([id_], [id_, without]))
    (pair,) = compare(sqlite_store, [id_, without])
    said = {command: gaplab(command, id_).out for command in ("show", "curve")}

    assert figure.panels[0].x.label == "Number of real-world evaluations (and 4 from before)"
    assert mixed.panels[0].x.label == "Number of real-world evaluations (and 0–4 from before)"
    assert "4\N{NO-BREAK SPACE}samples from before are not counted." in figure.caption
    assert pair.where == "after 2\N{NO-BREAK SPACE}real-world evaluations (and 0–4 from before)"
    assert pair.where in gaplab("compare", id_, without).out
    assert "at 2 (and 4 from before)" in said["show"]
    assert "at 2 real-world evaluations (and 4 from before) the best simulator errs by" in said["show"]
    assert "after (and 4 from before)" in said["curve"]
    found = verdict_on(sqlite_store, read(sqlite_store, id_)).sentences
    assert found[0].startswith("After 2\N{NO-BREAK SPACE}real-world evaluations (and 4 from before), the mean of")
    assert "from before" not in gaplab("show", without).out


def test_an_experiment_on_earlier_samples_alone_has_a_verdict_and_steps_that_show_them(sqlite_store: Store) -> None:
    id_ = ended(sqlite_store, iterations=0)

    (toy,) = toy_iterations(sqlite_store, id_, 0, ())
    headline = verdict_on(sqlite_store, read(sqlite_store, id_)).headline

    assert [(each.iteration, each.gene) for each in toy.samples] == [(0, gene) for gene in GENES]
    assert toy.error is not None
    assert "Iteration 0: after 4\N{NO-BREAK SPACE}samples, the best simulator errs by" in toy_figure([toy]).caption
    assert "too few" not in headline.lower()
    assert "no results" not in headline


def test_a_strategy_that_takes_no_samples_is_a_level_also_where_some_are_known(
    gaplab: Gaplab, sqlite_store: Store
) -> None:
    id_ = ended(sqlite_store, strategy="domain_randomization")

    read = read_experiment(sqlite_store, id_)
    (toy,) = toy_iterations(sqlite_store, id_, 0, ())

    assert gaplab("show", id_).code == 0
    assert read.level
    assert read.fitness is not None
    assert read.fitness.known == 0
    assert (misfit(sqlite_store, id_).remarks, toy.samples) == ((), ())
