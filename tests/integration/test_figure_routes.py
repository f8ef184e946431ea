"""Figures over HTTP: every kind in every format, and what is said of those that are none."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from io import BytesIO
from itertools import islice
from pathlib import Path

import httpx2
import matplotlib.image
import pytest
from fastapi.testclient import TestClient
from plotly.graph_objects import Figure

from gaplab.api.app import create_app
from gaplab.api.clients.figures import OF_SEVERAL
from gaplab.api.http import figures
from gaplab.api.http.figures import MEDIA_TYPES
from gaplab.schemas.lifecycle import State
from gaplab.schemas.spec import StudySpec
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import submission
from gaplab.services.figures.matplotlib import files
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.store.session import Store
from gaplab.services.waiting_line import LENGTH, WaitingLine
from tests.conftest import filled
from tests.experiments import listed, run

STUDY = {
    "name": "Two <b>ways</b>",
    "strategies": ["simulated_fit", "random", "direct"],
    "robot": "toy_function",
    "tunables": ["static_friction", "dynamic_friction"],
    "iterations": 2,
    "repetitions": 3,
    "budget": "smoke",
}
KINDS = ["curves", "simulators", "squared-error", "coordinates"]
HIDDEN = 0.7319462853
DEADLINE_S = 120.0


@pytest.fixture
def api(sqlite_store: Store) -> Iterator[TestClient]:
    app = create_app(sqlite_store)
    yield TestClient(app)
    app.state.rollout_process.close()


def fill(store: Store) -> None:
    """A study of which only the first experiment has ended."""
    spec = STUDY | {"reality": {"parameters": {"static_friction": HIDDEN, "dynamic_friction": 0.3}}}
    first = submission.submit(store, StudySpec.model_validate(spec)).experiments[0].id
    for claim in execution.claim(store, "test", limit=20):
        if claim.experiment_id == first:
            run(store, claim)


@pytest.fixture(scope="module")
def sqlite_template(sqlite_template: Path) -> Path:
    """A database with the study."""
    return filled(sqlite_template, fill)


@pytest.fixture
def experiment(sqlite_store: Store) -> str:
    """The one that has ended."""
    (found,) = [each.id for each in listed(sqlite_store) if each.state is State.COMPLETED]
    return found


def about(kind: str, id_: str, form: str = "json") -> dict[str, str]:
    """The parameters of a figure of this kind."""
    return {"study" if kind in OF_SEVERAL else "experiment": id_, "format": form}


@pytest.mark.parametrize(
    "kind", ["curves", *(pytest.param(each, marks=pytest.mark.release) for each in KINDS if each != "curves")]
)
def test_every_kind_is_served_in_every_format(api: TestClient, experiment: str, kind: str) -> None:
    answers = {name: api.get(f"/figures/{kind}", params=about(kind, experiment, name)) for name in MEDIA_TYPES}

    for name, answer in answers.items():
        assert answer.status_code == 200, answer.text
        assert answer.headers["content-type"].partition(";")[0] == MEDIA_TYPES[name]
        policy = answer.headers["content-security-policy"]
        assert ("script-src" in policy) == (name == "html")
        assert "default-src 'none'" in policy
    found = answers["json"].json()
    assert Figure(found["figure"]).data
    assert found["empty"] is False
    assert found["alt"].endswith(".")
    assert "3\N{NO-BREAK SPACE}repetitions" in found["caption"] or kind in {"curves", "coordinates"}
    assert found["table"]["rows"]
    assert ET.fromstring(answers["svg"].text).tag.endswith("svg")
    assert answers["pdf"].content.startswith(b"%PDF")
    assert matplotlib.image.imread(BytesIO(answers["png"].content)).shape[1] == pytest.approx(1050, abs=1)
    assert answers["pdf"].headers["content-disposition"] == f'inline; filename="gaplab-{kind}.pdf"'
    assert found["caption"].split(".")[0] in answers["html"].text


@pytest.mark.release
def test_while_many_files_are_drawn_others_are_served(
    url: str, experiment: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sixty readers want a PDF, and the first takes long to draw: most are refused, and no thread is missing."""
    monkeypatch.setattr(figures, "_DRAWING", WaitingLine("figures", longest_s=DEADLINE_S))
    asked = {"study": experiment, "format": "pdf"}
    with httpx2.Client(base_url=url, timeout=DEADLINE_S) as http, ThreadPoolExecutor(60) as readers:
        with files._matplotlib:
            answers = [readers.submit(http.get, "/figures/curves", params=asked) for _ in range(60)]
            refused = [each.result() for each in islice(as_completed(answers), 60 - 1 - LENGTH)]
            others = [http.get(path).status_code for path in ("/livez", "/readyz", "/studies")]
        drawn = [each.result() for each in answers if each.result() not in refused]

    assert {each.status_code for each in refused} == {429}
    assert all(int(each.headers["retry-after"]) > 0 for each in refused)
    assert others == [200] * 3
    assert {each.status_code for each in drawn} == {200}
    assert len({each.content for each in drawn}) == 1


