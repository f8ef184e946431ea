"""Requests that come twice are done once; what people change, nobody undoes unseen; lists stay in order."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from threading import Barrier

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import func, select, update

from gaplab.api.app import create_app
from gaplab.schemas.access import Role
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.access import create_token
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.experiments import idempotency, submission
from gaplab.services.experiments.limits import Admission
from gaplab.services.store.models import ExperimentRow, IdempotencyRow, RepetitionRow
from gaplab.services.store.session import Store

TOY = {"strategy": "simulated_fit", "robot": "toy_function", "budget": "smoke", "iterations": 1, "repetitions": 2}
STUDY = {"strategies": ["random", "direct"], "robot": "toy_function", "budget": "smoke"}


@pytest.fixture
def api(store: Store) -> Iterator[TestClient]:
    with TestClient(create_app(store)) as client:
        yield client


def count(store: Store, table: type) -> int:
    with store.reading() as session:
        return session.scalar(select(func.count()).select_from(table)) or 0


@pytest.mark.parametrize(
    ("path", "body"),
    [("/experiments", TOY), ("/studies", STUDY), ("/sensitivity", {"robot": "toy_function", "points": 9})],
)
def test_the_same_request_with_the_same_key_is_done_once_and_answered_twice(
    api: TestClient, path: str, body: dict[str, object]
) -> None:
    first = api.post(path, json=body, headers={"Idempotency-Key": "k"})
    again = api.post(path, json=dict(reversed(body.items())), headers={"Idempotency-Key": "k"})
    new = api.post(path, json=body, headers={"Idempotency-Key": "other"})

    assert (first.status_code, again.status_code, new.status_code) == (202, 202, 202)
    assert again.json() == first.json()
    assert again.headers["location"] == first.headers["location"]
    assert again.headers["idempotent-replayed"] == "true"
    assert "idempotent-replayed" not in first.headers
    assert (new.json()["id"] == first.json()["id"]) == (path == "/sensitivity")


def test_a_key_with_another_body_or_at_another_endpoint_is_refused(api: TestClient) -> None:
    api.post("/experiments", json=TOY, headers={"Idempotency-Key": "k"})

    other = [
        api.post("/experiments", json=TOY | {"seed": 1}, headers={"Idempotency-Key": "k"}),
        api.post("/studies", json=STUDY, headers={"Idempotency-Key": "k"}),
    ]

    assert [each.status_code for each in other] == [422, 422]
    assert {each.json()["type"] for each in other} == {"urn:gaplab:problem:key-reused"}


def test_keys_of_one_token_are_not_those_of_another(store: Store, api: TestClient) -> None:
    made = set()
    for _ in range(2):
        headers = {"Authorization": f"Bearer {create_token(store, Role.RUNNER).secret}", "Idempotency-Key": "k"}
        made.add(api.post("/experiments", json=TOY, headers=headers).json()["id"])

    assert len(made) == 2


def test_a_key_that_is_none_is_refused_by_the_headers_name(api: TestClient) -> None:
    for key in ("", "x" * 256, "with space", "t\tab"):
        answer = api.post("/experiments", json=TOY, headers={"Idempotency-Key": key})

        assert answer.status_code == 422, key
        assert answer.json()["errors"][0]["pointer"].lower() == "idempotency-key"


def test_what_was_refused_leaves_its_key_free(api: TestClient) -> None:
    refused = api.post("/experiments", json=TOY | {"strategy": "nope"}, headers={"Idempotency-Key": "k"})
    accepted = api.post("/experiments", json=TOY, headers={"Idempotency-Key": "k"})

    assert (refused.status_code, accepted.status_code) == (422, 202)


@pytest.mark.dialects
def test_duplicates_at_the_same_moment_create_one(store: Store) -> None:
    spec, threads = ExperimentSpec.model_validate(TOY), 6
    barrier = Barrier(threads)

    def submit(_: int) -> tuple[str, bool]:
        barrier.wait()
        done = submission.submit_once(store, spec, Admission(key="k"))
        return done.answer.id, done.replayed

    with ThreadPoolExecutor(threads) as pool:
        found = list(pool.map(submit, range(threads)))

    assert len({each for each, _ in found}) == 1
    assert sum(not replayed for _, replayed in found) == 1
    assert (count(store, ExperimentRow), count(store, RepetitionRow)) == (1, 2)


@pytest.mark.dialects
def test_key_and_work_are_committed_together_or_not_at_all(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise InvalidSpec([])

    spec = ExperimentSpec.model_validate(TOY)
    with monkeypatch.context() as patch:
        patch.setattr("gaplab.services.experiments.idempotency.update", fail)
        with pytest.raises(InvalidSpec):
            submission.submit_once(store, spec, Admission(key="k"))

    assert (count(store, ExperimentRow), count(store, IdempotencyRow)) == (0, 0)
    assert not submission.submit_once(store, spec, Admission(key="k")).replayed


@pytest.mark.dialects
def test_a_key_is_forgotten_after_a_week(store: Store, api: TestClient) -> None:
    first = api.post("/experiments", json=TOY, headers={"Idempotency-Key": "k"}).json()["id"]
    with store.transaction() as session:
        moment = session.scalar(select(IdempotencyRow.created_at))
        assert moment
        session.execute(update(IdempotencyRow).values(created_at=moment - idempotency.KEYS_LIVE - timedelta(minutes=1)))

    again = api.post("/experiments", json=TOY, headers={"Idempotency-Key": "k"})

    assert again.json()["id"] != first
    assert count(store, IdempotencyRow) == 1


@pytest.mark.parametrize(("path", "body"), [("/experiments", TOY), ("/studies", STUDY)])
def test_a_repeated_submission_of_what_was_deleted_is_told_so(
    api: TestClient, path: str, body: dict[str, object]
) -> None:
    key = {"Idempotency-Key": "k"}
    made = api.post(path, json=body, headers=key)
    address = f"/studies/{made.json()['id']}"
    api.post(f"{address}/cancel")
    archive = api.get(f"{address}/export").content
    assert api.delete(address).status_code == 200

    again, read = api.post(path, json=body, headers=key), api.get(address)
    api.post("/import", content=archive)
    back = api.post(path, json=body, headers=key)

    assert (again.status_code, again.json()) == (404, read.json())
    assert "was deleted at" in again.json()["detail"]
    assert (back.status_code, back.json()["id"]) == (202, made.json()["id"])
