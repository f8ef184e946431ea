"""The fault of hostile imports: archives of the service's own, changed to harm it. Each is refused, and lists go on."""

import json
import zipfile
from collections.abc import Callable, Iterator
from io import BytesIO
from typing import Any
from urllib.parse import quote

import httpx2

from tests.integration.test_archives_bad import packed
from tests.soak.bench_faults import WAIT_S
from tests.soak.stage import until

LISTS = ("/requests?limit=500&pending=false", "/studies?limit=500")

DEEP = json.loads("[" * 900 + "]" * 900)


def _in(table: str, change: Callable[[Any], Any]) -> Callable[[Any], bytes]:
    """The archive with a change of the first row of a table."""

    def changed(members: Any) -> bytes:
        first, *others = members[f"{table}.jsonl"].splitlines()
        row = json.loads(first)
        change(row)
        return bytes(packed({**members, f"{table}.jsonl": b"\n".join([json.dumps(row).encode(), *others, b""])}))

    return changed


HOSTILE: dict[str, Callable[[Any], bytes]] = {
    "a forecast that is a list": _in("request", lambda row: row.update(safety=[1, 2])),
    "traces of nothing": _in("answer", lambda row: row.update(traces=[{"x": 1}])),
    "a genome of three genes": _in("request", lambda row: row.update(genome=[0.5, 0.5, 0.5])),
    "genes of 500": _in("request", lambda row: row.update(genome=[500.0] * len(row["genome"]))),
    "a robot of the machine": _in("experiment", lambda row: row["spec"].update(robot={"name": "/etc/passwd"})),
    "an extreme priority": _in("experiment", lambda row: row["spec"].update(priority=-(2**30))),
    "options of 7 MB": _in("experiment", lambda row: row["spec"]["strategy"].update(options={"x": "y" * 7_000_000})),
    "nested 900 deep": _in("experiment", lambda row: row["spec"]["strategy"].update(options={"x": DEEP})),
    "a file elsewhere": lambda members: bytes(packed({**members, "../../x": b"x"})),
    "no Parquet": lambda members: bytes(packed({**members, "measurement.parquet": b"PAR1" * 100})),
    "half a file": lambda members: bytes(packed(members)[:5000]),
    "another sum": lambda members: bytes(packed({**members, "answer.jsonl": b"{}\n"}, honest=False)),
}


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


def _exported(stage: Any) -> Any:
    """The members of the archive of an experiment with an answer; nothing, if there is none, or nobody answers."""
    try:
        requests = stage.http.get(LISTS[0]).json()["items"]
        (experiment, *_) = [each["experiment"] for each in requests if each["answers"]]
        archive = stage.http.get(f"/studies/{experiment}/export").content
        with zipfile.ZipFile(BytesIO(archive)) as opened:
            members = {name: opened.read(name) for name in opened.namelist()}
        return [members] if members["answer.jsonl"] else []
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
