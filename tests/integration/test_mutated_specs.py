"""A spec names plug-ins that are registered and nothing else; what is wrong with one is the sender's problem."""

import copy
import json
import random
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.services.store.session import Store
from tests.mutated_specs import FORBIDDEN_NAMES, VALID_SPECS, measure, mutated


@pytest.mark.dialects  # Postgres refuses texts that SQLite takes
def test_every_mutated_spec_is_taken_or_refused(store: Store, pytestconfig: pytest.Config) -> None:
    count = 1_000 if pytestconfig.getoption("all") else 60
    found = measure(count, seed=1, api=TestClient(create_app(store), raise_server_exceptions=False))

    assert found.wrong == []
    assert found.statuses.total() == count
    assert found.statuses[202] > count / 30
    assert found.statuses[422] > count / 3


def test_mutations_follow_from_their_seed() -> None:
    one, same, other = (mutated(VALID_SPECS["/studies"], random.Random(seed)) for seed in (3, 3, 4))

    assert json.dumps(one) == json.dumps(same) != json.dumps(other)


NAMES = {
    "/strategy": "/strategy",
    "/strategy/name": "/strategy",
    "/robot": "/robot",
    "/engine": "/engine",
    "/engine/name": "/engine",
    "/optimizer": "/optimizer",
    "/tunables/0": "/tunables/0",
    "/reality/engine": "/reality/engine",
}
"""Places of names, with the pointers of what is wrong there."""


def named(place: str, name: str) -> Any:
    """A valid spec with this name in this place."""
    spec: Any = copy.deepcopy(VALID_SPECS["/experiments"])
    *parents, last = place.split("/")[1:]
    target = spec
    for part in parents:
        target = target[part]
    target[int(last) if isinstance(target, list) else last] = name
    return spec


@contextmanager
def looked_for() -> Iterator[list[str]]:
    """The files and modules that this process opens or imports meanwhile."""
    found: list[str] = []
    watching = True

    def watch(event: str, given: Any) -> None:
        if watching and event in {"open", "import"} and isinstance(given[0], str):
            found.append(given[0])

    sys.addaudithook(watch)  # for as long as the process lives
    yield found
    watching = False


def test_a_file_a_class_an_address_or_code_is_no_plugin_and_is_not_opened(sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store), raise_server_exceptions=False)
    api.get("/catalogue")  # every plug-in is imported by now
    asked = [*((place, FORBIDDEN_NAMES[0]) for place in NAMES), *(("/robot", name) for name in FORBIDDEN_NAMES)]

    with looked_for() as opened:
        answers = {(place, name): api.post("/experiments", json=named(place, name)) for place, name in asked}

    assert {each.status_code for each in answers.values()} == {422}
    for (place, _), answer in answers.items():
        assert any(each["pointer"].startswith(NAMES[place]) for each in answer.json()["errors"]), place
    assert [each for each in opened if any(each in name for name in FORBIDDEN_NAMES)] == []


def test_a_plugin_takes_no_path_address_or_class_beside_its_name(sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store))
    for kind in ("strategy", "robot", "engine", "optimizer"):
        for place in ("options", "path"):
            extra = {"path": FORBIDDEN_NAMES[0]} if place == "options" else FORBIDDEN_NAMES[0]
            plugin = {"name": VALID_SPECS["/experiments"][kind]["name"], place: extra}

            assert api.post("/experiments", json=VALID_SPECS["/experiments"] | {kind: plugin}).status_code == 422
