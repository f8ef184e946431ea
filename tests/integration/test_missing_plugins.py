"""Experiments whose plug-ins are gone: what is stored is shown, and what cannot be computed is said in a sentence."""

from copy import deepcopy

import pytest
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.running.execution import claim
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.session import Store
from tests.experiments import run, submit_one, toy
from tests.parameters import few

WHY = "'gone'; permitted: ", "the robot 'gone' with the hash"
OF_ONE = ("/experiments/{}", "/experiments/{}/curve", "/experiments/{}/misfit", "/experiments/{}/simulators")
STORED = (*OF_ONE, "/studies/{}", "/studies/{}/report", "/studies/{}/export")
COMPUTED = ("/experiments/{}/predictions", "/figures/predictions?experiment={}", "/figures/toy?experiment={}")


def experiment_without(store: Store, kind: str) -> str:
    """The id of one that is computed, and whose plug-in of this kind, or whose robot's file, is gone."""
    made = submit_one(store, toy(repetitions=1))
    (one,) = claim(store, "me", 1)
    run(store, one)
    with store.transaction() as session:
        row = session.get_one(ExperimentRow, made.id)
        spec = deepcopy(row.spec)
        if kind == "file":
            spec["robot"] = {"name": "robot_file", "options": {"sha256": "0" * 64, "name": "gone"}}
        else:
            (spec["tunables"][0] if kind == "tunables" else spec[kind])["name"] = "gone"
        row.spec = spec
    return made.id


@pytest.mark.parametrize("kind", few(["robot", "file", "engine", "tunables", "optimizer"], "file".__eq__))
def test_what_is_stored_is_shown(sqlite_store: Store, kind: str) -> None:
    id_ = experiment_without(sqlite_store, kind)
    api = TestClient(create_app(sqlite_store))

    answers = {path: api.get(path.format(id_)).status_code for path in STORED}

    assert answers == dict.fromkeys(STORED, 200)


@pytest.mark.parametrize("kind", ["robot", "file", "engine", "tunables"])
def test_what_cannot_be_computed_any_more_says_why(sqlite_store: Store, kind: str) -> None:
    id_ = experiment_without(sqlite_store, kind)
    api = TestClient(create_app(sqlite_store))

    answers = {path: api.get(path.format(id_)) for path in COMPUTED}

    assert {path: each.status_code for path, each in answers.items()} == dict.fromkeys(COMPUTED, 422)
    assert [path for path, each in answers.items() if WHY[kind == "file"] not in each.text] == []


@pytest.mark.parametrize("kind", ["robot", "file", "engine", "tunables", "optimizer", "strategy"])
def test_a_repetition_of_it_fails_with_a_sentence(sqlite_store: Store, kind: str) -> None:
    id_ = experiment_without(sqlite_store, kind)
    with sqlite_store.reading() as session:
        spec = spec_of(session.get_one(ExperimentRow, id_).spec)

    with pytest.raises(InvalidSpec, match=WHY[kind == "file"]):
        setting(spec, 0)
