"""Whatever is sent, the API answers with a result or with a problem that is valid JSON, and never fails itself.

`test_mutated_specs`, `test_api_schema` and `test_api_bad_input` have samples of the same in each run.
"""

import copy
import json
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from gaplab.api.app import create_app
from gaplab.migrations import upgrade
from gaplab.schemas.mistakes import Problem
from gaplab.services.store.session import Store
from tests.mutated_specs import EXPERIMENT, places

pytestmark = pytest.mark.release

ANYTHING = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.integers(min_value=-(2**70), max_value=2**70)
    | st.floats()
    | st.text()
    | st.sampled_from(["pybullet", "quadruped", "direct", "random", "known_fit", "paper", "\x00", "\ud800", "é" * 300]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@st.composite
def mutated_specs(draw: st.DrawFn) -> dict[str, Any]:
    """A valid spec in which up to three things are replaced, removed or added."""
    spec = copy.deepcopy(EXPERIMENT)
    for _ in range(draw(st.integers(1, 3))):
        if not (found := list(places(spec))):
            break
        target, last = draw(st.sampled_from(found))
        match draw(st.sampled_from(["replace", "remove", "add"])):
            case "replace":
                target[last] = draw(ANYTHING)
            case "remove":
                del target[last]
            case "add" if isinstance(target, dict):
                target[draw(st.text(max_size=8))] = draw(ANYTHING)
    return spec


@pytest.fixture(scope="module", params=["sqlite", "postgres"])
def api(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """Over either database: Postgres refuses texts that SQLite takes."""
    with ExitStack() as opened:
        if request.param == "sqlite":
            url = f"sqlite:///{tmp_path_factory.mktemp('fuzz') / 'gaplab.db'}"
        else:
            url = opened.enter_context(request.getfixturevalue("postgres").database())
        upgrade(url)
        store = Store(url)
        with TestClient(create_app(store), raise_server_exceptions=False) as client:
            yield client
        store.dispose()


FUZZ = settings(max_examples=150, suppress_health_check=list(HealthCheck))


@FUZZ
@given(spec=mutated_specs())
def test_no_mutation_of_a_spec_makes_the_service_fail(api: TestClient, spec: dict[str, Any]) -> None:
    is_accepted_or_refused(api, "/experiments", json.dumps(spec))


@FUZZ
@given(spec=ANYTHING)
def test_no_json_at_all_makes_the_service_fail(api: TestClient, spec: object) -> None:
    is_accepted_or_refused(api, "/studies", json.dumps(spec))


@FUZZ
@example(spec={"optimizer": {"name": "steady_state", "options": {"population": ["\ud800"]}}})
@given(spec=mutated_specs())
def test_no_mutation_of_what_is_checked_makes_the_service_fail(api: TestClient, spec: dict[str, Any]) -> None:
    spec.pop("strategy", None)
    spec.pop("name", None)
    is_accepted_or_refused(api, "/sensitivity", json.dumps(spec))


@FUZZ
@given(body=st.binary(max_size=50))
def test_no_bytes_make_the_service_fail(api: TestClient, body: bytes) -> None:
    is_accepted_or_refused(api, "/experiments", body)


@FUZZ
@given(
    path=st.sampled_from(
        [
            "/studies",
            "/curves",
            "/comparisons",
            "/figures/curves",
            "/figures/simulators",
            "/figures/no-such",
            "/experiments/x/samples",
        ]
    ),
    query=st.dictionaries(
        st.sampled_from(["limit", "cursor", "study", "state", "experiment", "format", "from", "to", "repetition"]),
        st.text(st.characters(codec="utf-8"), max_size=20)
        | st.integers().map(str)
        | st.sampled_from(["csv", "svg", "RUNNING"]),
        max_size=3,
    ),
)
def test_no_query_makes_the_service_fail(api: TestClient, path: str, query: dict[str, str]) -> None:
    answer = api.get(path, params=query)

    assert answer.status_code in {200, 404, 422}, answer.text


def is_accepted_or_refused(api: TestClient, path: str, body: str | bytes) -> None:
    answer = api.post(path, content=body, headers={"content-type": "application/json"})

    assert answer.status_code in {202, 422}, answer.text
    plain = json.loads(answer.content, parse_constant=pytest.fail)
    if answer.status_code == 422:
        Problem.model_validate(plain)
