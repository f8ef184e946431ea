"""Files beside measurements go with the archive of the answers that name them, and come back with it."""

import json
import re
import sqlite3
from hashlib import sha256
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select

from gaplab.api.app import create_app
from gaplab.schemas.spec import StudySpec
from gaplab.services.archives import export, opening
from gaplab.services.core.errors import InvalidArchive
from gaplab.services.experiments.editing import Deleter, delete
from gaplab.services.experiments.reading import read_experiment
from gaplab.services.experiments.submission import submit
from gaplab.services.measuring import attachments
from gaplab.services.settings import Limits, variable_of
from gaplab.services.store.models import AttachmentRow
from gaplab.services.store.session import Store
from tests.archiving import changed, exported, imported, loose, rows
from tests.experiments import listed, submit_one
from tests.integration.test_bench import bench, compute, measure, pending

PHOTO, TRACE = b"\xff\xd8 a photograph" * 9_000, b"time_s,x\n0,1\n"


def stored(store: Store) -> set[str]:
    with store.reading() as session:
        return set(session.scalars(select(AttachmentRow.id)))


def send(store: Store, content: bytes, name: str, media_type: str = "image/jpeg") -> str:
    return attachments.store_attachment(store, content, name, media_type).id


def measured(store: Store) -> Any:
    """A complete experiment on a bench, and the hashes of its photograph and its trace."""
    experiment = submit_one(store, bench(iterations=1, reality={"probes": "never"}))
    compute(store)
    files = [send(store, PHOTO, "größe.jpg"), send(store, TRACE, "trace.csv", "text/csv")]
    (request,) = pending(store)
    measure(store, request, 0.5, attachments=files)
    compute(store)
    return experiment.id, files


@pytest.mark.dialects
def test_what_was_exported_and_deleted_comes_back_with_its_files(store: Store, other: Store) -> None:
    experiment, files = measured(store)
    unnamed = send(store, b"no answer names it", "x")
    before = [attachments.read_attachment(store, each) for each in files]
    archive = exported(export(store, experiment))
    delete(store, experiment, Deleter(None))
    assert stored(store) == {unnamed}

    for place in (store, other):
        imported(place, archive)
        assert [attachments.read_attachment(place, each) for each in files] == before
        assert exported(export(place, experiment)) == archive

    content = rows(archive, "SELECT id, content FROM attachment")
    assert {each["id"]: sha256(each["content"]).hexdigest() for each in content} == {each: each for each in files}
    delete(other, experiment, Deleter(None))
    assert stored(other) == set()


def test_a_file_that_is_there_already_stays_as_it_is(store: Store, other: Store) -> None:
    experiment, (photo, trace) = measured(store)
    archive = exported(export(store, experiment))
    send(other, PHOTO, "mine.png", "image/png")

    imported(other, archive)
    imported(other, archive)  # under another id

    assert attachments.read_attachment(other, photo)[0].name == "mine.png"
    assert stored(other) == {photo, trace}


def test_a_study_has_the_files_of_all_its_experiments_once(sqlite_store: Store) -> None:
    alike = bench(iterations=1, reality={"probes": "never"}).model_dump(mode="json", exclude={"strategy", "name"})
    study = submit(sqlite_store, StudySpec.model_validate(alike | {"strategies": ["random", "known_fit"]}))
    compute(sqlite_store)
    shared = send(sqlite_store, PHOTO, "shared")
    own = [send(sqlite_store, name, "own") for name in (b"first", b"second")]
    for request, file in zip(pending(sqlite_store), own, strict=True):
        measure(sqlite_store, request, 0.5, attachments=[shared, file])
    compute(sqlite_store)

    archive = exported(export(sqlite_store, study.id))

    assert [each["id"] for each in rows(archive, "SELECT id FROM attachment")] == sorted([shared, *own])
    assert imported(sqlite_store, archive).study != study.id


@pytest.fixture
def good(sqlite_store: Store) -> bytes:
    """An archive with files, in tables that any value can be written into; the database has it no more."""
    experiment, _ = measured(sqlite_store)
    archive = exported(export(sqlite_store, experiment))
    delete(sqlite_store, experiment, Deleter(None))
    return loose(archive)


def with_file(archive: bytes, id_: str, content: object) -> bytes:
    """An archive with another content of a file."""

    def change(connection: sqlite3.Connection) -> None:
        connection.execute("DELETE FROM attachment WHERE id = ?", (id_,))
        row = {
            "id": id_,
            "name": "x",
            "media_type": "x/y",
            "content": content,
            "created_at": "2026-01-01 00:00:00.000000",
        }
        connection.execute("INSERT INTO attachment VALUES (:id, :name, :media_type, :content, :created_at)", row)

    return changed(archive, change)


def refused(store: Store, archive: bytes, what: str) -> None:
    with pytest.raises(InvalidArchive, match=what):
        imported(store, archive)
    assert listed(store) == []
    assert stored(store) == set()


def of(content: bytes) -> str:
    return sha256(content).hexdigest()


def test_a_file_that_does_not_fit_its_hash_is_refused(sqlite_store: Store, good: bytes) -> None:
    for content in (b"forged", PHOTO[:-1], PHOTO + b" "):
        refused(
            sqlite_store, with_file(good, of(PHOTO), content), f"content of the attachment '{of(PHOTO)}' has another"
        )
    for value in (5, "text", b"", bytes(20_000_001), None):
        refused(sqlite_store, with_file(good, of(PHOTO), value), "must have 1 to 20,000,000 bytes")


