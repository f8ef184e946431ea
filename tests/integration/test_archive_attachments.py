"""Files beside measurements go with the archive of the answers that name them, and come back with it."""

import json
import re
import zipfile
from hashlib import sha256
from io import BytesIO
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select

from gaplab.api.app import create_app
from gaplab.schemas.spec import StudySpec
from gaplab.services.archives import export, opening
from gaplab.services.bench import attachments
from gaplab.services.core.errors import InvalidArchive
from gaplab.services.experiments.deletion import Deleter, delete
from gaplab.services.experiments.reading import read_experiment
from gaplab.services.experiments.submission import submit
from gaplab.services.settings import Limits, variable_of
from gaplab.services.store.models import AttachmentRow
from gaplab.services.store.session import Store
from tests.archiving import exported, imported
from tests.experiments import listed, submit_one
from tests.integration.test_archives_bad import packed, set_in, with_table
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


def members_of(archive: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(BytesIO(archive)) as opened:
        return {name: opened.read(name) for name in opened.namelist()}


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

    manifest = json.loads(members_of(archive)["manifest.json"])["members"]
    named = {name for name in manifest if name.startswith("attachments/")}
    assert named == {f"attachments/{each}" for each in files}
    assert all(manifest[f"attachments/{each}"]["sha256"] == each for each in files)
    assert manifest["attachment.parquet"]["rows"] == 2
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

    assert [name for name in members_of(archive) if name.startswith("attachments/")] == [
        f"attachments/{each}" for each in sorted([shared, *own])
    ]
    assert imported(sqlite_store, archive).study != study.id


@pytest.fixture
def good(sqlite_store: Store) -> dict[str, bytes]:
    """The members of an archive with files; the database has it no more."""
    experiment, _ = measured(sqlite_store)
    archive = exported(export(sqlite_store, experiment))
    delete(sqlite_store, experiment, Deleter(None))
    return members_of(archive)


def with_file(members: dict[str, bytes], name: str, content: bytes | None) -> bytes:
    """An archive with another content of a member, whose manifest is true; without the member if there is none."""
    manifest = json.loads(members["manifest.json"])
    changed = {each: old for each, old in members.items() if each != name}
    manifest["members"].pop(name, None)
    if content is not None:
        changed[name] = content
        manifest["members"][name] = {"sha256": sha256(content).hexdigest(), "bytes": len(content), "rows": 0}
    return packed(changed | {"manifest.json": json.dumps(manifest).encode()}, honest=False)  # type: ignore[no-any-return]


def refused(store: Store, archive: bytes, what: str) -> None:
    with pytest.raises(InvalidArchive, match=what):
        imported(store, archive)
    assert listed(store) == []
    assert stored(store) == set()


def of(content: bytes) -> str:
    return f"attachments/{sha256(content).hexdigest()}"


def test_a_file_that_does_not_fit_its_hash_is_refused(sqlite_store: Store, good: dict[str, bytes]) -> None:
    refused(sqlite_store, with_file(good, of(PHOTO), b"forged"), f"content of {of(PHOTO)} has another hash")
    refused(sqlite_store, packed(good | {of(TRACE): b"forged"}, honest=False), "differs from the manifest")


def test_a_file_without_a_row_or_a_row_without_a_file_is_refused(sqlite_store: Store, good: dict[str, bytes]) -> None:
    refused(sqlite_store, with_file(good, of(PHOTO), None), "has a row or a file, but not both")
    refused(sqlite_store, with_file(good, of(b"more"), b"more"), "has a row or a file, but not both")
    refused(sqlite_store, with_file(good, "attachments/../x", b"x"), "unknown member")


def test_a_file_that_no_answer_names_is_refused(sqlite_store: Store, good: dict[str, bytes]) -> None:
    (answer,) = map(json.loads, good["answer.jsonl"].splitlines())

    for names, what in (
        ([sha256(TRACE).hexdigest()], "no answer names"),
        ([{}], "answer, row 1, attachments/0: item 0 of attachments must be text"),
    ):
        changed = json.dumps(answer | {"attachments": names}).encode() + b"\n"
        refused(sqlite_store, packed(good | {"answer.jsonl": changed}), what)


def test_more_files_than_are_permitted(
    sqlite_store: Store, good: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    for limit, most, what in (
        ("MOST_BYTES_OF_FILES", 100_000, "its attachments have 135,013 bytes; 100,000 are permitted"),
        ("MOST_FILES", 1, "it has 2 attachments; 1 are permitted: export its experiments one by one"),
        ("MOST_BYTES_OF_DIRECTORY", 100, "its directory has .* bytes; 100 are permitted"),
    ):  # each is looked at before those above it
        monkeypatch.setattr(opening, limit, most)
        refused(sqlite_store, packed(good), what)


def test_a_file_larger_than_one_that_is_stored(sqlite_store: Store, good: dict[str, bytes]) -> None:
    large = bytes(20_000_001)

    refused(sqlite_store, with_file(good, of(large), large), "has 20,000,001 bytes; 1 to 20,000,000 are permitted")
    refused(sqlite_store, with_file(good, of(b""), b""), "has 0 bytes")


def test_an_archive_with_photographs_is_let_in_over_http(store: Store) -> None:
    experiment, (photo, _) = measured(store)
    with TestClient(create_app(store)) as api:
        archive = api.get(f"/studies/{experiment}/export").content
        api.delete(f"/studies/{experiment}")
        gone = api.get(f"/attachments/{photo}").status_code

        answer = api.post("/import", content=archive)

        assert (gone, answer.status_code) == (404, 201)
        assert api.get(f"/attachments/{photo}").content == PHOTO


def changed(members: dict[str, bytes], table: str, **values: Any) -> bytes:
    """An archive with other values in the first row of a table."""
    if f"{table}.parquet" in members:
        return packed(with_table(members, table, lambda rows: set_in(rows, 0, **values)))  # type: ignore[no-any-return]
    first, *others = members[f"{table}.jsonl"].splitlines()
    lines = [json.dumps(json.loads(first) | values).encode(), *others, b""]
    return packed(members | {f"{table}.jsonl": b"\n".join(lines)})  # type: ignore[no-any-return]


BAD: list[tuple[str, dict[str, Any], str]] = [
    ("request", {"safety": [1, 2]}, "request, row 1, safety: safety must be an object"),
    ("request", {"safety": {"failed": 0}}, "request, row 1, safety/simulators: simulators is missing"),
    ("request", {"genome": [0.5, 0.5]}, "/genome: a controller of the toy_function has 1 genes, not 2"),
    ("request", {"genome": [500.0]}, "/genome/0: gene 0 must be from 0 to 1, not 500"),
    ("measurement", {"genome": [500.0]}, "/genome/0: gene 0 must be from 0 to 1, not 500"),
    ("iteration", {"transferred_genome": [-0.1]}, "/genome/0: gene 0 must be from 0 to 1, not -0.1"),
    ("answer", {"values": []}, "answer, row 1, values: values must have at least 1 item"),
    ("answer", {"readings": [[0.1]]}, "answer, row 1, readings/0/0: item 0 of readings must be a list"),
    ("answer", {"readings": [[[0.1]]]}, "/readings/0: repeat 0 has 1 rows, and the sensors are read at 0 times"),
    ("answer", {"traces": [{"x": 1}]}, "answer, row 1, traces/0/attachment: attachment is missing"),
    ("answer", {"traces": [{"attachment": "ab" * 32, "lag_s": 0.0}]}, "each trace must be among the attachments"),
    ("answer", {"doubts": [1]}, "answer, row 1, doubts/0: item 0 of doubts must be text"),
    ("experiment", {"precedence": -(2**30)}, "experiment, row 1, precedence: precedence must be at least -10"),
    ("experiment", {"max_parallel": 0}, "experiment, row 1, max_parallel: max_parallel must be at least 1"),
]


def test_whatever_a_request_later_reads_is_checked_when_it_arrives(sqlite_store: Store, good: dict[str, bytes]) -> None:
    for table, values, what in BAD:
        refused(sqlite_store, changed(good, table, **values), re.escape(what))


def test_what_goes_on_here_stays_within_the_limits_of_a_submission(sqlite_store: Store, other: Store) -> None:
    experiment = submit_one(sqlite_store, bench(repetitions=2, budget={"controller_evaluations": 10**7})).id
    members = members_of(exported(export(sqlite_store, experiment)))
    archive = changed(members, "experiment", rollouts=2**47)
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
