"""Reports: verdicts that follow from their rules, and one page with all that they rest on."""

import shutil
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.schemas.lifecycle import ExtensionSpec, Verb
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.core.types import Probed
from gaplab.services.experiments import lifecycle, listing, reading, submission
from gaplab.services.reports.blocks import Code, Paragraph
from gaplab.services.reports.content import facts_of, verdict_on
from gaplab.services.reports.document import report_of
from gaplab.services.running import execution
from gaplab.services.specs.resolution import resolve, resolve_experiment
from gaplab.services.store.lease import Claim
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.session import Store
from tests.archiving import imported
from tests.experiments import run, some_log, submit_one, toy

STUDIES = Path(__file__).parents[2] / "docs" / "studies"
EVIL = "<script>alert(1)</script>"


@pytest.fixture
def api(sqlite_store: Store) -> Iterator[TestClient]:
    app = create_app(sqlite_store)
    yield TestClient(app)
    app.state.rollout_process.close()


@pytest.fixture(scope="module")
def published(sqlite_template: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    """A store with a published study, with eight repetitions of each strategy and three evaluations; only read."""
    store = Store(f"sqlite:///{shutil.copy(sqlite_template, tmp_path_factory.mktemp('published') / 'gaplab.db')}")
    imported(store, (STUDIES / "a1-pybullet-open-fitness.zip").read_bytes())
    yield store
    store.dispose()


@pytest.fixture
def study(published: Store) -> str:
    """The id of the published study."""
    (study,) = listing.list_studies(published).items
    return study.id


@pytest.fixture
def reader(published: Store) -> Iterator[TestClient]:
    """Asks for the published study."""
    app = create_app(published)
    yield TestClient(app)
    app.state.rollout_process.close()


class Page(HTMLParser):
    """What stands in a page: tags, addresses and text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.addresses: list[str] = []
        self.words = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.append(tag)
        self.addresses += [value for name, value in attrs if name in {"src", "href"}]

    def handle_data(self, data: str) -> None:
        self.words += data


def recorded(store: Store, means: list[float], spread: float, repetitions: int = 8) -> str:
    """An experiment with these recorded values, a constant apart in each repetition."""
    spec = toy(iterations=len(means) - 1, repetitions=repetitions)
    made = submit_one(store, ExperimentSpec.model_validate(spec)).id
    for claim in execution.claim(store, "test", limit=repetitions):
        record(store, claim, means, spread, repetitions)
    return made


def record(store: Store, claim: Claim, means: list[float], spread: float, repetitions: int = 8) -> None:
    """Complete a repetition with these recorded values."""
    for step in some_log(len(means) - 1):
        if isinstance(step, Probed):
            offset = spread * (claim.number - repetitions / 2)
            step = Probed(step.iteration, 0.5, means[step.iteration] + offset)
        assert execution.record(store, claim, step, seconds=0.5)
    assert execution.complete(store, claim)


def test_the_verdict_on_a_flat_curve_says_since_when_and_advises(sqlite_store: Store, api: TestClient) -> None:
    made = recorded(sqlite_store, [0.2, 0.5, 0.8, 1.0, 1.0, 1.0, 1.0], spread=0.05)

    verdict = api.get(f"/studies/{made}/report", params={"format": "json"}).json()

    assert verdict["headline"] == "Flat since iteration 3; not worth continuing."
    (trend,) = verdict["trends"]
    assert (trend["trend"], trend["since"], trend["last"], trend["continuing"]) == ("flat", 3, 6, False)


def test_the_verdict_on_a_rising_curve_advises_to_continue(sqlite_store: Store, api: TestClient) -> None:
    made = recorded(sqlite_store, [0.2, 0.4, 0.6, 0.8, 1.0], spread=0.05)

    verdict = api.get(f"/studies/{made}/report", params={"format": "json"}).json()

    assert verdict["headline"] == "Still rising: Simulated fit."
    assert verdict["trends"][0]["continuing"] is True


def test_four_repetitions_are_too_few_for_a_verdict(sqlite_store: Store, api: TestClient) -> None:
    made = recorded(sqlite_store, [0.2, 0.5, 1.0, 1.0, 1.0, 1.0], spread=0.05, repetitions=4)

    verdict = api.get(f"/studies/{made}/report", params={"format": "json"}).json()

    assert verdict["headline"] == "Too few repetitions or evaluations to say whether continuing is worthwhile."
    assert verdict["trends"][0]["continuing"] is None


def test_the_verdict_on_a_study_agrees_with_the_comparison_at_the_last_count(
    published: Store, reader: TestClient, study: str
) -> None:
    experiments = reading.read(published, study).experiments
    asked: Any = {"study": [each.id for each in experiments], "from": 3, "to": 3}
    pairs = reader.get("/comparisons", params=asked).json()
    learned = {each.id for each in experiments if not each.direct}
    compared = [pair for pair in pairs if {pair["first"], pair["second"]} <= learned]
    differing = [pair for pair in compared if pair["trusted"]["p_holm"] < 0.05]

    verdict = verdict_on(published, reading.read(published, study))

    assert verdict.evaluations == 3
    assert 0 < len(differing) < len(compared)
    start = f"{len(differing)} of {len(compared)} pairs of strategies differ at 3 real-world evaluations"
    assert verdict.headline.replace("\xa0", " ").startswith(start)
    assert "does not show that two strategies are equal" in verdict.rules[0]


@pytest.mark.parametrize(
    ("ahead", "headline"),
    [(0.01, "No strategy is shown to differ from another at 4"), (0.3, "The strategies differ at 4")],
)
def test_the_verdict_on_two_strategies(sqlite_store: Store, ahead: float, headline: str) -> None:
    spec = toy(iterations=4, repetitions=8).model_dump(mode="json", exclude_unset=True, exclude={"strategy"})
    made = submission.submit(sqlite_store, StudySpec.model_validate({**spec, "strategies": ["random", "known_fit"]}))
    first = made.experiments[0].id
    for claim in execution.claim(sqlite_store, "test", limit=16):
        record(sqlite_store, claim, [0.2, 0.5, 0.6, 0.7, 0.7 + ahead * (claim.experiment_id == first)], spread=0.02)

    verdict = verdict_on(sqlite_store, reading.read(sqlite_store, made.id))
    assert verdict.headline.replace("\xa0", " ").startswith(headline)


def test_the_verdict_says_once_what_holds_of_several(sqlite_store: Store) -> None:
    spec = toy(iterations=2, repetitions=8).model_dump(mode="json", exclude_unset=True, exclude={"strategy"})
    strategies = ["random", "known_fit", "farthest"]
    made = submission.submit(sqlite_store, StudySpec.model_validate({**spec, "strategies": strategies}))
    worse = made.experiments[1].id
    for claim in execution.claim(sqlite_store, "test", limit=24):
        last = 1.0 if claim.experiment_id != worse else 0.5 if claim.number else 20.0
        record(sqlite_store, claim, [0.1, 0.2, last], spread=0.02)

    verdict = verdict_on(sqlite_store, reading.read(sqlite_store, made.id))
    told = [sentence.replace("\xa0", " ") for sentence in verdict.sentences]

    assert (
        "Pairs that are not shown to differ by the test that the verdict uses, although p is below 0.05 by "
        "Mann-Whitney: Random and Known fit; Known fit and Farthest." in told
    )
    few = "8 repetitions at 2 real-world evaluations are too few to say whether fitness still rises."
    assert f"Random, Known fit and Farthest: {few}" in told


def test_the_verdict_tells_the_share_of_direct(published: Store, study: str) -> None:
    sentences = verdict_on(published, reading.read(published, study)).sentences

    assert any("Share of the fitness of Direct" in sentence and "%" in sentence for sentence in sentences)


def test_only_a_margin_turns_no_significance_into_no_difference(reader: TestClient, study: str) -> None:
    def told(**query: Any) -> str:
        verdict = reader.get(f"/studies/{study}/report", params={"format": "json", **query}).json()
        return " ".join([verdict["headline"], *verdict["sentences"]])

    plain, wide, narrow, share = told(), told(margin=100), told(margin=1e-6), told(margin_of_direct=50)

    assert "not shown to differ" in plain
    assert "No difference" not in plain
    assert "No difference between strategies within ±100 at 3" in wide
    assert "No difference from Direct within ±100" in wide
    assert "not shown to differ from" not in wide
    assert narrow == plain
    assert "No difference from Direct within ±" in share


def test_a_study_without_results_has_no_verdict(sqlite_store: Store) -> None:
    made = submission.submit(sqlite_store, StudySpec.model_validate({"robot": "toy_function", "budget": "smoke"}))

    assert verdict_on(sqlite_store, reading.read(sqlite_store, made.id)).headline == "There are no results yet."


def test_the_page_needs_no_other_file_and_no_script(reader: TestClient, study: str) -> None:
    answer = reader.get(f"/studies/{study}/report")

    page = Page(answer.text)
    assert answer.headers["content-type"].startswith("text/html")
    assert f'filename="gaplab-{study}-report.html"' in answer.headers["content-disposition"]
    assert "script" not in page.tags
    assert all(address.startswith("data:image/svg+xml;base64,") for address in page.addresses)
    assert page.tags.count("img") == 3
    for heading in ("Verdict", "Which differ", "Simulators", "Cost", "Settings", "Provenance", "How to reproduce it"):
        assert heading in page.words
    assert "pooled as in the paper" in page.words
    assert "not independent" in page.words


def test_a_name_cannot_become_markup(sqlite_store: Store, api: TestClient) -> None:
    made = submit_one(sqlite_store, toy(name=EVIL)).id

    text = api.get(f"/studies/{made}/report").text

    assert EVIL not in text
    assert EVIL in Page(text).words


def test_hidden_parameters_of_reality_are_in_no_report(sqlite_store: Store, api: TestClient) -> None:
    secret = 0.7319462853
    reality = {"parameters": {"static_friction": secret, "dynamic_friction": 0.3}}
    made = submit_one(sqlite_store, toy(reality=reality)).id
    (claim, *_) = execution.claim(sqlite_store, "test", limit=1)
    run(sqlite_store, claim)

    hidden = api.get(f"/studies/{made}/report").text
    lifecycle.ask(sqlite_store, made, Verb.CANCEL)

    assert str(secret) not in hidden
    assert str(secret) in api.get(f"/studies/{made}/report").text


def test_the_spec_in_a_report_gives_the_same_experiments(published: Store, study: str) -> None:
    experiments = reading.read(published, study).experiments

    (spec,), _ = how_to_reproduce(published, study)
    resolved = resolve(StudySpec.model_validate_json(spec))

    known = set(experiments[0].spec)  # without the schedule, which changes no number
    stored = [{**each.spec, "name": None} for each in experiments]
    assert [{**each.model_dump(mode="json", include=known), "name": None} for each in resolved] == stored


def how_to_reproduce(store: Store, study: str) -> tuple[list[str], list[str]]:
    """Return the specs and the sentences of the report's section."""
    blocks = report_of(facts_of(store, reading.read(store, study))).sections[-1].blocks
    return (
        [block.text for block in blocks if isinstance(block, Code)],
        [block.text for block in blocks if isinstance(block, Paragraph)],
    )


def two_strategies(store: Store) -> tuple[str, list[str]]:
    """A study with two repetitions of two strategies, and the ids of its experiments."""
    spec = toy(repetitions=2).model_dump(mode="json", exclude_unset=True, exclude={"strategy"})
    both = StudySpec.model_validate({**spec, "strategies": ["simulated_fit", "informative"]})
    made = submission.submit(store, both)
    return made.id, [experiment.id for experiment in made.experiments]


def test_the_spec_of_a_study_of_which_one_experiment_was_extended_has_the_size_that_all_have(
    sqlite_store: Store,
) -> None:
    study, (extended, _) = two_strategies(sqlite_store)
    for claim in execution.claim(sqlite_store, "test", limit=4):
        run(sqlite_store, claim)
    lifecycle.extend(sqlite_store, extended, ExtensionSpec(repetitions=3))

    (spec,), sentences = how_to_reproduce(sqlite_store, study)

    resolved = resolve(StudySpec.model_validate_json(spec))
    assert [(each.strategy.name, each.repetitions) for each in resolved] == [("simulated_fit", 2), ("informative", 2)]
    remark = "Experiments were extended since; the spec has the iterations and repetitions that all have."
    assert remark in sentences


def test_experiments_without_a_single_spec_have_a_spec_each(sqlite_store: Store) -> None:
    study, (changed, _) = two_strategies(sqlite_store)
    with sqlite_store.transaction() as session:
        row = session.get(ExperimentRow, changed)
        assert row is not None
        row.spec = {**row.spec, "seed": 5}

    specs, sentences = how_to_reproduce(sqlite_store, study)

    resolved = [resolve_experiment(ExperimentSpec.model_validate_json(spec)) for spec in specs]
    assert [(each.strategy.name, each.seed) for each in resolved] == [("simulated_fit", 5), ("informative", 0)]
    assert {"Save each spec below as a file and submit it: gaplab submit spec.json --watch", "Simulated fit:"} <= set(
        sentences
    )
    assert any(sentence.startswith("The experiments differ in more") for sentence in sentences)


def test_there_is_no_report_of_nothing(api: TestClient) -> None:
    for format_ in ("html", "json"):
        assert api.get("/studies/nope/report", params={"format": format_}).status_code == 404
