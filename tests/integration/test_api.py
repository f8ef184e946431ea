"""The endpoints: what they answer when asked rightly."""

import csv
import io
import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator

import pytest
from fastapi.testclient import TestClient
from jsonschema import Draft202012Validator

from gaplab.api.app import create_app
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.findings.sensitivity import Effort, check
from gaplab.services.running import execution, sensitivity
from gaplab.services.specs.assembly import subject
from gaplab.services.store.session import Store
from tests.experiments import finish, run, toy

TOY = {"strategy": "simulated_fit", "robot": "toy_function", "budget": "smoke", "iterations": 2, "repetitions": 3}
STUDY = {
    "name": "a study",
    "strategies": ["simulated_fit", "random", "direct"],
    "robot": "toy_function",
    "budget": "smoke",
    "iterations": 2,
    "repetitions": 2,
}


@pytest.fixture
def api(store: Store) -> Iterator[TestClient]:
    with TestClient(create_app(store)) as client:
        yield client


def test_a_submitted_experiment_exists_at_its_location_with_every_default_filled_in(api: TestClient) -> None:
    answer = api.post("/experiments", json={"strategy": "simulated_fit", "iterations": 10, "repetitions": 40})

    assert answer.status_code == 202
    found = api.get(answer.headers["Location"])
    sensors = found.json()["sensors"]  # answers to changes do without
    assert ("roll" in sensors["names"], sensors["needed"]) == (True, False)
    assert found.json() == answer.json() | {"sensors": sensors}
    assert found.json()["state"] == "QUEUED"
    assert found.json()["spec"]["budget"]["controller_evaluations"] == 10_000
    assert found.json()["spec"]["robot"]["name"] == "quadruped"


def test_an_empty_study_is_the_papers_six_strategies_and_the_direct_baseline(api: TestClient) -> None:
    answer = api.post("/studies?confirm_cost=true", json={})

    assert answer.status_code == 202
    study = api.get(answer.headers["Location"]).json()
    assert [each["strategy"] for each in study["experiments"]] == [
        "simulated_fit",
        "simulated_fit_and_unique",
        "informative",
        "simulated_fit_and_informative",
        "random",
        "known_fit",
        "direct",
    ]
    assert study["progress"]["repetitions"] == 7 * 40


def test_studies_are_filtered_by_state_and_strategy(api: TestClient) -> None:
    study = api.post("/studies", json=STUDY).json()
    alone = api.post("/experiments", json=TOY).json()
    api.post(f"/studies/{alone['id']}/cancel")

    def listed(**which: str) -> set[str]:
        return {each["id"] for each in api.get("/studies", params=which).json()["items"]}

    assert listed(state="CANCELLED") == {alone["id"]}
    assert listed(strategy="random") == {study["id"]}
    assert listed() == {study["id"], alone["id"]}


def test_what_has_run_is_shown_by_repetition_sample_and_simulator(store: Store, api: TestClient) -> None:
    made = api.post("/experiments", json=toy(repetitions=2).model_dump(mode="json")).json()
    finish(store)

    path = f"/experiments/{made['id']}"
    done = api.get(path).json()
    assert (done["state"], done["progress"]["completed"], done["progress"]["time_left"]) == ("COMPLETED", 2, None)
    assert [each["state"] for each in api.get(f"{path}/repetitions").json()] == ["COMPLETED", "COMPLETED"]
    samples = api.get(f"{path}/samples", params={"repetition": 1, "kind": "sample"}).json()["items"]
    assert [(each["iteration"], each["fitness"]) for each in samples] == [(1, None), (2, 1 / 3)]
    simulators = api.get(f"{path}/simulators", params={"repetition": 0, "iteration": 2}).json()["items"]
    assert [(each["rank"], each["squared_error"]) for each in simulators] == [(0, 1e-300), (1, None)]


def test_a_curve_has_mean_sd_n_and_interval_at_every_count(store: Store, api: TestClient) -> None:
    made = api.post("/experiments", json=TOY).json()
    finish(store)

    curve = api.get(f"/experiments/{made['id']}/curve").json()

    assert [point["evaluations"] for point in curve["points"]] == [0, 1, 2]
    assert curve["points"][0]["n"] == 3
    assert math.isclose(curve["points"][0]["mean"], 1.1)
    assert math.isclose(curve["points"][0]["sd"], 0.1)
    assert curve["points"][0]["lower"] < 1.1 < curve["points"][0]["upper"]


