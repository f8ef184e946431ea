"""A spec names plug-ins that are registered and nothing else; what is wrong with one is the sender's problem."""

import copy
import json
import random
from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.services.store.session import Store
from tests.mutated_specs import FORBIDDEN_NAMES, VALID_SPECS, measure, mutated


@pytest.fixture
def api(store: Store) -> Iterator[TestClient]:
    with TestClient(create_app(store), raise_server_exceptions=False) as client:
        yield client


def test_every_mutated_spec_is_taken_or_refused(api: TestClient) -> None:
    found = measure(150, seed=1, api=api)

    assert found.wrong == []
    assert found.statuses.total() == 150
    assert found.statuses[202] > 5
    assert found.statuses[422] > 50


def test_mutations_follow_from_their_seed() -> None:
    one, same, other = (mutated(VALID_SPECS["/studies"], random.Random(seed)) for seed in (3, 3, 4))

    assert json.dumps(one) == json.dumps(same) != json.dumps(other)


NAMES = [
    ("/strategy", "/strategy"),
    ("/strategy/name", "/strategy"),
    ("/robot", "/robot"),
    ("/engine", "/engine"),
    ("/engine/name", "/engine"),
    ("/optimizer", "/optimizer"),
    ("/tunables/0", "/tunables/0"),
    ("/reality/engine", "/reality/engine"),
]


@pytest.mark.parametrize(("place", "pointer"), NAMES)
def test_a_file_a_class_an_address_or_code_is_no_plugin(
    sqlite_store: Store, monkeypatch: pytest.MonkeyPatch, place: str, pointer: str
) -> None:
    api = TestClient(create_app(sqlite_store), raise_server_exceptions=False)
    api.get("/catalogue")  # every plug-in is imported by now
    opened: list[object] = []
    monkeypatch.setattr("builtins.open", lambda *given, **_: opened.append(given))
    monkeypatch.setattr("importlib.import_module", lambda *given, **_: opened.append(given))

    for name in FORBIDDEN_NAMES:
        spec: Any = copy.deepcopy(VALID_SPECS["/experiments"])
        *parents, last = place.split("/")[1:]
        target = spec
        for part in parents:
            target = target[part]
        target[int(last) if isinstance(target, list) else last] = name
        answer = api.post("/experiments", json=spec)
        assert answer.status_code == 422, name
        assert any(each["pointer"].startswith(pointer) for each in answer.json()["errors"])
    assert opened == []


@pytest.mark.parametrize("place", ["options", "path", "url", "class", "module"])
def test_a_plugin_takes_no_path_address_or_class_beside_its_name(sqlite_store: Store, place: str) -> None:
    api = TestClient(create_app(sqlite_store))
    for kind in ("strategy", "robot", "engine", "optimizer"):
        extra = {"path": FORBIDDEN_NAMES[0]} if place == "options" else FORBIDDEN_NAMES[0]
        spec = VALID_SPECS["/experiments"] | {kind: {"name": VALID_SPECS["/experiments"][kind]["name"], place: extra}}

        assert api.post("/experiments", json=spec).status_code == 422
