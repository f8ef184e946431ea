"""Lists: filtered, sorted, page by page. Edits: nobody undoes unseen what somebody else did."""

from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.schemas.lifecycle import State
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.made_studies import Made, Study, make

TOY = {"strategy": "simulated_fit", "robot": "toy_function", "budget": "smoke", "iterations": 1, "repetitions": 1}
NAMES = ["béta", "Alpha", "alpha 50%", "line\nbreak", "delta_1", "alpha"]


@pytest.fixture
def api(store: Store) -> Iterator[TestClient]:
    with TestClient(create_app(store)) as client:
        yield client


def walk(api: TestClient, **query: Any) -> list[dict[str, Any]]:
    """Every item, two at a time."""
    found, cursor = [], None
    while True:
        page = api.get("/studies", params=query | {"limit": 2} | ({"cursor": cursor} if cursor else {}))
        assert page.status_code == 200, page.text
        found += page.json()["items"]
        if (cursor := page.json()["next"]) is None:
            return found


@pytest.mark.dialects
def test_a_sorted_list_has_each_once_and_its_opposite_is_its_reverse(api: TestClient) -> None:
    made = [api.post("/studies", json=TOY | {"name": name}).json()["id"] for name in NAMES]

    found = {
        sort: [each["id"] for each in walk(api, sort=sort)] for sort in ("name", "-name", "created_at", "-created_at")
    }

    assert sorted(found["name"]) == sorted(made)
    assert found["-name"] == found["name"][::-1]
    assert (found["created_at"], found["-created_at"]) == (made, made[::-1])


@pytest.mark.dialects
def test_studies_are_sorted_by_state_and_by_their_best_learned_fitness(store: Store, api: TestClient) -> None:
    fitness = {"low": (0.2, 0.9), "high": (0.7, 0.1), "alone": (0.4,)}
    for name, values in fitness.items():
        curves = {strategy: Made([value] * 2) for strategy, value in zip(("random", "direct"), values, strict=False)}
        make(store, name, Study(curves, repetitions=2, samples=1))
    api.post("/studies", json=TOY | {"name": "queued"})

    found = {
        sort: [each["name"].removeprefix("made: ") for each in walk(api, sort=sort)]
        for sort in ("fitness", "-fitness", "state", "-state")
    }

    assert found["-fitness"] == ["high", "alone", "low", "queued"]
    assert found["fitness"] == ["low", "alone", "high", "queued"]
    assert found["state"][0] == "queued"
    assert found["-state"] == found["state"][::-1]


@pytest.mark.dialects
def test_text_is_looked_for_in_names_and_ids_as_it_stands(api: TestClient) -> None:
    ids = {name: api.post("/experiments", json=TOY | {"name": name}).json()["id"] for name in NAMES}

    def found(text: str) -> set[str]:
        return {each["name"] for each in walk(api, text=text)}

    assert found("ALPHA") == {"Alpha", "alpha 50%", "alpha"}
    assert found("50%") == {"alpha 50%"}
    assert found("%") == {"alpha 50%"}
    assert found("a_1") == {"delta_1"}
    assert found("é") == {"béta"}
    assert found(ids["Alpha"][2:9]) == {"Alpha"}
    assert found("\0'") == set()


@pytest.mark.dialects
def test_studies_are_filtered_by_state_strategy_and_text(store: Store, api: TestClient) -> None:
    def study(name: str, *strategies: str) -> dict[str, Any]:
        spec = {"name": name, "strategies": strategies, "robot": "toy_function", "budget": "smoke"}
        return api.post("/studies", json=spec).json()

    called_off, mixed = study("off", "random"), study("mixed", "random", "known_fit")
    api.post(f"/studies/{called_off['experiments'][0]['id']}/cancel")
    api.post(f"/studies/{mixed['experiments'][0]['id']}/cancel")
    study("waiting", "simulated_fit")
    paused, partly = study("paused", "random", "known_fit"), study("partly paused", "random", "known_fit")
    api.post(f"/studies/{paused['id']}/pause")
    api.post(f"/studies/{paused['experiments'][0]['id']}/cancel")
    api.post(f"/studies/{partly['experiments'][0]['id']}/pause")

    def found(**which: str) -> set[str]:
        return {each["name"] for each in walk(api, **which)}

    assert found(strategy="random") == {"off", "mixed", "paused", "partly paused"}
    assert found(strategy="random", text="MIX") == {"mixed"}
    for state in State:
        assert found(state=state) == {each["name"] for each in walk(api) if each["state"] == state}
    assert found(state="RUNNING") == {"mixed", "partly paused"}
    assert found(state="PAUSED") == {"paused"}
    assert found(state="CANCELLED") == {"off"}