def test_curves_of_a_study_are_those_of_its_experiments_also_as_comma_separated_values(
    store: Store, api: TestClient
) -> None:
    study = api.post("/studies", json=STUDY).json()
    finish(store)

    ids = [each["id"] for each in study["experiments"]]
    curves = api.get("/curves", params={"study": study["id"]}).json()
    assert [each["experiment"] for each in curves] == ids
    assert [each["direct"] for each in curves] == [False, False, True]
    assert api.get("/curves", params={"study": ids}).json() == curves
    assert api.get("/curves", params={"study": ids[::-1]}).json() == curves[::-1]

    answer = api.get("/curves", params={"study": study["id"], "format": "csv"})
    assert answer.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(io.StringIO(answer.text)))
    assert len(rows) == 2 * 2 * 3 + 2
    assert all(math.isfinite(float(row["fitness"])) for row in rows)


def test_experiments_are_compared_pair_by_pair(store: Store, api: TestClient) -> None:
    study = api.post("/studies", json=STUDY).json()
    finish(store)
    ids = [each["id"] for each in study["experiments"]]

    pairs = api.get("/comparisons", params={"study": ids, "from": 1, "to": 2}).json()

    assert [(each["first"], each["second"]) for each in pairs] == [
        (ids[0], ids[1]),
        (ids[0], ids[2]),
        (ids[1], ids[2]),
    ]
    assert {(each["from_evaluations"], each["to_evaluations"]) for each in pairs} == {(1, 2)}
    assert pairs[0]["n_first"] == 2
    assert pairs[0]["pooled"]["n_first"] == 4


def test_a_figure_is_a_page_without_links_to_elsewhere_or_a_file(store: Store, api: TestClient) -> None:
    study = api.post("/studies", json=STUDY).json()
    finish(store)

    page = api.get("/figures/curves", params={"study": study["id"]})
    drawing = api.get(
        "/figures/curves", params={"study": [each["id"] for each in study["experiments"]], "format": "svg"}
    )

    assert page.headers["content-type"].startswith("text/html")
    assert "<title>a study</title>" in page.text
    assert "<script src" not in page.text
    assert drawing.headers["content-type"] == "image/svg+xml"
    assert ET.fromstring(drawing.text).tag == "{http://www.w3.org/2000/svg}svg"


def test_a_sensitivity_check_exists_at_its_location_and_its_warnings_on_the_experiment(
    store: Store, api: TestClient
) -> None:
    dull = {"robot": "toy_function", "tunables": [{"name": "restitution", "lower": 0.3, "upper": 0.3001}]}
    made = api.post("/sensitivity", json=dull)
    experiment = api.post("/experiments", json=TOY | dull).json()
    claim = sensitivity.claim(store, "test")
    sensitivity.complete(store, claim, check(subject(claim.spec), SteadyState(), Effort(17, 100)))

    found = api.get(made.headers["Location"]).json()

    assert (made.status_code, made.json()["state"], found["state"]) == (202, "QUEUED", "COMPLETED")
    assert experiment["sensitivity"] == found["id"]
    (tunable,) = found["tunables"]
    assert (tunable["verdict"], len(tunable["values"]), len(tunable["fitness"])) == ("nothing", 17, 8)
    assert found["warnings"][0].startswith("restitution over 0.3 to 0.3001 does nothing")
    assert api.get(f"/experiments/{experiment['id']}").json()["warnings"] == found["warnings"]
    assert api.post("/sensitivity", json=dull).json() == found


def test_misfit_has_error_gap_and_spread_of_simulators_by_iteration(store: Store, api: TestClient) -> None:
    made = api.post("/experiments", json=toy().model_dump(mode="json")).json()
    finish(store)

    found = api.get(f"/experiments/{made['id']}/misfit").json()

    assert [point["iteration"] for point in found["points"]] == [0, 1, 2]
    assert found["points"][2]["error"]["n"] == 3
    assert [each["name"] for each in found["points"][0]["tunables"]] == ["static_friction", "dynamic_friction"]
    assert len(found["remarks"]) == 1


