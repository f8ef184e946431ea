"""Archives that were damaged, or made to harm: each is refused in one sentence, and nothing of it is stored."""

import json
import sqlite3
import zipfile
from collections.abc import Callable, Iterable
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gaplab.api.app import create_app
from gaplab.api.http import limits
from gaplab.services.archives import export, import_archive, opening, reading
from gaplab.services.core.errors import Conflict, InvalidArchive
from gaplab.services.experiments import listing
from gaplab.services.experiments.reading import read_experiment
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.archiving import changed, database_of, exported, imported, loose, packed, rows
from tests.conftest import filled
from tests.experiments import listed, run, submit_one, toy


@pytest.fixture(scope="module")
def good(sqlite_template: Path) -> bytes:
    """An archive with which nothing is wrong."""
    found = list[bytes]()

    def fill(store: Store) -> None:
        submitted = submit_one(store, toy(repetitions=2)).id
        for claim in execution.claim(store, "me", 2):
            run(store, claim)
        found.append(exported(export(store, submitted)))

    filled(sqlite_template, fill)
    return found[0]


@pytest.fixture(scope="module")
def free(good: bytes) -> bytes:
    """The same, in tables that any value can be written into."""
    return loose(good)


def refused(store: Store, archive: bytes, *what: str) -> None:
    assert all_refused(store, [(archive, what)])


def all_refused(store: Store, cases: Iterable[tuple[bytes, str | tuple[str, ...]]]) -> bool:
    """Each archive is refused with these words, and nothing is stored of any."""
    wrong = []
    for archive, words in cases:
        try:
            import_archive(store, BytesIO(archive))
            wrong.append((words, "it is stored"))
        except InvalidArchive as error:
            if not all(each in str(error) for each in ([words] if isinstance(words, str) else words)):
                wrong.append((words, str(error)))
    assert wrong == []
    assert listing.list_studies(store).items == ()
    return True


def test_the_good_one_is_good_in_any_tables(sqlite_store: Store, good: bytes, free: bytes) -> None:
    (first,) = imported(sqlite_store, good).experiments
    second = imported(sqlite_store, free).experiments[0]

    assert read_experiment(sqlite_store, first).progress.completed == 2
    assert exported(export(sqlite_store, first)) == good
    assert len(exported(export(sqlite_store, second))) == pytest.approx(len(good), abs=100)


def test_what_is_no_zip(sqlite_store: Store) -> None:
    archives = (b"", b"no zip", b"PK\x03\x04" + bytes(100), b"PK\x05\x06" + b"\xff" * 18)

    all_refused(sqlite_store, [(each, "zip") for each in archives])


def test_another_member(sqlite_store: Store, good: bytes) -> None:
    names = (
        "../../../etc/passwd",
        "/etc/passwd",
        "C:\\x",
        "study.sqlite3-journal",
        "study.sqlite3-wal",
        "a/study.sqlite3",
    )
    database = database_of(good)
    nothing = BytesIO()
    zipfile.ZipFile(nothing, "w").close()

    all_refused(sqlite_store, [(packed(database, {each: b"x"}), ("study.sqlite3 alone", each[:64])) for each in names])
    refused(sqlite_store, nothing.getvalue(), "study.sqlite3 alone; it has nothing")


def test_a_member_twice(sqlite_store: Store, good: bytes) -> None:
    file = BytesIO(good)
    with pytest.warns(UserWarning, match="Duplicate"), zipfile.ZipFile(file, "a") as archive:
        archive.writestr("study.sqlite3", b"{}")
    refused(sqlite_store, file.getvalue(), "it has study.sqlite3, study.sqlite3")


def test_another_compression_or_a_password(sqlite_store: Store, good: bytes) -> None:
    encrypted = bytearray(good)
    encrypted[good.rindex(b"PK\x01\x02") + 8] |= 1

    refused(sqlite_store, packed(database_of(good), compression=zipfile.ZIP_BZIP2), "compressed by another method")
    refused(sqlite_store, bytes(encrypted), "is encrypted")


