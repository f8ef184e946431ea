"""The fault of hostile imports: archives of the service's own, changed to harm it. Each is refused, and lists go on."""

import json
import zipfile
from collections.abc import Callable, Iterator, Mapping
from io import BytesIO
from typing import Any
from urllib.parse import quote

import httpx2

from tests.integration.test_archives_bad import packed
from tests.soak.bench_faults import WAIT_S
from tests.soak.stage import until

LISTS = ("/requests?limit=500&pending=false", "/experiments?limit=500", "/studies?limit=500")

Members = Mapping[str, bytes]


def _with(**values: Any) -> Callable[[Any], Any]:
    """An object with other values; a callable makes one of the old."""
    return lambda old: old | {name: value(old[name]) if callable(value) else value for name, value in values.items()}


def _in_row(table: str, **values: Any) -> Callable[[Members], bytes]:
    """The archive with other values in the first row of a table."""

    def changed(members: Members) -> bytes:
        first, *others = members[f"{table}.jsonl"].splitlines()
        row = json.dumps(_with(**values)(json.loads(first))).encode()
        return bytes(packed({**members, f"{table}.jsonl": b"\n".join([row, *others, b""])}))

    return changed


def _in_spec(**values: Any) -> Callable[[Members], bytes]:
    return _in_row("experiment", spec=_with(**values))


HOSTILE: dict[str, Callable[[Members], bytes]] = {
    "a forecast that is a list": _in_row("request", safety=[1, 2]),
    "traces of nothing": _in_row("answer", traces=[{"x": 1}]),
    "a genome of one gene": _in_row("request", genome=[0.5]),
    "genes of 500": _in_row("request", genome=lambda genome: [500.0] * len(genome)),
    "a budget of ten million": _in_spec(budget=_with(simulator_evaluations=10**7)),
    "an extreme priority": _in_spec(priority=-(2**30)),
    "options of 7 MB": _in_spec(strategy={"name": "random", "options": {"x": "y" * 7_000_000}}),
    "nested 900 deep": _in_spec(strategy={"name": "random", "options": {"x": json.loads("[" * 900 + "]" * 900)}}),
    "a file elsewhere": lambda members: bytes(packed({**members, "../../x": b"x"})),
    "no Parquet": lambda members: bytes(packed({**members, "measurement.parquet": b"PAR1" * 100})),
    "half a file": lambda members: bytes(packed(members)[:5000]),
    "another sum": lambda members: bytes(packed({**members, "answer.jsonl": b"{}\n"}, honest=False)),
}
"""What is done to an archive whose experiment has requests and answers."""


def hostile(stage: Any) -> bool:
    """Export an experiment with an answer, import it in each harmful form, and read the lists."""
    found = list[Members]()
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
        archive = stage.http.get(f"/experiments/{experiment}/export").content
        with zipfile.ZipFile(BytesIO(archive)) as opened:
            members = {name: opened.read(name) for name in opened.namelist()}
        return [members] if members["answer.jsonl"] else []
    except (httpx2.HTTPError, ValueError, KeyError, zipfile.BadZipFile):
        return []


def broken_lists(http: Any) -> Iterator[str]:
    """Pages of lists that do not answer, whatever was imported."""
    for path in LISTS:
        following = ""
        while following is not None:
            answer = http.get(f"{path}{following}")
            if answer.status_code != 200:
                yield f"GET {path}: {answer.status_code} {answer.text:.300}"
            cursor = answer.json().get("next")
            following = f"&cursor={quote(cursor)}" if cursor else None