def test_curves_are_drawn_against_rollouts_and_time_and_with_each_repetition(api: TestClient, experiment: str) -> None:
    asked = {"study": experiment, "format": "json"}

    plain, rollouts, time, each = (
        api.get("/figures/curves", params=asked | how).json()  # type: ignore[arg-type, operator]
        for how in ({}, {"x": "rollouts"}, {"x": "time", "cost_s": 30}, {"each": True})
    )

    labels = [found["figure"]["layout"]["xaxis"]["title"]["text"] for found in (plain, rollouts, time)]
    assert labels == ["Number of real-world evaluations", "Rollouts in simulation", "Time (s)"]
    assert "at 30\N{NO-BREAK SPACE}s each" in time["caption"]
    assert "Faint lines" in each["caption"]
    assert len(each["figure"]["data"]) == len(plain["figure"]["data"]) + 1


def test_an_experiment_that_is_asked_for_twice_is_drawn_once(api: TestClient, experiment: str) -> None:
    drawn = api.get("/figures/curves", params={"study": [experiment, experiment], "format": "json"}).json()

    assert len(drawn["table"]["rows"]) == 1


def test_a_study_gives_the_title_unless_it_is_given_and_a_file_its_width(api: TestClient, experiment: str) -> None:
    study = api.get(f"/experiments/{experiment}").json()["study"]

    own = api.get("/figures/curves", params={"study": study, "format": "json"}).json()
    given = api.get("/figures/curves", params={"study": study, "format": "json", "title": ""}).json()
    wide = api.get("/figures/curves", params={"study": study, "format": "png", "width": 7.2, "caption": False})

    assert own["title"] == STUDY["name"]
    assert given["title"] == ""
    assert matplotlib.image.imread(BytesIO(wide.content)).shape[1] == 2160


def test_reality_is_in_the_figure_of_simulators_once_all_of_the_study_have_ended(
    api: TestClient, experiment: str
) -> None:
    study = api.get(f"/experiments/{experiment}").json()["study"]
    asked = {"experiment": experiment, "format": "json"}

    running = api.get("/figures/simulators", params=asked)
    api.post(f"/studies/{study}/cancel")
    ended = api.get("/figures/simulators", params=asked)

    (point,) = [each for each in ended.json()["figure"]["data"] if each["name"] == "Reality"]
    assert point["x"] == [pytest.approx(HIDDEN, abs=1e-5)]
    assert "Reality" not in [each["name"] for each in running.json()["figure"]["data"]]
    assert str(HIDDEN)[:6] not in running.text
    assert "once its experiments have ended" in running.json()["caption"]


