"""What the API answers when it is asked wrongly: always a problem, always readable, never a failure of its own."""

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.services.settings import Limits
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.session import Store

MOST_BYTES = Limits().body_bytes
LEAST = {"strategy": "simulated_fit", "robot": "toy_function", "budget": "smoke"}
JSON = {"content-type": "application/json"}
SLIPPERY = """
from pathlib import Path

from gaplab.services.world.robots.toy_function import ToyFunction


class Slippery(ToyFunction):
    name = "slippery"

    @classmethod
    def details(cls):
        if Path({broken!r}).exists():
            raise RuntimeError("the password is swordfish")
        return super().details()
"""


@pytest.fixture
def api(sqlite_store: Store) -> Iterator[TestClient]:
    with TestClient(create_app(sqlite_store), raise_server_exceptions=False) as client:
        yield client


def test_no_operation_takes_a_parameter_that_it_does_not_know(api: TestClient) -> None:
    for path, operations in api.get("/openapi.json").json()["paths"].items():
        for method in operations:
            answer = api.request(method, path.replace("{", "").replace("}", ""), params={"dry_runn": "true"})

            assert answer.status_code == 422, (method, path)
            messages = [each["message"] for each in answer.json()["errors"] if each["pointer"] == "dry_runn"]
            assert messages[0].startswith("unknown parameter 'dry_runn'")


