"""Under what an experiment is computed, and that it does not go on under something else unless asked to."""

import subprocess
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from time import sleep
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import text

from gaplab.api.app import create_app
from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import State
from gaplab.schemas.resolved import SPEC_VERSION
from gaplab.services import events
from gaplab.services.core.errors import Conflict
from gaplab.services.events import WantedEvents
from gaplab.services.experiments import reading
from gaplab.services.running import execution, provenance, versions
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.session import Store
from tests.experiments import run, same, some_log, submit_one, toy

HERE = versions.provenance()
OTHERS = {
    "architecture": HERE.model_copy(update={"architecture": "riscv64"}),
    "engine": HERE.model_copy(update={"engines": HERE.engines | {"analytic": "analytic 2.0"}}),
    "spec version": HERE.model_copy(update={"spec_version": SPEC_VERSION + 1}),
}
ALIKE = HERE.model_copy(
    update={
        "python": "3.11.99",
        "commit": "f" * 40,
        "engines": HERE.engines | {"pybullet": "pybullet 9"},  # this experiment does not use it
        "outside": {"strategy careful": "careful.py 0123456789ab"},  # nor this
    }
)


def begun(store: Store, under: Any = HERE) -> Any:
    """An experiment with a step, queued again."""
    submit_one(store, toy(repetitions=2))
    (claim,) = execution.claim(store, "me", 1, under)
    execution.record(store, claim, next(some_log()))
    execution.hand_back(store, claim)
    return claim.experiment_id


def test_it_is_recorded_with_the_first_claim(store: Store) -> None:
    id_ = submit_one(store, toy(repetitions=2)).id
    assert provenance.read(store, id_).uses == ()

    execution.claim(store, "me", 2)

    found = provenance.read(store, id_)
    assert [(each.repetitions, each.provenance) for each in found.uses] == [(2, HERE)]
    assert found.computed_with == f"analytic (of gaplab's own), {HERE.architecture}, spec {SPEC_VERSION}"


@pytest.mark.dialects
def test_of_two_that_begin_it_at_once_one_is_bound_and_the_other_leaves_it_alone(store: Store) -> None:
    id_ = submit_one(store, toy(repetitions=2)).id

    with ThreadPoolExecutor(1) as pool:
        with store.transaction() as session:
            first = execution._claim(session, "me", 1, HERE)
            second = pool.submit(execution.claim, store, "you", 1, OTHERS["engine"])
            sleep(0.3)  # the other one waits for what is locked here
        assert second.result(timeout=30) == ()

    assert len(first) == 1
    assert [each.provenance for each in provenance.read(store, id_).uses] == [HERE]


def test_it_names_the_library_and_the_version_of_every_engine() -> None:
    assert HERE.engines["pybullet"].startswith("pybullet 3.")
    assert HERE.engines["mujoco"].startswith("mujoco ")
    assert "none" not in {*HERE.engines["mujoco"].split(), *HERE.engines["physx"].split()}
    assert versions.versions()["mujoco"] != "none"
    assert HERE.libraries.keys() >= {"numpy", "scipy", "cma"}


def test_a_library_may_come_in_a_distribution_of_another_name() -> None:
    assert versions._version("attr") == version("attrs")
    assert versions._version("no_such_library") == "none"