def test_more_than_is_permitted_when_it_is_unpacked(
    sqlite_store: Store, good: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    size = len(database_of(good))
    monkeypatch.setattr(opening, "MOST_BYTES_OF_FILES", 0)
    for most, what in ((size - 1, f"more than {size - 1:,} bytes"), (5_000, "more than 5,000"), (0, "more than 0")):
        monkeypatch.setattr(opening, "MOST_BYTES", most)
        refused(sqlite_store, good, what, "export its experiments one by one")


def test_a_directory_that_lies(sqlite_store: Store, good: bytes) -> None:
    size = len(database_of(good)).to_bytes(4, "little")

    refused(sqlite_store, good.replace(size, (100).to_bytes(4, "little")), "not a readable zip")


def test_more_rows_than_are_permitted(sqlite_store: Store, good: bytes) -> None:
    tables = ("study", "experiment", "experiment_provenance", "provenance", "repetition", "step", "attempt")
    count = sum(rows(good, f"SELECT count(*) AS n FROM {each}")[0]["n"] for each in tables)

    with pytest.raises(InvalidArchive, match=rf"it has more than {count - 1} rows \(GAPLAB_MAX_IMPORTED_ROWS\)"):
        imported(sqlite_store, good, most_rows=count - 1)
    assert imported(sqlite_store, good, most_rows=count).experiments


def test_more_characters_than_are_permitted(sqlite_store: Store, good: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    long = changed(good, f"UPDATE repetition SET error = '{'x' * 10_000}'")
    monkeypatch.setattr(opening, "LONGEST_ROW", 10_000)
    refused(sqlite_store, long, "repetition, row 1 has more than 10,000 characters")
    monkeypatch.setattr(opening, "LONGEST_ROW", 20_000)
    monkeypatch.setattr(opening, "MOST_BYTES", 20_000)
    monkeypatch.setattr(opening, "MOST_BYTES_OF_FILES", 2**20)
    refused(sqlite_store, long, "its rows have more than 20,000 characters")


NOISE = bytes(range(256)) * 400

SCHEMAS: list[tuple[Any, str]] = [
    ("CREATE TRIGGER t AFTER INSERT ON step BEGIN DELETE FROM experiment; END", "more than tables and indices: 't'"),
    ("CREATE VIEW v AS SELECT * FROM step", "more than tables and indices: 'v'"),
    (("DROP TABLE step", "CREATE VIEW step AS SELECT * FROM attempt"), "more than tables and indices: 'step'"),
    ("CREATE VIRTUAL TABLE v USING fts5(x)", "more than tables and indices: 'v'"),
    (("DROP TABLE step", "CREATE VIRTUAL TABLE step USING fts5(body)"), "more than tables and indices: 'step'"),
    (("DROP TABLE step",), "no table step"),
    (("DROP TABLE alembic_version",), "does not say its revision"),
    ("ALTER TABLE step ADD COLUMN more", "its table step lacks columns, or has others: more"),
    ("ALTER TABLE step ADD COLUMN more AS (hex(zeroblob(900000000))) VIRTUAL", "others: more"),
    ("ALTER TABLE step DROP COLUMN measured_by", "others: measured_by"),
    (
        ("ALTER TABLE step DROP COLUMN measured_by", "ALTER TABLE step ADD COLUMN measured_by AS ('a') VIRTUAL"),
        "its table step lacks columns, or has others: measured_by, measured_by (computed)",
    ),
    ("UPDATE alembic_version SET version_num = '9999'", "at revision 9999; this version of gaplab reads up to"),
    ("UPDATE alembic_version SET version_num = 'x'", "at revision x;"),
    ("UPDATE alembic_version SET version_num = '0000'", "at revision 0000, which is unknown"),
    ("DELETE FROM alembic_version", "at revision none;"),
    ("INSERT INTO alembic_version VALUES ('1')", "this version of gaplab reads up to"),
    ("UPDATE alembic_version SET version_num = '0001'", "lacks columns, or has others"),
    ("UPDATE alembic_version SET version_num = '0004'", "lacks columns, or has others"),
]


def applied(archive: bytes, change: Any) -> bytes:
    return changed(archive, *([change] if isinstance(change, str) or callable(change) else change))


def test_a_schema_that_is_not_ours(sqlite_store: Store, good: bytes) -> None:
    all_refused(sqlite_store, [(applied(good, change), said) for change, said in SCHEMAS])


def many_tables(connection: sqlite3.Connection) -> None:
    for number in range(3_000):
        connection.execute(f"CREATE TABLE t{number} (x)")


def test_a_schema_that_would_fill_memory(sqlite_store: Store, good: bytes) -> None:
    columns = ", ".join(f"c{number} TEXT DEFAULT '{'x' * 100}'" for number in range(1_500))

    refused(sqlite_store, changed(good, many_tables), "interrupted")
    refused(sqlite_store, changed(good, f"CREATE TABLE wide ({columns})"), "malformed database schema")


def with_check(table: str, check: str) -> Callable[[sqlite3.Connection], object]:
    """Add a CHECK to the definition of a table."""

    def change(connection: sqlite3.Connection) -> None:
        connection.execute("PRAGMA writable_schema=ON")
        sql = "UPDATE sqlite_master SET sql = substr(sql, 1, length(sql) - 1) || ? WHERE name = ?"
        assert connection.execute(sql, (f", CHECK ({check}))", table)).rowcount == 1

    return change


def test_no_expression_of_its_schema_is_evaluated(sqlite_store: Store, good: bytes) -> None:
    """Each of these would take hours, or fail."""
    forever = "instr(zeroblob(19000000), zeroblob(9000000) || x'01') = 0"
    harmful = changed(
        good,
        "CREATE INDEX failing ON repetition (abs(-9223372036854775807 - (number IS NULL)))",
        "CREATE INDEX partial ON attempt (epoch) WHERE epoch > 1000",
        with_check("step", forever),
        with_check("attempt", forever),
    )

    stored = imported(sqlite_store, harmful)

    assert exported(export(sqlite_store, stored.experiments[0])) == good


def test_rows_twice_in_tables_without_keys(sqlite_store: Store, free: bytes) -> None:
    for table in ("study", "experiment", "repetition", "step", "attempt", "provenance", "experiment_provenance"):
        twice = changed(free, f"INSERT INTO {table} SELECT * FROM {table} LIMIT 1")
        refused(sqlite_store, twice, "its rows contradict each other: UNIQUE", table)


def test_rows_of_two_studies_or_of_none(sqlite_store: Store, free: bytes) -> None:
    def another(connection: sqlite3.Connection) -> None:
        names = [each for _, each, *_ in connection.execute("PRAGMA table_info(study)")]
        values = ", ".join("'another'" if each == "id" else each for each in names)
        connection.execute(f"INSERT INTO study SELECT {values} FROM study")

    moved = "UPDATE experiment SET study_id = 'another'"
    cases: list[tuple[bytes, str]] = [
        (changed(free, another), "it has 2 studies and 1 experiments, and not one study"),
        (changed(free, another, moved), "it has 2 studies"),
        (changed(free, moved), "belongs to a missing row"),
        (changed(free, "DELETE FROM study"), "belongs to a missing row"),
        (changed(free, "DELETE FROM experiment"), "belongs to a missing row"),
        (changed(free, *(f"DELETE FROM {each}" for each in EMPTIED)), "it has 1 studies and 0 experiments"),
    ]
    all_refused(sqlite_store, cases)


def test_an_id_that_would_mean_a_study_and_one_of_its_experiments(sqlite_store: Store, free: bytes) -> None:
    def another(connection: sqlite3.Connection) -> None:
        names = [each for _, each, *_ in connection.execute("PRAGMA table_info(experiment)")]
        values = ", ".join("'another'" if each == "id" else each for each in names)
        connection.execute(f"INSERT INTO experiment SELECT {values} FROM experiment")

    refused(sqlite_store, changed(free, another), "one of several experiments has the id")


EMPTIED = ("step", "attempt", "repetition", "experiment_provenance", "experiment")


def test_what_is_no_database(sqlite_store: Store, good: bytes) -> None:
    database = database_of(good)
    cases = [(b"", "does not say its revision"), (b"no database" * 999, "not a database"), (NOISE, "not a database")]
    unreadable = [database.replace(b"tablestepstep", b"tables\x80epstep", 1)]
    unreadable += [database[:most] for most in (100, 5_000, len(database) // 2)]
    cases += [(each, "its database cannot be read") for each in unreadable]

    all_refused(sqlite_store, [(packed(each), said) for each, said in cases])


def test_a_database_with_other_pages_encoding_or_journal_is_read(sqlite_store: Store, good: bytes) -> None:
    database = database_of(good)
    imported(sqlite_store, packed(database[:18] + b"\2\2" + database[20:]))  # of a write-ahead log, which is empty
    for pragma in ("page_size = 512", "page_size = 65536", "encoding = 'UTF-16le'"):
        with sqlite3.connect(":memory:") as other:
            other.execute(f"PRAGMA {pragma}")
            source = sqlite3.connect(":memory:")
            source.deserialize(database)
            other.executescript("\n".join(source.iterdump()))
            source.close()
            imported(sqlite_store, packed(other.serialize()))
        other.close()

    assert len(listed(sqlite_store)) == 4


def in_spec(**changes: Any) -> Any:
    return lambda spec: spec | changes


def in_reality(**changes: Any) -> Any:
    return lambda spec: spec | {"reality": spec["reality"] | changes}


BOUNDED = {"name": "static_friction", "lower": 0.0, "upper": 1.0}
PARTS = ("name", "iterations", "repetitions", "robot", "engine", "tunables", "tuner", "optimizer", "budget", "seed")


NESTED = json.loads("[" * 900 + "]" * 900)
DEEP = "experiment, row 1, /spec/strategy/options/x/0/0/0/0/0"
LONG = "bytes; 2,000,000 are permitted, twice GAPLAB_MAX_BODY_BYTES"


def without(part: Any) -> Any:
    return lambda spec: {name: value for name, value in spec.items() if name != part}


EXPERIMENTS: list[tuple[dict[str, Any], str]] = [
    ({"id": "../x"}, "belongs to a missing row"),
    ({"id": None}, "NOT NULL constraint failed: experiment.id"),
    ({"name": "x" * 201}, "at most 200 characters"),
    ({"name": "a\0b"}, "NUL"),
    ({"name": b"\xff\xfe"}, "experiment, row 1 has bytes where its column has another type"),
    ({"state": "ADMIN"}, "CHECK constraint failed"),
    ({"iterations": -1}, "must be at least 0"),
    ({"iterations": "some"}, "must be a whole number"),
    ({"iterations": 1.5}, "must be a whole number"),
    ({"iterations": 2**60}, "must be at most 1073741824"),
    ({"position": 2**31}, "must be at most"),
    ({"rollouts": 2**48 + 1}, "must be at most 281474976710656"),
    ({"iterations": 1}, "does not fit its experiment"),
    ({"iterations": 10**9}, "does not fit its experiment"),
    *(({"spec": without(each)}, f"not resolved; missing or invalid: {each}") for each in PARTS),
    ({"created_at": "yesterday"}, "experiment, row 1 has a value that its column does not permit"),
    ({"created_at": 2012}, "experiment, row 1 has a value that its column does not permit"),
    ({"created_at": "0001-01-01 00:00:00.000000"}, "created_at"),
    ({"turn_at": "never"}, "it has a value that its column does not permit"),
    ({"spec": []}, "spec must be an object"),
    ({"spec": "text"}, "spec must be an object"),
    ({"spec": in_spec(repetitions=1)}, "does not fit its experiment"),
    ({"spec": in_spec(repetitions=None)}, "not resolved"),
    ({"spec": in_spec(robot={"name": "/etc/passwd"})}, "not resolved"),
    ({"spec": in_spec(strategy={"name": "random"})}, "not resolved"),
    ({"spec": in_spec(tunables=[BOUNDED])}, "does not fit its experiment"),
    ({"spec": in_spec(tunables=[BOUNDED] * 2)}, "not resolved"),
    ({"spec": in_spec(tunables=[{"name": "static_friction"}])}, "invalid: tunables/0"),
    ({"spec": in_spec(tunables=[BOUNDED | {"lower": 1.0}])}, "invalid: tunables/0"),
    ({"spec": in_spec(budget={})}, "budget/controller_evaluations"),
    ({"spec": in_spec(budget="smoke")}, "budget/simulator_evaluations"),
    ({"spec": in_spec(reality={"parameters": {}})}, "reality/engine"),
    (
        {"spec": in_reality(parameters={"static_friction": "x"})},
        "invalid: reality/parameters/static_friction",
    ),
    (
        {"spec": in_reality(parameters={"x": None})},
        "not installed here: x",
    ),
    ({"spec": in_spec(reality=None)}, "not a spec"),
    ({"spec_version": 99}, "version 99"),
    ({"spec": in_spec(strategy={"name": "random", "options": {"x": NESTED}})}, DEEP),
    ({"spec": in_spec(strategy={"name": "simulated_fit", "options": {"x": "x" * 2_000_000}})}, LONG),
]


def with_row(archive: bytes, **changes: Any) -> bytes:
    """The experiment's row with other values; a callable makes JSON of the old."""

    def change(connection: sqlite3.Connection) -> None:
        for name, value in changes.items():
            stored = connection.execute(f"SELECT {name} FROM experiment").fetchone()[0]
            is_json = name == "spec"
            new = json.dumps(value(json.loads(stored)) if callable(value) else value) if is_json else value
            connection.execute(f"UPDATE experiment SET {name} = ?", (new,))

    return changed(archive, change)


def test_an_experiment_that_cannot_be(sqlite_store: Store, free: bytes) -> None:
    all_refused(sqlite_store, [(with_row(free, **changes), said) for changes, said in EXPERIMENTS])


def test_a_json_text_that_is_none_or_has_a_number_that_json_has_not(sqlite_store: Store, free: bytes) -> None:
    tokens = ("NaN", "Infinity", "-Infinity", "1e999", "[" * 3000, "9" * 5000, "'x'", '"\ud800"', "")
    spec = rows(free, "SELECT spec FROM experiment")[0]["spec"]
    specs = [spec.replace('"iterations": 2', f'"iterations": {each}') for each in tokens]
    assert spec not in specs

    def put(text: str) -> Callable[[sqlite3.Connection], object]:
        escaped = text.replace("\ud800", "\\ud800")
        return lambda connection: connection.execute("UPDATE experiment SET spec = ?", (escaped,))

    all_refused(sqlite_store, [(changed(free, put(each)), "") for each in (*specs, "{", "5", "null", "", "[1,2")])


RESULTS: list[tuple[str, str]] = [
    ("DELETE FROM step WHERE kind = 'measured' AND iteration = 1", "not a log of 13 steps"),
    ("UPDATE step SET fitness = 9e999 WHERE kind = 'measured'", "has a number, a text or bytes that JSON has not"),
    ("UPDATE step SET fitness = 'high'", "fitness: fitness must be a finite number"),
    ("UPDATE step SET kind = 'rumour'", "CHECK constraint failed"),
    ("UPDATE step SET iteration = 3 WHERE iteration = 2", "does not fit its experiment"),
    ("UPDATE step SET iteration = -1 WHERE iteration = 2", "must be at least 0"),
    ("UPDATE step SET place = place + 1", "not a log of 13 steps"),
    ("UPDATE step SET branch = 1 WHERE place > 4", "belongs to branch 1 of its repetition, which has no such branch"),
    ("UPDATE step SET repetition_id = 99 WHERE repetition_id = 1", "belongs to a missing row"),
    ("UPDATE step SET body = '{}'", "not a log of 13 steps"),
    ("UPDATE step SET body = '[]'", "body: body must be an object"),
    ("UPDATE step SET body = NULL", "NOT NULL constraint failed: step.body"),
    ("UPDATE step SET body = '5'", "body: body must be an object"),
    ("UPDATE step SET body = 'x'", "has a value that its column does not permit"),
    ("UPDATE step SET body = x'7b7d'", "has bytes"),
    ("UPDATE step SET body = '{\"genome\": [null]}'", "body/genome/0: item 0 of genome must be a finite number"),
    ("UPDATE step SET body = '{\"genome\": [1e999]}'", "JSON has not"),
    ("UPDATE step SET body = '{\"genome\": [NaN]}'", "JSON has not"),
    ("UPDATE step SET body = '{\"genome\": [true]}'", "must be a finite number"),
    ("UPDATE step SET body = '{\"surprise\": 1}'", "body/surprise"),
    ('UPDATE step SET body = \'{"simulators": [{"parameters": [0.5], "squared_error": 1}]}\'', "does not fit"),
    ('UPDATE step SET body = \'{"simulators": [{"parameters": [0.5, 0.5]}]}\'', "squared_error is missing"),
    ("UPDATE step SET body = replace(body, '}]', ', \"fit\": [1]}]') WHERE kind = 'tuned'", "not a log of 13 steps"),
    ("UPDATE step SET body = replace(body, '}]', ', \"lower\": [1]}]') WHERE kind = 'tuned'", "not a log of 13 steps"),
    ("UPDATE step SET body = replace(body, '}]', ', \"lower\": 1}]') WHERE kind = 'tuned'", "lower must be a list"),
    ("UPDATE step SET rollouts = -5", "rollouts must be at least 0"),
    ("UPDATE step SET rollouts = 'many'", "rollouts must be a whole number"),
    ("UPDATE step SET rollouts = 7 WHERE kind = 'measured'", "not a log of 13 steps"),
    ("UPDATE step SET recorded = 1.0 WHERE kind = 'tuned'", "not a log of 13 steps"),
    ("UPDATE step SET at = 'now'", "has a value that its column does not permit"),
    ("UPDATE step SET seconds = NULL", "NOT NULL constraint failed: step.seconds"),
    ("UPDATE repetition SET number = 2 WHERE number = 1", "does not fit its experiment"),
    ("UPDATE repetition SET number = -1 WHERE number = 1", "must be at least 0"),
    ("UPDATE repetition SET steps = 12 WHERE number = 0", "not a log of 12 steps"),
    ("UPDATE repetition SET error = 'x' || char(0)", "NUL"),
    ("UPDATE repetition SET epoch = 0", "more attempts than leases"),
    (f"UPDATE repetition SET epoch = {2**31 - 1}", "must be at most"),
    ("UPDATE repetition SET heartbeat_at = 'soon'", "it has a value that its column does not permit"),
    ("UPDATE repetition SET experiment_id = 'another'", "belongs to a missing row"),
    ("DELETE FROM repetition WHERE number = 1", "belongs to a missing row"),
    ("UPDATE attempt SET ending = 'victory'", "CHECK constraint failed"),
    ("UPDATE provenance SET facts = '{}'", "provenance, row 1, facts"),
    ("UPDATE provenance SET facts = replace(facts, 'python', 'pytho\u0306n')", "provenance, row 1, facts"),
    ("UPDATE provenance SET id = 'aaaa'", "belongs to a missing row"),
    ("UPDATE study SET tags = 'a  b'", "the tags of study"),
    ("UPDATE study SET edits = 1e300", "edits"),
    ("UPDATE study SET archived_at = 'x'", "it has a value that its column does not permit"),
]


def test_results_that_cannot_be(sqlite_store: Store, free: bytes) -> None:
    all_refused(sqlite_store, [(changed(free, change), said) for change, said in RESULTS])


def test_an_experiment_without_some_of_its_repetitions(sqlite_store: Store, free: bytes) -> None:
    def having(left: str) -> bytes:
        gone = f"(SELECT id FROM repetition WHERE number NOT IN ({left}))"
        tables = [f"DELETE FROM {each} WHERE repetition_id IN {gone}" for each in ("step", "attempt")]
        return changed(free, *tables, f"DELETE FROM repetition WHERE number NOT IN ({left})")

    cases = {"": 0, "0": 1, "1": 1}
    all_refused(sqlite_store, [(having(left), f"has {count} of its 2 repetitions") for left, count in cases.items()])


def test_nothing_of_it_runs_here_whatever_its_states_say(sqlite_store: Store, free: bytes) -> None:
    states = ["UPDATE repetition SET state = 'QUEUED'", "UPDATE repetition SET state = 'RUNNING', ended_at = NULL"]
    states += ["UPDATE experiment SET state = 'RUNNING'", "UPDATE attempt SET ended_at = NULL, ending = NULL"]

    for state in states:
        (id_,) = imported(sqlite_store, changed(free, state)).experiments

        assert execution.claim(sqlite_store, "me", 9) == ()
        assert execution.requeue_lost(sqlite_store, stale_after_s=-1) == 0
        assert read_experiment(sqlite_store, id_).state.ended


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.data())
def test_whichever_bytes_are_damaged(sqlite_store: Store, good: bytes, data: Any) -> None:
    of_zip = data.draw(st.booleans())
    archive = bytearray(good if of_zip else database_of(good))
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(
            st.integers(0, len(archive) - 1) | st.integers(0, 200) | st.integers(len(archive) - 900, len(archive) - 1)
        )
        archive[place] = data.draw(st.integers(0, 255))
    try:
        imported(sqlite_store, archive if of_zip else packed(bytes(archive)))
    except InvalidArchive:
        return
    stored = listed(sqlite_store)
    assert all(each.progress.completed <= 2 for each in stored)  # what was damaged means nothing, like a date


def test_too_many_at_once_are_asked_to_wait(sqlite_store: Store, good: bytes) -> None:
    taken = [reading._SLOTS.acquire(blocking=False) for _ in range(reading.AT_ONCE)]
    try:
        with pytest.raises(Conflict, match="try again"):
            import_archive(sqlite_store, BytesIO(good))
    finally:
        for _ in taken:
            reading._SLOTS.release()

    assert all(taken)
    assert imported(sqlite_store, good).experiments


def test_over_http_it_is_a_problem(sqlite_store: Store, good: bytes) -> None:
    api = TestClient(create_app(sqlite_store))

    answer = api.post("/import", content=packed(database_of(good), {"../x": b""}))

    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"] == "urn:gaplab:problem:invalid-archive"
    assert "../x" in answer.json()["detail"]


def test_an_archive_may_be_larger_than_a_spec_but_not_as_large_as_it_likes(
    sqlite_store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    api = TestClient(create_app(sqlite_store))
    monkeypatch.setitem(limits.MOST_BYTES_OF, "/import", 2_000_000)

    assert api.post("/experiments", content=bytes(1_500_000)).status_code == 413
    assert api.post("/import", content=bytes(1_500_000)).status_code == 422
    assert api.post("/import", content=bytes(2_000_001)).status_code == 413
    assert api.post("/import", content=iter([bytes(1_500_000)] * 2)).status_code == 413
