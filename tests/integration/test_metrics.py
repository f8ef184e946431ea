"""/metrics: what is counted, and that it is cheap to ask for."""

from typing import Any

import pytest
from fastapi.testclient import TestClient
from prometheus_client.parser import text_string_to_metric_families
from sqlalchemy import event

from gaplab.api.app import create_app
from gaplab.api.http import metrics
from gaplab.services.experiments import reading
from gaplab.services.running import execution, supervisors
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.session import Store
from tests.experiments import cancel, run, submit_one, toy


def read(api: TestClient) -> dict[tuple[str, ...], float]:
    """The values, by name and the values of the labels."""
    answer = api.get("/metrics")
    assert answer.status_code == 200
    families = text_string_to_metric_families(answer.text)
    return {(each.name, *each.labels.values()): each.value for family in families for each in family.samples}


@pytest.mark.dialects
def test_it_counts_what_the_database_holds(store: Store) -> None:
    submit_one(store, toy())
    cancel(store, submit_one(store, toy()).id)
    first, _ = execution.claim(store, "me", 2)
    run(store, first)
    supervisors.heartbeat(store, "me")
    supervisors.heartbeat(store, "me")
    supervisors.heartbeat(store, "gone")
    supervisors.end(store, "gone")

    found = read(TestClient(create_app(store)))

    states = {"QUEUED": 1, "RUNNING": 1, "COMPLETED": 1, "FAILED": 0, "CANCELLED": 3}
    assert {state: found["gaplab_repetitions", state] for state in states} == states
    assert found["gaplab_experiments", "RUNNING"] == found["gaplab_experiments", "CANCELLED"] == 1
    progress = reading.read_experiment(store, first.experiment_id).progress
    assert found["gaplab_rollouts_done",] == progress.rollouts_done
    assert found["gaplab_steps_done",] == 13
    assert found["gaplab_rollouts_queued",] == progress.rollouts * 2 / 3
    assert found["gaplab_supervisors",] == 1
    assert 0 <= found["gaplab_supervisor_heartbeat_age_seconds",] < 180
    assert found["gaplab_database_up",] == 1
    assert found["gaplab_event_streams",] == 0


def test_requests_are_counted_by_route_and_not_by_what_was_asked(sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store))
    id_ = submit_one(sqlite_store, toy()).id
    for path in (f"/experiments/{id_}", f"/experiments/{id_}", "/experiments/nobody", "/no/such/1", "/no/such/2"):
        api.get(path)
    api.request("BREW", "/experiments")

    found = read(api)

    assert found["gaplab_http_requests_total", "GET", "/experiments/{id}", "200"] == 2
    assert found["gaplab_http_requests_total", "GET", "/experiments/{id}", "404"] == 1
    assert found["gaplab_http_requests_total", "GET", "none", "404"] == 2
    assert any(each[:2] == ("gaplab_http_requests_total", "other") for each in found)
    assert found["gaplab_http_request_seconds_count", "GET", "/experiments/{id}"] == 3
    assert not any(id_ in part or "such" in part for each in found for part in each)


_TOKEN = "FROM token"
"""Who asks is looked up for every request."""


def test_the_database_is_asked_once_however_often_the_metrics_are_read(
    sqlite_store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(metrics, "CACHED_S", 3600.0)
    api = TestClient(create_app(sqlite_store))
    asked: list[str] = []

    @event.listens_for(sqlite_store._engine, "before_cursor_execute")
    def _(*given: Any) -> None:
        if "SELECT" in given[2] and _TOKEN not in given[2]:
            asked.append(given[2])

    read(api)
    first = len(asked)
    for _ in range(5):  # type: ignore[assignment]
        read(api)

    assert 0 < first == len(asked)


def test_without_a_database_it_says_so_and_counts_the_errors() -> None:
    store = Store("postgresql://nobody@127.0.0.1:1/none")
    with pytest.raises(StoreUnavailable):
        store.check()

    found = read(TestClient(create_app(store)))

    assert found["gaplab_database_up",] == 0
    assert found["gaplab_database_errors_total",] >= 1
    assert ("gaplab_steps_done",) not in found
    store.dispose()


def test_what_a_deletion_takes_away_is_no_counter(store: Store) -> None:
    id_ = submit_one(store, toy(repetitions=1)).id
    (claim,) = execution.claim(store, "me", 1)
    run(store, claim)
    api = TestClient(create_app(store))
    before = read(api)

    api.delete(f"/studies/{id_}")

    names = ("gaplab_rollouts_done", "gaplab_steps_done")
    assert all(before[name,] > 0 for name in names)
    after = read(TestClient(create_app(store)))  # the first app keeps its values for seconds
    assert all(after[name,] == 0 for name in names)
    kinds = {each.name: each.type for each in text_string_to_metric_families(api.get("/metrics").text)}
    assert [kinds[name] for name in names] == ["gauge", "gauge"]
    assert not [name for name in kinds if name in {"gaplab_rollouts", "gaplab_steps"}]