def problem(answer: Any, status: int) -> dict[str, Any]:
    """The problem that the answer carries, checked for what every problem must be."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    found = json.loads(answer.text, parse_constant=pytest.fail)
    assert found["status"] == status
    assert re.fullmatch(r"urn:gaplab:problem:[a-z-]+", found["type"])
    assert found["title"]
    assert found["detail"]
    return found


def only_error(answer: Any) -> dict[str, Any]:
    errors = problem(answer, 422)["errors"]
    assert len(errors) == 1, errors
    return errors[0]


MISSPELT: list[tuple[dict[str, Any], str, object, str]] = [
    ({"strategy": "simulated_fti"}, "/strategy", "simulated_fti", "simulated_fit"),
    ({"strategy": {"name": "simulated_fti"}}, "/strategy", "simulated_fti", "simulated_fit"),
    ({"robot": "quadruppet"}, "/robot", "quadruppet", "quadruped"),
    ({"engine": "analytics"}, "/engine", "analytics", "analytic"),
    ({"tunables": ["static_friktion"]}, "/tunables/0", "static_friktion", "static_friction"),
    ({"optimizer": "steady_stat"}, "/optimizer", "steady_stat", "steady_state"),
    ({"budget": "smok"}, "/budget", "smok", "smoke"),
    ({"iteratons": 3}, "/iteratons", 3, "iterations"),
    ({"budget": {"presett": "smoke"}}, "/budget/presett", "smoke", "preset"),
    ({"robot": {"name": "toy_function", "optoins": {}}}, "/robot/optoins", {}, "options"),
    ({"tunables": [{"name": "static_friction", "uper": 1.0}]}, "/tunables/0/uper", 1.0, "upper"),
    (
        {"optimizer": {"name": "steady_state", "options": {"populaton": 5}}},
        "/optimizer/options/populaton",
        "populaton",
        "population",
    ),
    (
        {"reality": {"parameters": {"static_frction": 0.9}}},
        "/reality/parameters/static_frction",
        "static_frction",
        "static_friction",
    ),
]


def test_a_misspelt_name_is_refused_with_its_place_and_the_nearest_name(api: TestClient) -> None:
    wrong: list[Any] = []
    for change, pointer, value, nearest in MISSPELT:
        error = only_error(api.post("/experiments", json=LEAST | change))
        told = (error["pointer"], error["value"], error["nearest"], nearest in error["permitted"])
        wrong += [told] if told != (pointer, value, nearest, True) else []

    assert wrong == []


OUT_OF_RANGE: list[tuple[dict[str, Any], str]] = [
    ({"iterations": 0}, "/iterations"),
    ({"repetitions": -1}, "/repetitions"),
    ({"iterations": "10"}, "/iterations"),
    ({"iterations": 2.5}, "/iterations"),
    ({"iterations": True}, "/iterations"),
    ({"iterations": 10**400}, "/iterations"),
    ({"seed": 2**64}, "/seed"),
    ({"seed": -1}, "/seed"),
    ({"strategy": 7}, "/strategy"),
    ({"strategy": ""}, "/strategy"),
    ({"tunables": []}, "/tunables"),
    ({"tunables": "static_friction"}, "/tunables"),
    ({"tunables": ["static_friction", "static_friction"]}, "/tunables"),
    ({"tunables": [{"name": "static_friction", "lower": 0.9, "upper": 0.1}]}, "/tunables/0"),
    ({"tunables": [{"name": "static_friction", "upper": 1e9}]}, "/tunables/0/upper"),
    ({"tunables": [{"name": "static_friction", "lower": math.nan}]}, "/tunables/0/lower"),
    ({"reality": {"parameters": {"static_friction": math.inf}}}, "/reality/parameters/static_friction"),
    ({"budget": {"preset": "smoke", "controller_evaluations": 3}}, "/budget/controller_evaluations"),
    ({"name": ""}, "/name"),
    ({"name": "x" * 201}, "/name"),
]


def test_a_value_out_of_its_range_is_refused_with_its_place(api: TestClient) -> None:
    wrong: list[Any] = []
    for change, pointer in OUT_OF_RANGE:
        answer = api.post("/experiments", content=json.dumps(LEAST | change), headers=JSON)
        error = problem(answer, 422)["errors"][0]
        wrong += [] if error["pointer"].startswith(pointer) and error["message"] else [(change, error)]

    assert wrong == []


def test_a_name_with_a_slash_or_a_tilde_is_one_part_of_a_pointer(api: TestClient) -> None:
    changes: dict[str, Any] = {
        "/reality/parameters/static~1frction~0": {"reality": {"parameters": {"static/frction~": 0.9}}},
        "/optimizer/options/a~1b": {"optimizer": {"name": "cma_es", "options": {"a/b": 1}}},
    }

    found = [only_error(api.post("/experiments", json=LEAST | change))["pointer"] for change in changes.values()]

    assert found == list(changes)


BAD_CHECKS: list[tuple[dict[str, Any], str]] = [
    ({"points": 4}, "/points"),
    ({"points": "17"}, "/points"),
    ({"evaluations": 10**9}, "/evaluations"),
    ({"strategy": "random"}, "/strategy"),
    ({"robot": "quadruppet"}, "/robot"),
    ({"engine": "pybullet"}, "/engine"),
    ({"tunables": ["static_friktion"]}, "/tunables/0"),
    ({"tunables": [{"name": "static_friction", "lower": 0.9, "upper": 0.1}]}, "/tunables/0"),
    ({"reality": {"parameters": {"grip": 1.0}}}, "/reality/parameters/grip"),
]


def test_a_sensitivity_check_is_refused_where_an_experiment_would_be(api: TestClient) -> None:
    answers = [api.post("/sensitivity", json={"robot": "toy_function"} | change) for change, _ in BAD_CHECKS]

    assert [only_error(each)["pointer"] for each in answers] == [pointer for _, pointer in BAD_CHECKS]


def test_an_unknown_check_and_the_misfit_of_an_unknown_experiment_are_not_found(api: TestClient) -> None:
    for address in ("/sensitivity/nope", "/sensitivity/%00", "/experiments/nope/misfit"):
        problem(api.get(address), 404)


def test_numbers_that_json_does_not_have_come_back_as_text(api: TestClient) -> None:
    answer = api.post(
        "/experiments", content='{"strategy": "random", "seed": NaN, "iterations": -Infinity}', headers=JSON
    )

    values = {each["pointer"]: each["value"] for each in problem(answer, 422)["errors"]}
    assert values == {"/seed": "nan", "/iterations": "-inf"}


def test_a_tunable_that_the_engine_ignores_and_a_robot_that_it_cannot_run_are_refused_with_the_engines_that_can(
    api: TestClient,
) -> None:
    error = only_error(api.post("/experiments", json=LEAST | {"robot": "quadruped", "engine": "analytic"}))

    assert error["pointer"] == "/engine"
    assert "pybullet" in error["permitted"]


def test_every_mistake_is_told_at_once(api: TestClient) -> None:
    wrong = {"strategies": ["random", "randm", {"name": "informative", "options": {"x": 1}}], "robot": "toy_functoin"}
    answer = api.post("/studies", json=wrong)

    pointers = [each["pointer"] for each in problem(answer, 422)["errors"]]
    assert set(pointers) == {"/strategies/1", "/strategies/2/options/x", "/robot"}
    assert len(pointers) == 3


def test_a_list_of_strategies_is_no_field_of_an_experiment_and_it_says_which_is(api: TestClient) -> None:
    errors = problem(api.post("/experiments", json={"strategies": ["random"]}), 422)["errors"]

    assert {(each["pointer"], each["nearest"]) for each in errors} == {("/strategies", "strategy"), ("/strategy", None)}


def test_a_body_that_is_no_json_or_no_object_or_breaks_parsers_is_refused(api: TestClient) -> None:
    texts: tuple[str | bytes, ...] = ("", "{", "[1, 2", '{"strategy": "random"} x', "nonsense", "\x00", '{"a": }')
    breaking: tuple[str | bytes, ...] = (b"\xff\xfe\x00", b'{"seed": ' + b"9" * 5000 + b"}", b"[" * 100_000)
    others: tuple[str | bytes, ...] = ("[]", "1", '"random"', "null", "true")

    kinds = [
        [problem(api.post("/experiments", content=body, headers=JSON), 422)["type"].rpartition(":")[2] for body in part]
        for part in (texts, breaking, others)
    ]

    assert set(kinds[0]) <= {"not-json", "invalid-spec"}
    assert kinds[1] == ["not-json"] * 3


def test_a_body_that_nests_too_deep_is_refused_with_the_place_and_the_limit(api: TestClient) -> None:
    def nested(levels: int) -> str:
        return json.dumps(LEAST).replace('"simulated_fit"', '{"name": "random", "options": {"x": %s1%s}}') % (
            "[" * levels,
            "]" * levels,
        )

    deep, deeper = (api.post("/experiments", content=nested(levels), headers=JSON) for levels in (29, 900))
    robot = api.post("/robots", content=f'{{"world": {"[" * 900}{"]" * 900}}}', headers=JSON)

    assert only_error(deep)["pointer"] == "/strategy/options/x"
    assert only_error(deeper)["pointer"] == "/strategy/options/x" + "/0" * 29
    assert only_error(deeper)["permitted"] == only_error(robot)["permitted"] == "at most 32 levels"


def test_a_body_without_its_content_type_is_refused_with_the_header_that_it_needs(api: TestClient) -> None:
    answer = api.post("/experiments", content=json.dumps(LEAST), headers={"content-type": "text/plain"})

    assert "Content-Type: application/json" in problem(answer, 415)["errors"][0]["message"]


def test_text_that_is_no_unicode_is_answered_with_text_that_is(api: TestClient) -> None:
    answer = api.post("/experiments", content=b'{"strategy": "\\ud800", "\\udfff": "\\ud800"}', headers=JSON)

    problem(answer, 422)


def test_a_hostile_number_of_mistakes_gets_an_answer_of_modest_size(api: TestClient) -> None:
    answer = api.post("/experiments", json=LEAST | {"tunables": [7] * 100_000, "x" * 100_000: ["y" * 100_000] * 3})

    found = problem(answer, 422)
    assert len(found["errors"]) == 50
    assert "more" in found["detail"]
    assert len(answer.content) < 100_000


def test_a_body_over_a_megabyte_is_too_large_whether_announced_streamed_or_lied_about(api: TestClient) -> None:
    huge = b'{"name": "' + b"x" * MOST_BYTES + b'"}'

    def stream() -> Iterator[bytes]:
        for start in range(0, len(huge), 1000):
            yield huge[start : start + 1000]

    problem(api.post("/experiments", content=huge, headers=JSON), 413)
    problem(api.post("/experiments", content=stream(), headers=JSON), 413)
    problem(api.post("/experiments", content=stream(), headers=JSON | {"content-length": "10"}), 413)


def test_a_body_of_just_a_megabyte_is_read(api: TestClient) -> None:
    spec = json.dumps(LEAST)

    assert api.post("/experiments", content=spec.ljust(MOST_BYTES), headers=JSON).status_code == 202


def test_an_unknown_id_is_not_found_wherever_it_is_asked_for(api: TestClient) -> None:
    paths = ("/studies/{}", "/experiments/{}", "/experiments/{}/curve", "/studies/{}/spec")
    addresses = [path.format(name) for path in paths for name in ("nope", "x" * 2000, "%00", "a'b", "ü", "-1", "%ff")]
    addresses += ["/curves?study=nope", "/figures/curves?study=nope", "/comparisons?study=a&study=b"]

    for address in addresses:
        problem(api.get(address), 404)


def test_what_has_ended_cannot_be_cancelled(api: TestClient) -> None:
    made = api.post("/experiments", json=LEAST).json()["id"]
    api.post(f"/studies/{made}/cancel")

    assert "CANCELLED" in problem(api.post(f"/studies/{made}/cancel"), 409)["detail"]
    problem(api.post("/studies/nope/cancel"), 404)


def test_an_unknown_address_and_a_wrong_method_are_problems_too(api: TestClient) -> None:
    problem(api.get("/nothing/here{}"), 404)
    refused = api.delete("/experiments")
    problem(refused, 405)
    assert refused.headers["allow"]


BAD_QUERIES = [
    ("/studies?limit=0", "limit"),
    ("/studies?limit=501", "limit"),
    ("/studies?limit=x", "limit"),
    ("/studies?limit=" + "9" * 5000, "limit"),
    ("/studies?cursor=nonsense", "cursor"),
    ("/studies?cursor=%00", "cursor"),
    ("/studies?state=RUNING", "state"),
    ("/studies?limmit=3", "limmit"),
    ("/studies?strategy=%00", "strategy"),
    ("/curves", "study"),
    ("/curves?study=a&format=xml", "format"),
    ("/comparisons", "study"),
    ("/comparisons?study=a&study=b&from=-1", "from"),
    ("/figures/curves?study=a&format=bmp", "format"),
    ("/figures/curves", "study"),
    ("/studies?state=RUNNING&state=QUEUED", "state"),
    ("/studies?limit=3&limit=3", "limit"),
    ("/figures/gait?experiment=a&experiment=b", "experiment"),
    ("/comparisons?study=a&study=b&from=1&from=2", "from"),
    ("/experiments/a/samples?kind=sample&kind=probe", "kind"),
    ("/events/page?after=1&after=2", "after"),
]


def test_a_wrong_query_is_refused_with_the_parameters_name(api: TestClient) -> None:
    problems = [problem(api.get(path), 422) for path, _ in BAD_QUERIES]

    assert {each["type"] for each in problems} == {"urn:gaplab:problem:invalid-request"}
    assert [each["errors"][0]["pointer"] for each in problems] == [name for _, name in BAD_QUERIES]


def test_a_comparison_over_no_range_or_with_itself_is_refused(api: TestClient) -> None:
    first, second = (api.post("/experiments", json=LEAST).json()["id"] for _ in range(2))

    over_none = api.get(f"/comparisons?study={first}&study={second}&from=5&to=2")
    with_itself = api.get(f"/comparisons?study={first}&study={first}")

    assert (only_error(over_none)["pointer"], only_error(with_itself)["pointer"]) == ("from", "study")


def test_a_misspelt_choice_in_a_query_is_answered_with_the_nearest(api: TestClient) -> None:
    error = only_error(api.get("/studies?state=RUNING"))

    assert error["nearest"] == "RUNNING"
    assert "COMPLETED" in error["permitted"]


class Away(Store):
    """A store whose database cannot be reached."""

    def check(self) -> None:
        raise StoreUnavailable("the database cannot be used now: connection refused")


def test_requests_without_a_database_are_problems_and_succeed_when_it_is_back(
    sqlite_url: str, sqlite_store: Store
) -> None:
    app, away = create_app(sqlite_store), Away(sqlite_url)
    api = TestClient(app)
    for path in ("/studies", "/experiments/x/curve", "/readyz"):
        app.state.store = away
        refused, alive = api.get(path), api.get("/livez")
        app.state.store = sqlite_store

        assert problem(refused, 503)["type"] == "urn:gaplab:problem:store-unavailable"
        assert int(refused.headers["retry-after"]) > 0
        assert alive.status_code == 200
        assert api.get(path).status_code in {200, 404}
    away.dispose()


def test_a_database_that_was_never_migrated_is_not_ready(tmp_path: Any) -> None:
    store = Store(f"sqlite:///{tmp_path / 'empty.db'}")
    api = TestClient(create_app(store))

    assert "migrations" in problem(api.get("/readyz"), 503)["detail"]
    problem(api.post("/experiments", json=LEAST), 503)
    store.dispose()


def test_an_accident_inside_leaks_nothing_but_a_number_to_find_it_by(
    sqlite_store: Store, caplog: pytest.LogCaptureFixture
) -> None:
    app = create_app(sqlite_store)

    @app.get("/accident")
    def fail() -> None:
        raise RuntimeError("the password is swordfish")

    answer = TestClient(app, raise_server_exceptions=False).get("/accident")

    detail = problem(answer, 500)["detail"]
    assert "swordfish" not in answer.text
    incident = detail.split()[-1].rstrip(".")
    assert incident in caplog.text
    assert "swordfish" in caplog.text


def test_an_accident_in_a_plug_in_names_it_and_its_line_and_no_more(
    api: TestClient, put: Any, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    put(slippery=SLIPPERY.format(broken=str(tmp_path / "broken")))
    assert api.get("/catalogue").status_code == 200
    (tmp_path / "broken").touch()

    answer = api.get("/catalogue")
    found = problem(answer, 500)

    assert found["type"] == "urn:gaplab:problem:plugin-failed"
    assert "robot 'slippery' raised RuntimeError (slippery.py, line 13)" in found["detail"]
    assert "swordfish" not in answer.text
    assert found["detail"].split()[-1].rstrip(".") in caplog.text
    assert "swordfish" in caplog.text