def test_cancelling_keeps_what_is_stored(store: Store, api: TestClient) -> None:
    made = api.post("/experiments", json=TOY).json()
    run(store, execution.claim(store, "test", limit=1)[0])

    answer = api.post(f"/studies/{made['id']}/cancel")

    assert answer.json()["state"] == "CANCELLED"
    assert api.get(f"/experiments/{made['id']}/curve").json()["points"][0]["n"] == 1


def test_the_verbs_of_an_experiment_and_of_a_study(api: TestClient) -> None:
    study = api.post("/studies", json={"robot": "toy_function", "budget": "smoke"}).json()
    first = study["experiments"][0]["id"]

    answers = [api.post(f"/studies/{first}/{verb}") for verb in ("pause", "pause", "resume", "stop", "resume")]
    answers += [api.post(f"/studies/{study['id']}/{verb}") for verb in ("pause", "resume", "stop", "cancel")]

    assert [each.status_code for each in answers] == [200, 409, 200, 200, 409, 200, 200, 200, 409]
    states = [each.json().get("state") for each in answers]
    assert states == ["PAUSED", None, "QUEUED", "CANCELLED", None, "PAUSED", "RUNNING", "CANCELLED", None]
    assert answers[1].json()["detail"].endswith("is PAUSED and cannot be paused; permitted: resume, stop, cancel")


def test_an_experiment_is_extended_to_totals_and_given_another_turn(store: Store, api: TestClient) -> None:
    made = api.post("/experiments", json=TOY | {"max_parallel": 1}).json()
    too_early = api.post(f"/studies/{made['id']}/extend", json={"repetitions": 50})
    while claims := execution.claim(store, "test", limit=1):
        run(store, claims[0])

    less = api.post(f"/studies/{made['id']}/extend", json={"iterations": 1})
    more = api.post(f"/studies/{made['id']}/extend", json={"repetitions": 50})
    turn = api.patch(f"/studies/{made['id']}/schedule", json={"priority": 3})
    attempts = api.get(f"/experiments/{made['id']}/repetitions/0/attempts").json()

    assert [each.status_code for each in (too_early, less, more, turn)] == [409, 422, 202, 200]
    assert less.json()["errors"][0]["pointer"] == "/iterations"
    assert (more.json()["state"], more.json()["progress"]["repetitions"]) == ("QUEUED", 50)
    (experiment,) = turn.json()["experiments"]
    assert (experiment["priority"], experiment["max_parallel"]) == (3, 1)
    assert [each["ending"] for each in attempts] == ["completed"]
    assert api.get(f"/experiments/{made['id']}/repetitions/99/attempts").status_code == 404


def test_the_catalogue_lists_every_plug_in_with_the_schema_of_its_options(api: TestClient) -> None:
    found = api.get("/catalogue").json()

    assert {each["name"] for each in found["strategies"]} >= {"simulated_fit", "random", "direct"}
    assert {each["name"] for each in found["robots"]} >= {"quadruped", "toy_function"}
    assert {each["name"] for each in found["engines"]} >= {"pybullet", "analytic"}
    for each in (
        plugin for kind, plugins in found.items() if kind not in {"budgets", "defaults"} for plugin in plugins
    ):
        assert each["summary"]
        Draft202012Validator.check_schema(each["options"])


def test_the_service_says_that_it_lives_and_is_ready(api: TestClient) -> None:
    assert api.get("/livez").json() == {"status": "ok"}
    assert api.get("/readyz").json() == {"status": "ok"}


def test_misfit_is_a_table_too(store: Store, api: TestClient) -> None:
    made = api.post("/experiments", json={"strategy": "random", "robot": "toy_function", "budget": "smoke"}).json()

    answer = api.get(f"/experiments/{made['id']}/misfit?format=csv")

    assert answer.headers["content-type"].startswith("text/csv")
    assert answer.text.startswith(
        "iteration,what,n,mean,sd,least,greatest,at_lower,at_upper,spread,interval,posterior\n"
    )
