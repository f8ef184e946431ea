"""Reality's parameters are in nothing that anyone but an admin sees, and in no log, as long as an experiment runs."""

import json
import logging
import re
from collections.abc import Iterator
from io import BytesIO
from itertools import islice
from typing import Any
from zipfile import ZipFile

import pytest
from fastapi.testclient import TestClient
from httpx2 import Response

from gaplab.api.app import create_app
from gaplab.schemas.access import Role
from gaplab.schemas.editing import ViewSpec
from gaplab.schemas.robots import EXAMPLE
from gaplab.schemas.spec import StudySpec
from gaplab.services.access import create_token
from gaplab.services.archives.opening import DATABASE
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import listing, stored_files, submission
from gaplab.services.running import execution
from gaplab.services.settings import Limits
from gaplab.services.specs.assembly import setting
from gaplab.services.store.lease import Failure
from gaplab.services.store.session import Store
from tests.archiving import dump

HIDDEN = {"static_friction": 0.7319462853, "dynamic_friction": 0.2846190537}
STUDY = {
    "name": "hidden",
    "strategies": ["simulated_fit", "random", "direct"],
    "robot": "toy_function",
    "tunables": list(HIDDEN),
    "iterations": 2,
    "repetitions": 2,
    "budget": {"controller_evaluations": 60, "selection_evaluations": 40, "simulator_evaluations": 40},
    "reality": {"parameters": HIDDEN},
}
FOR_EACH = {"json", "csv", "html", "svg"}


@pytest.fixture
def log(caplog: pytest.LogCaptureFixture) -> pytest.LogCaptureFixture:
    caplog.set_level(logging.DEBUG)
    return caplog


def digits() -> set[str]:
    """The first digits of each hidden number, as any format shows them."""
    return {f"{value:.6f}"[2:] for value in HIDDEN.values()}


def tells(text: str) -> bool:
    return any(each in text for each in digits())


def run_halfway(store: Store) -> None:
    """Compute some of each experiment; one repetition fails inside."""
    claims = execution.claim(store, "test", limit=20)
    for number, claim in enumerate(claims):
        for step in islice(repetition(setting(claim.spec, claim.number)), 7):
            assert execution.record(store, claim, step, seconds=0.1)
        if number == 0:
            assert execution.fail(store, claim, Failure("physics went wrong"))


@pytest.fixture
def running(store: Store, log: pytest.LogCaptureFixture) -> dict[str, str]:
    """Ids of a study that runs, by what they are of."""
    study = submission.submit(store, StudySpec.model_validate(STUDY))
    run_halfway(store)
    listing.save_view(store, "mine", ViewSpec(query="strategy = random"))
    stored_files.ROBOTS.add(store, json.dumps(EXAMPLE))
    first, second, _ = study.experiments
    return {"studies": study.id, "experiments": first.id, "other": second.id, "sensitivity": first.sensitivity or ""}


def addresses(document: dict[str, Any], ids: dict[str, str]) -> Iterator[str]:
    """Every GET of the API that there is, with real ids, in every format."""
    for path, operations in document["paths"].items():
        if "get" not in operations or path == "/events":  # which never ends; `/events/page` has the same
            continue
        noun = path.split("/")[1]
        if noun in {"requests", "attachments"} and "{id}" in path:
            continue  # of a physical reality, which has no parameters
        address = path.replace("{id}", ids.get(noun, ids["experiments"])).replace("{number}", "0")
        address = address.replace("{name}", "quadruped" if noun == "catalogue" else "mine")
        address = address.replace("{robot}", "hopper")
        assert "{" not in address, f"{path} has a parameter that this test does not know"
        names = {each["name"]: str(each["schema"]) for each in operations["get"].get("parameters", ())}
        queries = [""]
        if "experiment" in names:
            second = f"&experiment={ids['other']}" if "array" in names["experiment"] else ""
            queries = [f"experiment={ids['experiments']}{second}"]
        if "study" in names and "{id}" not in path:
            queries.append(f"study={ids['studies']}")
        formats = [f"format={each}" for each in sorted(FOR_EACH)] if "format" in names else []
        for query in queries:
            for variant in ("", *formats):
                yield f"{address}?{'&'.join(filter(None, (query, variant)))}"


def text_of(answer: Response) -> str:
    """All that it says; of an archive, all that its database says; of another zip, all that its members say."""
    if answer.headers["content-type"] != "application/zip":
        return answer.text
    with ZipFile(BytesIO(answer.content)) as opened:
        if opened.namelist() == [DATABASE]:
            return dump(answer.content)
        return "".join(opened.read(name).decode() for name in opened.namelist())