def test_it_knows_the_commit_and_whether_the_code_was_changed_since(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def git(*command: Any) -> None:
        subprocess.run(["git", "-C", tmp_path, *command], check=True, capture_output=True)

    monkeypatch.setattr(versions, "ROOT", tmp_path / "src" / "gaplab")
    monkeypatch.setattr(versions, "CLONE", tmp_path)
    for folder in versions.CODE:
        (versions.ROOT / folder).mkdir(parents=True)
    file = versions.ROOT / "schemas" / "a.py"
    file.write_text("a = 1\n")
    fresh = versions._software.__wrapped__

    assert (fresh().commit, fresh().dirty) == (None, None)
    git("init")
    git("add", ".")
    git("-c", "user.name=me", "-c", "user.email=me@example.org", "commit", "-m", "first")
    assert (len(fresh().commit), fresh().dirty) == (40, False)
    file.write_text("a = 2\n")
    assert fresh().dirty is True


@pytest.mark.parametrize("what", OTHERS)
def test_a_supervisor_with_another_of_what_decides_leaves_it_alone_and_the_experiment_says_why(
    store: Store, what: Any
) -> None:
    id_ = begun(store)

    assert execution.claim(store, "other", 9, OTHERS[what]) == ()
    assert execution.claim(store, "other", 9, OTHERS[what]) == ()

    (warning,) = reading.read_experiment(store, id_).warnings
    assert "does not go on" in warning
    assert f"gaplab accept-versions {id_}" in warning
    refused = events.page(store, 0, WantedEvents(kinds=frozenset({EventKind.VERSIONS_REFUSED})), limit=9).items
    assert [each.body["refused_by"] for each in refused] == [provenance.read(store, id_).refused_by]
    assert len(execution.claim(store, "me", 9)) == 2


def with_own(**files: Any) -> Any:
    """A provenance with plug-ins from outside: by kind and name, the file."""
    return HERE.model_copy(update={"outside": {key.replace("__", " "): file for key, file in files.items()}})


@pytest.mark.parametrize("kind", ["strategy__simulated_fit", "robot__toy_function", "tunable__dynamic_friction"])
def test_a_plug_in_of_ones_own_that_was_edited_or_is_gone_decides_too(store: Store, kind: Any) -> None:
    mine = with_own(**{kind: "own.py 0123456789ab", "strategy__other": "other.py 0123456789ab"})
    id_ = begun(store, mine)

    assert execution.claim(store, "other", 9, with_own(**{kind: "own.py ba9876543210"})) == ()
    assert execution.claim(store, "other", 9, HERE) == ()
    (warning,) = reading.read_experiment(store, id_).warnings
    assert f"{kind.replace('__', ' ')} (own.py 0123456789ab)" in warning
    assert "own.py ba9876543210" in warning

    edited_another = with_own(**{kind: "own.py 0123456789ab", "strategy__other": "other.py ba9876543210"})
    assert len(execution.claim(store, "me", 9, edited_another)) == 2


def test_what_decides_may_be_long(store: Store) -> None:
    kind, file = "strategy__simulated_fit", f"{'long' * 100}.py 0123456789ab"
    id_ = begun(store, with_own(**{kind: file}))

    assert file in provenance.read(store, id_).computed_with
    assert len(execution.claim(store, "me", 9, with_own(**{kind: file}))) == 2


def test_one_that_differs_only_in_what_changes_no_number_goes_on(store: Store) -> None:
    begun(store)

    assert len(execution.claim(store, "other", 9, ALIKE)) == 2


def test_what_it_leaves_alone_keeps_nothing_else_waiting(store: Store) -> None:
    begun(store)
    later = submit_one(store, toy(repetitions=1)).id

    claims = execution.claim(store, "other", 1, OTHERS["architecture"])

    assert [each.experiment_id for each in claims] == [later]


@pytest.mark.dialects
def test_accepted_it_goes_on_from_its_log_and_both_are_recorded(store: Store) -> None:
    id_ = begun(store)
    other = OTHERS["engine"]
    execution.claim(store, "other", 9, other)

    accepted = provenance.accept_versions(store, id_)
    claims = execution.claim(store, "other", 9, other)

    assert accepted.experiments[0].warnings == ()
    assert same(claims[0].log, tuple(some_log())[:1])
    found = provenance.read(store, id_)
    assert [each.provenance for each in found.uses] == [HERE, other]
    assert [each.repetitions for each in found.uses] == [0, 2]
    assert "analytic 2.0" in found.computed_with
    told = events.page(store, 0, WantedEvents(kinds=frozenset({EventKind.VERSIONS_ACCEPTED})), limit=9).items
    assert "of gaplab's own" in told[0].body["computed_with"]
    assert "analytic 2.0" in told[0].body["refused_by"]
    for claim in claims:
        execution.hand_back(store, claim)
    assert execution.claim(store, "me", 9) == ()  # it is bound to the others now


def test_a_refused_plug_in_unbinds_an_experiment_unless_it_has_steps_of_its_own(store: Store) -> None:
    kept = begun(store)
    loose = submit_one(store, toy(repetitions=1)).id
    claims = execution.claim(store, "me", 3)
    assert {each.experiment_id for each in claims} == {kept, loose}
    for each in claims:
        execution.hand_back(store, each)

    for id_ in (kept, loose):
        provenance.tell_refused(store, id_, HERE, {})

    assert [bool(provenance.read(store, id_).computed_with) for id_ in (kept, loose)] == [True, False]


def test_there_is_nothing_to_accept_before_it_has_begun_or_after_it_has_ended(store: Store) -> None:
    id_ = submit_one(store, toy(repetitions=1)).id

    with pytest.raises(Conflict, match="has not started"):
        provenance.accept_versions(store, id_)
    run(store, execution.claim(store, "me", 1)[0])
    with pytest.raises(Conflict, match="has ended: it is COMPLETED"):
        provenance.accept_versions(store, id_)


def test_over_http(sqlite_store: Store) -> None:
    id_ = begun(sqlite_store)
    with TestClient(create_app(sqlite_store)) as api:
        shown = api.get(f"/experiments/{id_}/provenance").json()
        accepted = api.post(f"/studies/{id_}/accept-versions")
        missing = api.post("/studies/nobody/accept-versions")

    assert shown["uses"][0]["provenance"]["python"] == HERE.python
    assert (accepted.status_code, accepted.json()["id"]) == (200, id_)
    assert missing.status_code == 404


def test_a_spec_of_a_later_version_is_not_read_and_not_run(store: Store) -> None:
    id_ = submit_one(store, toy()).id
    with store.transaction() as session:
        session.execute(text("UPDATE experiment SET spec_version = 99"))

    with pytest.raises(StoreUnavailable, match=rf"'{id_}' is of version 99, .* reads up to {SPEC_VERSION}"):
        reading.read_experiment(store, id_)
    assert execution.claim(store, "me", 9) == ()
    later = submit_one(store, toy(repetitions=1))
    assert [each.experiment_id for each in execution.claim(store, "me", 9)] == [later.id]
    assert reading.read_experiment(store, later.id).state is State.RUNNING