@pytest.mark.release
def test_predictions_are_drawn_as_they_are_computed(sqlite_store: Store, api: TestClient) -> None:
    spec = STUDY | {"strategy": "simulated_fit", "repetitions": 1}
    spec = {name: value for name, value in spec.items() if name != "strategies"}
    made = api.post("/experiments", json=spec).json()["id"]
    (claim,) = execution.claim(sqlite_store, "test", limit=1)
    run(sqlite_store, claim, repetition(setting(claim.spec, claim.number)))

    found = api.get("/figures/predictions", params={"experiment": made, "format": "json"}).json()

    traces = {each["name"]: each for each in found["figure"]["data"]}
    assert len(traces["After tuning on it"]["x"]) == len(traces["Before tuning on it"]["y"]) == 2
    assert "2\N{NO-BREAK SPACE}samples of 1\N{NO-BREAK SPACE}repetition" in found["caption"]
    assert found["title"] == "Two <b>ways</b>"


def test_an_experiment_that_has_not_begun_is_an_empty_figure(api: TestClient) -> None:
    made = api.post("/experiments", json={"strategy": "random", "robot": "toy_function", "budget": "smoke"}).json()[
        "id"
    ]

    for kind in (*KINDS, "predictions"):
        found = api.get(f"/figures/{kind}", params=about(kind, made)).json()
        assert found["empty"] is True
        assert "no results yet" in found["alt"]


def test_the_direct_baseline_says_that_it_tunes_nothing(api: TestClient, experiment: str) -> None:
    study = api.get(f"/experiments/{experiment}").json()["study"]
    direct = api.get(f"/studies/{study}").json()["experiments"][-1]["id"]

    for kind in ("simulators", "squared-error", "predictions"):
        found = api.get(f"/figures/{kind}", params={"experiment": direct, "format": "json"}).json()
        assert (found["empty"], found["title"]) == (True, "Direct")
        assert found["alt"] == "Nothing: the direct baseline tunes no simulators."


def test_files_are_drawn_alike_by_many_threads_at_once(api: TestClient, experiment: str) -> None:
    def draw(kind: str) -> bytes:
        return api.get(f"/figures/{kind}", params=about(kind, experiment, "svg")).content

    with ThreadPoolExecutor(4) as threads:
        together = list(threads.map(draw, KINDS[:2] * 2))

    assert together == [draw(kind) for kind in KINDS[:2]] * 2


def test_a_figure_that_is_none_is_not_found_and_the_answer_says_which_there_are(api: TestClient) -> None:
    found = api.get("/figures/curvs?experiment=x")

    assert found.status_code == 404
    assert found.headers["content-type"] == "application/problem+json"
    assert "'curvs'" in found.json()["detail"]
    assert all(each in found.json()["detail"] for each in (*KINDS, "predictions", "gait", "toy"))
    assert api.post("/figures/curves").status_code == 405


def test_an_unknown_experiment_is_not_found(api: TestClient) -> None:
    found = {
        kind: api.get(f"/figures/{kind}", params=about(kind, "nope")).status_code for kind in (*KINDS, "predictions")
    }

    assert set(found.values()) == {404}, found


def test_what_cannot_be_drawn_is_refused_with_what_is_permitted(api: TestClient) -> None:
    wrong = [
        ("/figures/curves?study=a&format=bmp", "format", "png"),
        ("/figures/curves?study=a&x=tim", "x", "rollouts"),
        ("/figures/curves?study=a&band=se", "band", "interval"),
        ("/figures/curves?study=a&cost_s=-1", "cost_s", "0"),
        ("/figures/simulators?experiment=a&width=0", "width", "2.5"),
        ("/figures/simulators?experiment=a&columns=0", "columns", "1"),
        ("/figures/squared-error", "experiment", ""),
        ("/figures/squared-error?experiment=a&colour=red", "colour", ""),
    ]

    for path, name, permitted in wrong:
        answer = api.get(path)
        assert answer.status_code == 422
        (error,) = answer.json()["errors"]
        assert (error["pointer"], permitted in str(error)) == (name, True)
