"""The fault of hostile imports: archives of the service's own, changed to harm it. Each is refused, and lists go on."""

import json
import sqlite3
import zipfile
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import quote

import httpx2

from tests.archiving import changed, database_of, loose, packed, rows
from tests.soak.bench_faults import WAIT_S
from tests.soak.stage import until

LISTS = ("/requests?limit=500&pending=false", "/studies?limit=500")

DEEP = json.loads("[" * 900 + "]" * 900)


def _put(table: str, column: str, value: Any) -> Callable[[bytes], bytes]:
    """The archive with another value in all rows of a table; a callable changes the JSON that is there."""

    def change(connection: sqlite3.Connection) -> None:
        (stored,) = connection.execute(f"SELECT {column} FROM {table}").fetchone()
        new = json.dumps(value(json.loads(stored)) if callable(value) else value)
        connection.execute(f"UPDATE {table} SET {column} = ?", (new,))

    return lambda archive: changed(loose(archive), change)


HOSTILE: dict[str, Callable[[bytes], bytes]] = {
    "a forecast that is a list": _put("request", "safety", [1, 2]),
    "traces of nothing": _put("answer", "traces", [{"x": 1}]),
    "a genome of three genes": _put("request", "genome", [0.5, 0.5, 0.5]),
    "genes of 500": _put("request", "genome", lambda genome: [500.0] * len(genome)),
    "a robot of the machine": _put("experiment", "spec", lambda spec: spec | {"robot": {"name": "/etc/passwd"}}),
    "an extreme priority": _put("experiment", "precedence", -(2**30)),
    "options of 7 MB": _put("experiment", "spec", lambda spec: _with_options(spec, "y" * 7_000_000)),
    "nested 900 deep": _put("experiment", "spec", lambda spec: _with_options(spec, DEEP)),
    "a state that none has": _put("experiment", "turn_at", "never"),
    "a trigger": lambda archive: changed(archive, "CREATE TRIGGER t AFTER INSERT ON step BEGIN SELECT 1; END"),
    "rows twice": lambda archive: changed(loose(archive), "INSERT INTO step SELECT * FROM step"),
    "a file elsewhere": lambda archive: packed(database_of(archive), {"../../x": b"x"}),
    "no database": lambda _: packed(b"SQLite format 3\0" * 999),
    "half a database": lambda archive: packed(database_of(archive)[:50_000]),
    "half a file": lambda archive: archive[:5_000],
}


def _with_options(spec: Any, value: Any) -> Any:
    return spec | {"strategy": spec["strategy"] | {"options": {"x": value}}}


def hostile(stage: Any) -> bool:
    """Export an experiment with an answer, import it in each harmful form, and read the lists."""
    found = list[Any]()
    if not until(lambda: found.extend(_exported(stage)) or found, WAIT_S):  # type: ignore[func-returns-value]
        return False
    for kind, harm in HOSTILE.items():
        stage.history.ask(stage.http, "nonsense", "POST", "/import", {"archive": kind}, content=harm(found[0]))
    for path in LISTS:
        stage.history.ask(stage.http, "read", "GET", path)
    return True


def _exported(stage: Any) -> list[bytes]:
    """The archive of an experiment with an answer; none, if there is none, or nobody answers."""
    try:
        requests = stage.http.get(LISTS[0]).json()["items"]
        (experiment, *_) = [each["experiment"] for each in requests if each["answers"]]
        archive = stage.http.get(f"/studies/{experiment}/export").content
        return [archive] if rows(archive, "SELECT id FROM answer") else []
    except (httpx2.HTTPError, ValueError, KeyError, zipfile.BadZipFile):
        return []


def broken_lists(http: Any) -> Iterator[str]:
    """Pages of lists that do not answer, whatever was imported."""
    for path in LISTS:
        following = path
        while following:
            answer = http.get(following, headers={"Connection": "close"})  # the service ends it after a failure
            if answer.status_code != 200:
                yield f"GET {path}: {answer.status_code} {answer.text:.300}"
            cursor = answer.json().get("next")
            following = f"{path}&cursor={quote(cursor)}" if cursor else ""
