"""Archives that were damaged, or made to harm: each is refused in one sentence, and nothing of it is stored.

Parquet is read in the process of the tests, but where its own process is what is tested.
"""

import json
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterable
from functools import partial
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import pyarrow as arrow
import pyarrow.parquet
import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gaplab.api.app import create_app
from gaplab.api.http import limits
from gaplab.services.archives import export, import_archive, reading, unpacking
from gaplab.services.archives.opening import convert_apart
from gaplab.services.core.errors import Conflict, InvalidArchive
from gaplab.services.experiments import listing
from gaplab.services.experiments.reading import read_experiment
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.archiving import convert_here, imported
from tests.experiments import listed, run, submit_one, toy


@pytest.fixture(scope="module")
def good(sqlite_template: Path, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The members of an archive with which nothing is wrong."""
    file = tmp_path_factory.mktemp("good") / "good.db"
    shutil.copy(sqlite_template, file)
    store = Store(f"sqlite:///{file}")
    submitted = submit_one(store, toy(repetitions=2)).id
    for claim in execution.claim(store, "me", 2):
        run(store, claim)
    with export(store, submitted).file as archive, zipfile.ZipFile(archive) as opened:
        members = {name: opened.read(name) for name in opened.namelist()}
    store.dispose()
    return members


def packed(members: Any, *, honest: Any = True, compression: Any = zipfile.ZIP_DEFLATED) -> Any:
    """A zip of the members, whose manifest tells the truth of them unless it is not to."""
    members = dict(members)
    if honest:
        manifest = json.loads(members["manifest.json"])
        for name, content in members.items():
            if name in manifest["members"]:
                manifest["members"][name] |= {"sha256": sha256(content).hexdigest(), "bytes": len(content)}
                manifest["members"][name]["rows"] = rows_of(name, content)
        members["manifest.json"] = json.dumps(manifest).encode()
    file = BytesIO()
    with zipfile.ZipFile(file, "w", compression) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return file.getvalue()


def rows_of(name: Any, content: Any) -> Any:
    if name.endswith(".parquet"):
        try:
            return pyarrow.parquet.read_metadata(BytesIO(content)).num_rows
        except arrow.ArrowInvalid:
            return 0
    return content.count(b"\n")


def refused(store: Store, archive: bytes, *what: str, by: Any = convert_here) -> None:
    assert all_refused(store, [(archive, what)], by=by)


def all_refused(store: Store, cases: Iterable[tuple[bytes, str | tuple[str, ...]]], by: Any = convert_here) -> bool:
    """Each archive is refused with these words, and nothing is stored of any."""
    wrong = []
    for archive, words in cases:
        try:
            import_archive(store, BytesIO(archive), convert=by)
            wrong.append((words, "it is stored"))
        except InvalidArchive as error:
            if not all(each in str(error) for each in ([words] if isinstance(words, str) else words)):
                wrong.append((words, str(error)))
    assert wrong == []
    assert listed(store) == []
    assert listing.list_studies(store).items == ()
    return True


def with_row(good: Any, **changes: Any) -> Any:
    """The experiment's row with other values; a callable makes one of the old."""
    row = json.loads(good["experiment.jsonl"])
    for name, value in changes.items():
        row[name] = value(row[name]) if callable(value) else value
    return good | {"experiment.jsonl": json.dumps(row).encode() + b"\n"}


def with_table(good: Any, table: Any, change: Any) -> Any:
    """A table with its rows changed."""
    rows = pyarrow.parquet.read_table(BytesIO(good[f"{table}.parquet"]))
    changed = arrow.Table.from_pylist(change(rows.to_pylist()), rows.schema)
    file = BytesIO()
    pyarrow.parquet.write_table(changed, file)
    return good | {f"{table}.parquet": file.getvalue()}


def set_in(rows: Any, place: Any, **values: Any) -> Any:
    rows[place] |= values
    return rows


def test_the_good_one_is_good(sqlite_store: Store, good: Any) -> None:
    stored = import_archive(sqlite_store, BytesIO(packed(good)))

    assert read_experiment(sqlite_store, stored.experiments[0]).progress.completed == 2


def test_what_is_no_zip(sqlite_store: Store) -> None:
    archives = (b"", b"no zip", b"PK\x03\x04" + bytes(100), b"PK\x05\x06" + b"\xff" * 18)

    all_refused(sqlite_store, [(each, "zip") for each in archives])


def test_a_member_with_another_name(sqlite_store: Store, good: Any) -> None:
    names = ("../../../etc/passwd", "/etc/passwd", "C:\\x", "event.parquet", "a/experiment.jsonl")

    all_refused(sqlite_store, [(packed(good | {each: b"x"}), ("unknown member", "permitted: ")) for each in names])


def test_a_member_twice(sqlite_store: Store, good: Any) -> None:
    file = BytesIO(packed(good))
    with pytest.warns(UserWarning, match="Duplicate"), zipfile.ZipFile(file, "a") as archive:
        archive.writestr("experiment.jsonl", b"{}")
    refused(sqlite_store, file.getvalue(), "it has experiment.jsonl twice")


def test_another_compression(sqlite_store: Store, good: Any) -> None:
    refused(sqlite_store, packed(good, compression=zipfile.ZIP_BZIP2), "compressed by another method")


def stating(good: Any, size: int) -> bytes:
    """An archive whose directory states another size of a member of 2,000,000 bytes."""
    archive = packed(good | {"curves.json": bytes(2_000_000)})
    return archive.replace((2_000_000).to_bytes(4, "little"), size.to_bytes(4, "little"))


def test_more_than_is_permitted_when_it_is_unpacked(sqlite_store: Store, good: Any) -> None:
    refused(sqlite_store, stating(good, 2**29), "unpacked it has 536,8", "536,870,912 are permitted")


def test_more_rows_than_are_permitted(sqlite_store: Store, good: Any) -> None:
    archive = packed(good)
    rows = sum(each["rows"] for name, each in members_of(good).items() if name != "curves.json")

    with pytest.raises(
        InvalidArchive, match=rf"it has {rows} rows; {rows - 1} are permitted \(GAPLAB_MAX_IMPORTED_ROWS\)"
    ):
        imported(sqlite_store, archive, most_rows=rows - 1)
    assert imported(sqlite_store, archive, most_rows=rows).experiments


def test_more_rows_than_the_manifest_states(sqlite_store: Store, good: Any) -> None:
    def lying(name: str) -> bytes:
        manifest = json.loads(good["manifest.json"])
        manifest["members"][name]["rows"] -= 1
        return packed(good | {"manifest.json": json.dumps(manifest).encode()}, honest=False)

    refused(sqlite_store, lying("experiment.jsonl"), "experiment", "manifest states")
    refused(sqlite_store, lying("simulator.parquet"), "simulator", "manifest states", by=convert_apart)


def members_of(good: Any) -> Any:
    return json.loads(good["manifest.json"])["members"]


def test_more_than_its_directory_says(sqlite_store: Store, good: Any) -> None:
    refused(sqlite_store, stating(good, 100))


def test_a_member_that_was_changed_or_is_missing(sqlite_store: Store, good: Any) -> None:
    changed = ("experiment.jsonl", "measurement.parquet", "curves.json")
    missing = ("manifest.json", "simulator.parquet", "experiment.jsonl")

    all_refused(
        sqlite_store,
        [(packed(good | {each: good[each] + b" "}, honest=False), (each, "damaged or changed")) for each in changed]
        + [(packed({name: good[name] for name in good if name != each}, honest=False), each) for each in missing],
    )


MANIFESTS: list[tuple[dict[str, Any], str]] = [
    ({"format": 2}, "its format is 2"),
    ({"format": "1"}, "format"),
    ({"format": float("nan")}, "format"),
    ({"kind": "study"}, "kind"),
    ({"id": "another"}, "other studies or experiments than the study"),
    ({"id": "another"}, "another"),
    ({"members": {}}, "but not in both"),
    ({"surprise": 1}, "surprise"),
]


def test_a_member_that_the_manifest_lacks_too(sqlite_store: Store, good: Any) -> None:
    manifest = json.loads(good["manifest.json"])
    cases = []
    for name in ("robot.parquet", "spec.json"):
        members = {each: about for each, about in manifest["members"].items() if each != name}
        left = {each: content for each, content in good.items() if each != name}
        described = json.dumps(manifest | {"members": members}).encode()
        cases.append((packed(left | {"manifest.json": described}), f"it has no {name}"))

    all_refused(sqlite_store, cases)


def test_a_manifest_that_is_none(sqlite_store: Store, good: Any) -> None:
    cases: list[tuple[bytes, str]] = [
        (json.dumps(json.loads(good["manifest.json"]) | change).encode(), said) for change, said in MANIFESTS
    ]
    no_json = (b"", b"[]", b"{" * 50_000, b"[" * 90_000, b"\xff", b" " * 200_000)
    cases += [(manifest, "manifest.json") for manifest in no_json]

    all_refused(
        sqlite_store, [(packed(good | {"manifest.json": manifest}, honest=False), said) for manifest, said in cases]
    )


def test_an_id_that_would_mean_a_study_and_one_of_its_experiments(sqlite_store: Store, good: Any) -> None:
    row = json.loads(good["experiment.jsonl"])
    both = b"".join(json.dumps(row | {"id": id_}).encode() + b"\n" for id_ in (row["id"], "other"))

    refused(sqlite_store, packed(good | {"experiment.jsonl": both}), "an experiment among others has the id")


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
    ({"id": "../x"}, "id: id must match"),
    ({"id": None}, "id: id must be text"),
    ({"id": "x" * 33}, "at most 32 characters"),
    ({"name": "x" * 201}, "at most 200 characters"),
    ({"name": "a\0b"}, "NUL"),
    ({"name": "\ud800"}, "a text that cannot be stored"),
    ({"name": 5}, "name: name must be text"),
    ({"state": "ADMIN"}, "state: state must be one of QUEUED"),
    ({"iterations": -1}, "must be at least 0"),
    ({"iterations": True}, "must be a whole number"),
    ({"iterations": 1.5}, "must be a whole number"),
    ({"iterations": 10**30}, "must be at most 1073741824"),
    ({"position": 2**31}, "must be at most"),
    ({"rollouts": 2**48 + 1}, "must be at most 281474976710656"),
    ({"iterations": 1}, "does not fit its experiment"),
    ({"iterations": 10**9}, "does not fit its experiment"),
    ({"edits": 1}, "columns that this version of gaplab does not know: edits"),
    *(({"spec": without(each)}, f"not resolved; missing or invalid: {each}") for each in PARTS),
    ({"created_at": "yesterday"}, "created_at"),
    ({"created_at": "2012-11-05T09:00:00"}, "timezone info"),
    ({"created_at": "0001-01-01T00:00:00+14:00"}, "created_at"),
    ({"study_id": "a1"}, "other studies or experiments"),
    ({"spec": []}, "not a spec"),
    ({"spec": "text"}, "spec/dict[str,any]: dict[str,any] must be an object"),
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


def test_an_experiment_that_cannot_be(sqlite_store: Store, good: Any) -> None:
    all_refused(sqlite_store, [(packed(with_row(good, **changes)), said) for changes, said in EXPERIMENTS])


def test_a_number_or_a_value_that_json_has_not(sqlite_store: Store, good: Any) -> None:
    tokens = (b"NaN", b"Infinity", b"-Infinity", b"1e999", b"[" * 3000, b"9" * 5000, b"'x'")
    rows = [good["experiment.jsonl"].replace(b'"iterations": 3', b'"iterations": ' + each) for each in tokens]
    assert good["experiment.jsonl"] not in rows

    all_refused(sqlite_store, [(packed(good | {"experiment.jsonl": each}), "experiment, row 1") for each in rows])


def test_rows_that_are_none(sqlite_store: Store, good: Any) -> None:
    cases = [
        (b"{}\n", "id: id is missing"),
        (b"5\n", "not a JSON object"),
        (b"\xff\n", "not JSON"),
        (b'{"id": "a", "password": 1}\n', "does not know: password"),
        (b"", "other studies or experiments"),
    ]

    all_refused(sqlite_store, [(packed(good | {"experiment.jsonl": content}), said) for content, said in cases])


def test_a_row_without_an_end(sqlite_store: Store, good: Any) -> None:
    endless = b" " * 9_000_000

    refused(sqlite_store, packed(good | {"experiment.jsonl": endless}), "more than 8,388,608 characters")


RESULTS: list[tuple[str, Any, str]] = [
    ("measurement", lambda rows: [*rows, rows[0]], "occurs twice"),
    ("measurement", lambda rows: rows[1:], "not a log of 13 steps"),
    ("measurement", lambda rows: set_in(rows, 0, fitness=float("nan")), "measurement.parquet"),
    ("measurement", lambda rows: set_in(rows, 0, fitness=float("inf")), "measurement.parquet"),
    ("measurement", lambda rows: set_in(rows, 0, kind="rumour"), "kind must be one of sample, probe"),
    ("measurement", lambda rows: set_in(rows, 0, genome=None), "genome: genome must be a list"),
    (
        "measurement",
        lambda rows: set_in(rows, 0, genome=[None]),
        "genome/0: item 0 of genome must be a finite number",
    ),
    ("measurement", lambda rows: set_in(rows, 0, experiment="another"), "does not fit"),
    ("measurement", lambda rows: set_in(rows, 0, repetition=2), "does not fit"),
    ("measurement", lambda rows: set_in(rows, 0, repetition=-1), "must be at least 0"),
    ("simulator", lambda rows: set_in(rows, 0, parameters=[0.5]), "does not fit"),
    ("iteration", lambda rows: rows[:-1], "contradict"),
    ("iteration", lambda rows: set_in(rows, 0, number=3), "does not fit"),
    ("repetition", lambda rows: rows[:1], "contradict"),
    ("repetition", lambda rows: set_in(rows, 0, steps=12), "not a log of 12 steps"),
    ("repetition", lambda rows: set_in(rows, 0, error="x\0"), "NUL"),
    ("repetition", lambda rows: set_in(rows, 0, iterations_done=0), "not a log"),
    ("repetition", lambda rows: set_in(rows, 0, epoch=0), "more attempts than leases"),
    ("repetition", lambda rows: set_in(rows, 0, epoch=2**31 - 1), "must be at most"),
    ("repetition", lambda rows: [*rows, set_in(rows[:1], 0, number=0)[0]], "contradict"),
]


def test_results_that_cannot_be(sqlite_store: Store, good: Any) -> None:
    all_refused(sqlite_store, [(packed(with_table(good, table, change)), said) for table, change, said in RESULTS])


def test_an_experiment_without_some_of_its_repetitions(sqlite_store: Store, good: Any) -> None:
    def having(left: list[int]) -> bytes:
        members = with_table(good, "repetition", lambda rows: [rows[each] for each in left])
        for table in ("iteration", "measurement", "simulator", "attempt"):
            members = with_table(members, table, lambda rows: [each for each in rows if each["repetition"] in left])
        return packed(members)

    cases: list[list[int]] = [[], [0], [1]]
    all_refused(sqlite_store, [(having(left), f"has {len(left)} of its 2 repetitions") for left in cases])


def test_what_is_no_parquet(sqlite_store: Store, good: Any) -> None:
    said = "simulator.parquet is not readable"
    archives = [packed(good | {"simulator.parquet": content}) for content in (b"", b"PAR1", b"PAR1" * 100, bytes(1000))]

    all_refused(sqlite_store, [(each, said) for each in archives])
    refused(sqlite_store, archives[1], f"{said} Parquet", by=convert_apart)


def test_a_reader_of_parquet_that_is_killed(sqlite_store: Store, good: Any, tmp_path: Path) -> None:
    suicide = tmp_path / "suicide.py"
    suicide.write_text("import os; os.kill(os.getpid(), 9)")

    by = partial(convert_apart, program=suicide)

    refused(sqlite_store, packed(good), "a member is not readable Parquet", by=by)


WITH_ROOM_FOR = """
import resource, sys
sys.path.append(sys.argv[1])
import unpacking
unpacking.MOST[resource.RLIMIT_FSIZE] = int(sys.argv[2])
sys.exit(unpacking.main(sys.argv[3:]))
"""


@pytest.mark.parametrize(("room", "ended"), [(2, 3), (3, 0)])
def test_what_is_written_of_all_tables_together_is_limited(good: Any, tmp_path: Path, room: Any, ended: Any) -> None:
    table, paths = tmp_path / "simulator.parquet", [str(tmp_path / name) for name in ("first", "second", "third")]
    table.write_bytes(good["simulator.parquet"])
    rows = rows_of("simulator.parquet", good["simulator.parquet"])
    assert unpacking.convert(str(table), str(tmp_path / "alone"), rows)
    size = (tmp_path / "alone").stat().st_size

    folder = str(Path(unpacking.__file__).parent)
    tables = [path for target in paths for path in (str(table), target, str(rows))]
    command = [sys.executable, "-I", "-c", WITH_ROOM_FOR, folder, str(room * size), *tables]

    assert subprocess.run(command, check=False).returncode == ended


def test_a_small_file_of_parquet_that_becomes_a_large_row(sqlite_store: Store, good: Any) -> None:
    bomb = with_table(good, "measurement", lambda rows: set_in(rows, 0, genome=[0.5] * 2_500_000))
    assert len(bomb["measurement.parquet"]) < 100_000

    refused(sqlite_store, packed(bomb), "measurement", "more than 8,388,608 characters")


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_whichever_bytes_are_damaged(sqlite_store: Store, good: Any, data: Any) -> None:
    archive = bytearray(packed(good))
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(archive) - 1) | st.integers(len(archive) - 900, len(archive) - 1))
        archive[place] = data.draw(st.integers(0, 255))
    try:
        imported(sqlite_store, archive)
    except InvalidArchive:
        return
    stored = listed(sqlite_store)
    assert all(each.progress.completed == 2 for each in stored)  # what was damaged means nothing, like a date


def test_too_many_at_once_are_asked_to_wait(sqlite_store: Store, good: Any) -> None:
    taken = [reading._SLOTS.acquire(blocking=False) for _ in range(reading.AT_ONCE)]
    try:
        with pytest.raises(Conflict, match="try again"):
            import_archive(sqlite_store, BytesIO(packed(good)))
    finally:
        for _ in taken:
            reading._SLOTS.release()

    assert all(taken)
    assert imported(sqlite_store, packed(good)).experiments


def test_over_http_it_is_a_problem(sqlite_store: Store, good: Any) -> None:
    api = TestClient(create_app(sqlite_store))

    answer = api.post("/import", content=packed(good | {"../x": b""}))

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
