"""Strategies without samples: levels across the figure, which are not the direct baseline."""

from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from rich.console import Console

from gaplab.api.app import create_app
from gaplab.api.commands import tables
from gaplab.schemas.lifecycle import ExtensionSpec
from gaplab.schemas.records import common_count
from gaplab.schemas.spec import StudySpec
from gaplab.services.archives import export, import_archive
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import estimates, lifecycle, listing, reading, submission
from gaplab.services.figures.kinds.curves import curves_figure
from gaplab.services.figures.marks import Level
from gaplab.services.reports.content import facts_of
from gaplab.services.results import comparisons, curves
from gaplab.services.results.misfit import misfit
from gaplab.services.results.toy import toy_iterations
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve
from gaplab.services.store.lease import TimedStep
from gaplab.services.store.session import Store
from tests.conftest import filled

SPEC = StudySpec.model_validate({
    "strategies": [
        "simulated_fit", {"name": "domain_randomization", "options": {"simulators": 4}}, "noise_envelope", "direct",
    ],
    "robot": "toy_function", "tunables": ["static_friction", "dynamic_friction"], "budget": "smoke",
    "iterations": 2, "repetitions": 2, "direct_repetitions": 3,
})  # fmt: skip


def compute(store: Store) -> None:
    while claims := execution.claim(store, "me", 20):
        for each in claims:
            steps = repetition(setting(each.spec, each.number), each.log)
            execution.record_all(store, [(each, [TimedStep(step, 0.1) for step in steps])])
        execution.complete(store, *claims)


def fill(store: Store) -> None:
    submission.submit(store, SPEC)
    compute(store)


@pytest.fixture(scope="module")
def sqlite_template(sqlite_template: Path) -> Path:
    """A database with the study."""
    return filled(sqlite_template, fill)


@pytest.fixture
def study(sqlite_store: Store) -> Any:
    (found,) = listing.list_studies(sqlite_store).items
    return reading.read(sqlite_store, found.id)


def test_a_level_is_not_direct_and_has_a_single_point(sqlite_store: Store, study: Any) -> None:
    found = curves.curves(sqlite_store, [study.id])

    assert [(each.level, each.direct) for each in study.experiments] == [
        (False, False), (True, False), (True, False), (True, True),
    ]  # fmt: skip
    assert [(each.level, each.direct, len(each.points)) for each in found] == [
        (False, False, 3), (True, False, 1), (True, False, 1), (True, True, 1),
    ]  # fmt: skip
    assert common_count(study.experiments) == 2
    assert study.experiments[1].progress.counted_iterations == 0


def test_a_level_is_drawn_across_the_figure_with_a_look_of_its_own(sqlite_store: Store, study: Any) -> None:
    figure = curves_figure(curves.curves(sqlite_store, [study.id]))

    levels = [mark for mark in figure.panels[0].marks if isinstance(mark, Level)]
    assert [(level.style.ink, level.marked) for level in levels] == [(False, True), (False, True), (True, False)]
    assert len({level.style.color for level in levels}) == len({level.style.marker for level in levels}) == 3
    assert "Noise envelope: without samples" in figure.caption
    assert figure.caption.count("evolved in reality itself") == 1


def test_a_level_is_compared_with_every_number_and_can_be_the_best(sqlite_store: Store, study: Any) -> None:
    fit, randomized, *_ = ids = [each.id for each in study.experiments]

    pairs = {(each.first, each.second): each for each in comparisons.compare(sqlite_store, ids, from_evaluations=2)}

    assert (pairs[fit, randomized].n_first, pairs[fit, randomized].n_second) == (2, 2)
    means = {each.id: each.fitness.mean for each in study.experiments if not each.direct}
    assert study.best.experiment == max(means, key=lambda id_: means[id_])
    verdict = facts_of(sqlite_store, study).verdict
    assert any("domain_randomization" in each or "Domain randomization" in each for each in verdict.sentences)


def test_a_level_has_no_iterations_to_add_and_no_misfit(sqlite_store: Store, study: Any) -> None:
    envelope = study.experiments[2].id

    with pytest.raises(InvalidSpec, match="noise_envelope has no iterations"):
        lifecycle.extend(sqlite_store, envelope, ExtensionSpec(iterations=5))
    assert lifecycle.extend(sqlite_store, envelope, ExtensionSpec(repetitions=3)).progress.repetitions == 3
    assert misfit(sqlite_store, envelope).points == ()


def test_the_toy_shows_all_random_simulators_of_a_level(sqlite_store: Store, study: Any) -> None:
    (shown,) = toy_iterations(sqlite_store, study.experiments[1].id, 0, [])

    assert len(shown.approximations) == 4
    assert shown.samples == ()


def test_figures_of_tuned_simulators_say_why_they_are_empty(sqlite_store: Store, study: Any) -> None:
    api = TestClient(create_app(sqlite_store))

    for kind in ("simulators", "squared-error"):
        for experiment, why in ((1, "its strategy"), (3, "the direct baseline")):
            parameters = {"experiment": study.experiments[experiment].id, "format": "json"}
            found = api.get(f"/figures/{kind}", params=parameters).json()
            assert (found["empty"], found["alt"]) == (True, f"Nothing: {why} tunes no simulators.")


@pytest.mark.release
def test_a_level_is_exported_and_imported_and_its_study_submitted_again(sqlite_store: Store, study: Any) -> None:
    again = reading.read_spec(sqlite_store, study.id)
    with export(sqlite_store, study.id).file as file:
        data = file.read()

    assert again.spec is not None
    assert resolve(StudySpec.model_validate(again.spec)) == resolve(SPEC)
    assert again.spec["direct_repetitions"] == 3
    imported = import_archive(sqlite_store, BytesIO(data))
    assert [each.level for each in reading.read(sqlite_store, imported.study).experiments] == [False] + [True] * 3


def test_an_extended_study_with_a_level_keeps_one_spec(sqlite_store: Store, study: Any) -> None:
    lifecycle.extend(sqlite_store, study.experiments[0].id, ExtensionSpec(iterations=4))

    again = reading.read_spec(sqlite_store, study.id, reveal=True)

    assert again.spec is not None
    assert again.spec["iterations"] == 4


def test_an_estimate_counts_all_rollouts_of_a_level_and_no_iterations(sqlite_store: Store) -> None:
    found = estimates.estimate(sqlite_store, SPEC)

    assert [each.iterations for each in found.experiments] == [2, 0, 0, 0]
    assert [each.rollouts for each in found.experiments[1:]] == [2 * 4 * 60, 2 * 8 * 60, 3 * 60]


def test_a_terminal_tells_levels_from_the_baseline(sqlite_store: Store, study: Any) -> None:
    found = curves.curves(sqlite_store, [study.id])
    console = Console(file=StringIO(), width=120)
    console.print(tables.curves(found))

    assert "domain randomization" not in console.file.getvalue()  # type: ignore[attr-defined]
    lines = tables.baselines(found)
    assert ["without samples" in line for line in lines] == [True, True, False]
    assert "evolved in reality itself" in lines[-1]
