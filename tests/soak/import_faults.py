"""The fault of hostile imports: archives of the service's own, changed to harm it. Each is refused, and lists go on."""

import json
import zipfile
from collections.abc import Callable, Iterator, Mapping
from io import BytesIO
from typing import Any

import httpx2

from tests.integration.test_archives_bad import packed, set_in, with_table
from tests.soak.stage import until

LISTS = ("/requests", "/experiments", "/studies")

ALL = {"pending": "false", "limit": 500}
"""Of each list: its longest page, of all requests and not only of those that wait."""

WAIT_S = 60.0
"""For how long the fault waits for an experiment with an answer."""

Members = Mapping[str, bytes]


def _in_row(table: str, **values: Any) -> Callable[[Members], bytes]:
    """The first row of a table with other values; a callable makes one of the old."""

    def changed(members: Members) -> bytes:
        first, *others = members[f"{table}.jsonl"].splitlines()
        row = json.loads(first)
        row |= {name: value(row[name]) if callable(value) else value for name, value in values.items()}
        return bytes(packed({**members, f"{table}.jsonl": b"\n".join([json.dumps(row).encode(), *others, b""])}))

    return changed


def _in_spec(**values: Any) -> Callable[[Members], bytes]:
    return _in_row("experiment", spec=lambda spec: spec | values)


def _nested(depth: int) -> Any:
    return json.loads("[" * depth + "]" * depth)


def _damaged(members: Members) -> bytes:
    archive = bytes(packed(members))
    return archive[: len(archive) // 2]


HOSTILE: dict[str, Callable[[Members], bytes]] = {
    "a forecast that is a list": _in_row("request", safety=[1, 2]),
    "traces of nothing": _in_row("answer", traces=[{"x": 1}]),
    "a genome of one gene": _in_row("request", genome=[0.5]),
    "genes of 500": _in_row("request", genome=lambda genome: [500.0] * len(genome)),
    "a request for no controller": _in_row("request", genome=None),
    "a budget of ten million": _in_spec(
        budget={
            "controller_evaluations": 10**7,
            "selection_evaluations": 10**7,
            "simulator_evaluations": 10**7,
        }
    ),
    "an extreme priority": _in_row("experiment", priority=-(2**30)),
    "options of 7 MB": _in_spec(strategy={"name": "random", "options": {"x": "y" * 7_000_000}}),
    "nested 900 deep": _in_spec(strategy={"name": "random", "options": {"x": _nested(900)}}),
    "a robot of the machine": _in_spec(robot={"name": "/etc/passwd", "options": {}}),
    "a file elsewhere": lambda members: bytes(packed({**members, "../../x": b"x"})),
    "half a file": _damaged,
    "no Parquet": lambda members: bytes(packed({**members, "measurement.parquet": b"PAR1" * 100})),
    "an infinite fitness": lambda members: bytes(
        packed(with_table(members, "measurement", lambda rows: set_in(rows, 0, fitness=float("inf"))))
    ),
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
        stage.history.ask(stage.http, "read", "GET", path, params=ALL)
    return True


def _exported(stage: Any) -> Any:
    """The members of the archive of an experiment with an answer; nothing, if there is none, or nobody answers."""
    try:
        requests = stage.http.get("/requests", params=ALL).json()["items"]
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
        query: dict[str, Any] | None = dict(ALL)
        while query:
            answer = http.get(path, params=query)
            if answer.status_code != 200:
                yield f"GET {path}: {answer.status_code} {answer.text:.300}"
            following = answer.json().get("next")
            query = ALL | {"cursor": following} if following else None