def test_a_cursor_is_good_only_for_the_list_that_gave_it(api: TestClient) -> None:
    for _ in range(2):
        api.post("/studies", json=TOY)
    cursor = api.get("/studies", params={"limit": 1}).json()["next"]

    for other in ({"sort": "created_at"}, {"text": "r"}, {"state": "QUEUED"}, {"strategy": "random"}):
        refused = api.get("/studies", params=other | {"cursor": cursor})
        assert refused.status_code == 422
        assert refused.json()["errors"][0]["pointer"] == "cursor"
    assert len(api.get("/studies", params={"cursor": cursor, "limit": 7}).json()["items"]) == 1


def submitted(api: TestClient) -> tuple[str, str]:
    address = f"/studies/{api.post('/experiments', json=TOY).json()['id']}"
    return address, api.get(address).headers["etag"]


@pytest.mark.dialects
def test_a_change_that_starts_from_what_is_there_is_made_and_another_that_does_too_is_refused(api: TestClient) -> None:
    address, tag = submitted(api)

    first = api.patch(address, json={"name": "first", "notes": "new\0 notes"}, headers={"If-Match": tag})
    second = api.patch(address, json={"name": "second"}, headers={"If-Match": f'"9.aa", {tag}'})
    then = api.patch(address, json={"notes": None}, headers={"If-Match": first.headers["etag"]})

    assert (first.status_code, second.status_code, then.status_code) == (200, 412, 200)
    assert second.json()["type"] == "urn:gaplab:problem:changed"
    assert first.json()["notes"].startswith("new")
    shown = api.get(address).json()
    assert (shown["name"], shown["notes"], shown["edits"]) == ("first", None, 2)
    assert shown["experiments"][0]["name"] == "first"
    assert api.get("/studies", params={"text": "FIRST"}).json()["items"][0]["edits"] == 2


def test_an_experiment_among_others_has_a_name_of_its_own_and_the_notes_and_tags_of_its_study(api: TestClient) -> None:
    spec = {"name": "both", "strategies": ["random", "known_fit"], "robot": "toy_function", "budget": "smoke"}
    study = api.post("/studies", json=spec).json()
    one, whatever = f"/studies/{study['experiments'][0]['id']}", {"If-Match": "*"}

    renamed = api.patch(one, json={"name": "half the weight"}, headers=whatever).json()
    refused = api.patch(one, json={"tags": ["a"]}, headers=whatever)

    assert (renamed["name"], renamed["edits"]) == ("half the weight", 1)
    shown = api.get(f"/studies/{study['id']}").json()
    assert shown["name"] == "both"
    assert [each["name"] for each in shown["experiments"]] == ["half the weight", "known_fit"]
    assert refused.status_code == 409
    assert study["id"] in refused.json()["detail"]


def test_a_change_that_cannot_be_made_says_why(api: TestClient) -> None:
    wrong: list[tuple[dict[str, str], dict[str, Any], int]] = [
        ({}, {"name": "x"}, 428),
        ({"If-Match": "nonsense"}, {"name": "x"}, 412),
        ({"If-Match": '"99999999999999.aa"'}, {"name": "x"}, 412),
        ({"If-Match": "*"}, {}, 422),
        ({"If-Match": "*"}, {"name": None}, 422),
        ({"If-Match": "*"}, {"name": ""}, 422),
        ({"If-Match": "*"}, {"state": "COMPLETED"}, 422),
        ({"If-Match": "*"}, {"notes": "x" * 10_001}, 422),
    ]
    address, _ = submitted(api)

    answers = [api.patch(address, json=body, headers=headers) for headers, body, _ in wrong]

    assert [each.status_code for each in answers] == [status for *_, status in wrong]
    assert {each.headers["content-type"] for each in answers} == {"application/problem+json"}
    assert api.get(address).json()["edits"] == 0


def test_progress_outdates_what_was_seen_but_refuses_no_edit(store: Store, api: TestClient) -> None:
    address, tag = submitted(api)
    same = api.get(address, headers={"If-None-Match": f'"0.0", W/{tag}'})
    execution.claim(store, "me", 1)

    moved = api.get(address, headers={"If-None-Match": tag})
    edited = api.patch(address, json={"name": "x"}, headers={"If-Match": tag})

    assert (same.status_code, same.content, same.headers["etag"]) == (304, b"", tag)
    assert moved.status_code == 200
    assert moved.headers["etag"] != tag
    assert edited.status_code == 200


def test_whatever_there_is_is_not_sent_and_what_is_changed_is_shown(api: TestClient) -> None:
    address, tag = submitted(api)
    whatever = {"If-None-Match": "*"}

    read = api.get(address, headers=whatever)
    edited = api.patch(address, json={"name": "x"}, headers=whatever | {"If-Match": tag})

    assert (read.status_code, read.content, read.headers["etag"]) == (304, b"", tag)
    assert (edited.status_code, edited.json()["name"]) == (200, "x")


def test_the_catalogue_is_sent_once(api: TestClient) -> None:
    tag = api.get("/catalogue").headers["etag"]

    assert api.get("/catalogue", headers={"If-None-Match": tag}).status_code == 304