@pytest.mark.release
def test_nothing_that_a_reader_can_see_tells_reality_while_the_experiment_runs(
    store: Store, running: dict[str, str], log: pytest.LogCaptureFixture
) -> None:
    secret = create_token(store, Role.READER).secret
    api = TestClient(create_app(store), headers={"Authorization": f"Bearer {secret}"})
    document = api.get("/openapi.json").json()

    answers = {address: api.get(address) for address in addresses(document, running)}

    told = [address for address, answer in answers.items() if tells(text_of(answer) + str(answer.headers))]
    good = [address for address, answer in answers.items() if answer.status_code == 200]
    assert told == []
    assert len(good) >= 20
    assert {answer.status_code for answer in answers.values()} <= {200, 409, 422}
    assert not tells(log.text)


def test_only_an_admin_may_have_it_revealed_and_no_one_where_there_are_no_tokens(
    store: Store, running: dict[str, str], log: pytest.LogCaptureFixture
) -> None:
    api = TestClient(create_app(store))
    places = [f"/experiments/{running['experiments']}", f"/studies/{running['studies']}"]

    anyone = [api.get(f"{each}?reveal=true") for each in places]
    runner = {"Authorization": f"Bearer {create_token(store, Role.RUNNER).secret}"}
    admin = {"Authorization": f"Bearer {create_token(store, Role.ADMIN).secret}"}

    assert {each.status_code for each in anyone} == {403}
    assert not any(tells(each.text) for each in anyone)
    for place in places:
        assert api.get(f"{place}?reveal=true", headers=runner).status_code == 403
        assert tells(api.get(f"{place}?reveal=true", headers=admin).text)
        assert not tells(api.get(place, headers=admin).text)
    assert log.text.count("reality is revealed to token") == len(places)
    assert not tells(log.text)


def test_neither_submission_nor_its_repetition_nor_an_edit_or_its_end_tells(
    store: Store, log: pytest.LogCaptureFixture
) -> None:
    api = TestClient(create_app(store))
    first = api.post("/studies", json=STUDY, headers={"Idempotency-Key": "k"})
    again = api.post("/studies", json=STUDY, headers={"Idempotency-Key": "k"})
    other = api.post("/studies", json=STUDY | {"seed": 1}, headers={"Idempotency-Key": "k"})
    check = api.post("/sensitivity", json={key: STUDY[key] for key in ("robot", "tunables", "reality")})
    one, *rest = (each["id"] for each in first.json()["experiments"])
    edited = api.patch(f"/studies/{one}", json={"name": "x"}, headers={"If-Match": "*"})
    ended = api.post(f"/studies/{one}/cancel")

    answers = (first, again, other, check, edited, ended)
    assert [each.status_code for each in answers] == [202, 202, 422, 202, 200, 200]
    assert not any(tells(each.text) for each in answers)
    for each in rest:
        last = api.post(f"/studies/{each}/cancel")
    assert tells(last.text)
    assert tells(json.dumps(api.get(f"/experiments/{one}").json()))
    assert not tells(log.text)


def test_an_accident_of_the_database_logs_no_spec(
    sqlite_store: Store, log: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    from gaplab.services.store.queries import experiments as repository

    api = TestClient(create_app(sqlite_store), raise_server_exceptions=False)
    monkeypatch.setattr(repository, "new_id", lambda: "same")
    api.post("/experiments", json={"strategy": "random", "robot": "toy_function", "budget": "smoke"})

    spec = {**STUDY, "strategy": "random"}
    failed = api.post("/experiments", json={key: spec[key] for key in spec if key not in {"strategies", "name"}})

    assert failed.status_code == 500
    assert "UNIQUE" in log.text
    assert not tells(failed.text + log.text)


def test_the_digits_would_be_found_in_whatever_form() -> None:
    assert tells(json.dumps(HIDDEN))
    assert tells(f"{HIDDEN['static_friction']:.7g}")
    assert tells(re.sub(r"\s", "", str([round(each, 8) for each in HIDDEN.values()])))


def test_limits_are_told_without_what_they_refused(sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store, limits=Limits(iterations=1, experiments=1)))

    refused = api.post("/studies", json=STUDY)
    full = api.post("/studies", json=STUDY | {"iterations": 1})

    assert (refused.status_code, full.status_code) == (422, 429)
    assert not tells(refused.text + full.text)