def test_a_file_that_no_answer_names_or_that_is_missing_is_refused(sqlite_store: Store, good: bytes) -> None:
    names = "UPDATE answer SET attachments = '{}'"

    for archive, what in (
        (
            changed(good, f"DELETE FROM attachment WHERE id = '{of(PHOTO)}'"),
            f"'{of(PHOTO)}' is missing from the archive",
        ),
        (
            with_file(good, of(b"more"), b"more"),
            f"'{of(b'more')}' is missing from the archive, or no answer names it",
        ),
        (changed(good, names.format(json.dumps([of(TRACE)]))), "is missing from the archive, or no answer names it"),
        (changed(good, names.format("[{}]")), "attachments/0: item 0 of attachments must be text"),
        (changed(good, names.format("[5]")), "attachments/0: item 0 of attachments must be text"),
        (changed(good, names.format("7")), "attachments: attachments must be a list"),
        (changed(good, names.format("{}")), "attachments: attachments must be a list"),
    ):
        refused(sqlite_store, archive, re.escape(what))


def test_more_files_than_are_permitted(sqlite_store: Store, good: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    for limit, most, what in (
        ("MOST_BYTES_OF_FILES", 100_000, "its attachments have more than 100,000 bytes"),
        ("MOST_FILES", 1, "it has more than 1 attachments: export its experiments one by one"),
        ("MOST_BYTES_OF_DIRECTORY", 50, "its directory has .* bytes; 50 are permitted"),
    ):  # each is looked at before those above it
        monkeypatch.setattr(opening, limit, most)
        refused(sqlite_store, good, what)


def test_an_archive_with_photographs_is_let_in_over_http(store: Store) -> None:
    experiment, (photo, _) = measured(store)
    with TestClient(create_app(store)) as api:
        archive = api.get(f"/studies/{experiment}/export").content
        api.delete(f"/studies/{experiment}")
        gone = api.get(f"/attachments/{photo}").status_code

        answer = api.post("/import", content=archive)

        assert (gone, answer.status_code) == (404, 201)
        assert api.get(f"/attachments/{photo}").content == PHOTO


def with_values(archive: bytes, table: str, **values: Any) -> bytes:
    """An archive with other values in a table, lists and objects as JSON."""

    def change(connection: sqlite3.Connection) -> None:
        for name, value in values.items():
            stored = json.dumps(value) if isinstance(value, dict | list) else value
            assert connection.execute(f"UPDATE [{table}] SET [{name}] = ?", (stored,)).rowcount

    return changed(archive, change)


BAD: list[tuple[str, dict[str, Any], str]] = [
    ("request", {"safety": [1, 2]}, "request, row 1, safety: safety must be an object"),
    ("request", {"safety": {"failed": 0}}, "request, row 1, safety/simulators: simulators is missing"),
    ("request", {"genome": [0.5, 0.5]}, "/genome: a controller of the toy_function has 1 genes, not 2"),
    ("request", {"genome": [500.0]}, "/genome/0: gene 0 must be from 0 to 1, not 500"),
    ("step", {"body": {"genome": [500.0]}}, "/genome/0: gene 0 must be from 0 to 1, not 500"),
    ("step", {"body": {"genome": [-0.1]}}, "/genome/0: gene 0 must be from 0 to 1, not -0.1"),
    ("request", {"genome": "{}"}, "genome: genome must be a list"),
    ("request", {"created_at": "x"}, "request, row 1 has a value that its column does not permit"),
    ("answer", {"values": []}, "answer, row 1, values: values must have at least 1 item"),
    ("answer", {"readings": [[0.1]]}, "answer, row 1, readings/0/0: item 0 of readings must be a list"),
    ("answer", {"readings": [[[0.1]]]}, "/readings/0: repeat 0 has 1 rows, and the sensors are read at 0 times"),
    ("answer", {"traces": [{"x": 1}]}, "answer, row 1, traces/0/attachment: attachment is missing"),
    ("answer", {"traces": [{"attachment": "ab" * 32, "lag_s": 0.0}]}, "each trace must be among the attachments"),
    ("answer", {"doubts": [1]}, "answer, row 1, doubts/0: item 0 of doubts must be text"),
    ("experiment", {"precedence": -(2**30)}, "experiment, row 1, precedence: precedence must be at least -10"),
    ("experiment", {"max_parallel": 0}, "experiment, row 1, max_parallel: max_parallel must be at least 1"),
]


def test_whatever_a_request_later_reads_is_checked_when_it_arrives(sqlite_store: Store, good: bytes) -> None:
    for table, values, what in BAD:
        refused(sqlite_store, with_values(good, table, **values), re.escape(what))


def test_what_goes_on_here_stays_within_the_limits_of_a_submission(sqlite_store: Store, other: Store) -> None:
    experiment = submit_one(sqlite_store, bench(repetitions=2, budget={"controller_evaluations": 10**7})).id
    archive = with_values(exported(export(sqlite_store, experiment)), "experiment", rollouts=2**47)
    expected = read_experiment(sqlite_store, experiment).progress.rollouts

    refused = {
        name: TestClient(create_app(other, limits=Limits(**{name: 1}))).post("/import", content=archive)  # type: ignore[arg-type]
        for name in ("iterations", "repetitions", "unconfirmed_core_hours", "rollouts_per_token")
    }
    api = TestClient(create_app(other, limits=Limits(unconfirmed_core_hours=1, experiments=1)))
    let_in = api.post("/import?confirm_cost=true", content=archive)
    full = api.post("/import?confirm_cost=true", content=archive)

    assert [each.status_code for each in (*refused.values(), let_in, full)] == [422, 422, 422, 429, 201, 429]
    for name, answer in refused.items():
        assert variable_of(name) in answer.json()["detail"]
    assert read_experiment(other, experiment).progress.rollouts == expected
