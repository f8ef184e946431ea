"""Faults of people's own plug-ins: strategies that do harm, and files that are edited while experiments run."""

import random
import signal
import time
from itertools import count
from typing import Any

import httpx2

from tests.soak.misbehaviour import FOLDER, PREFIX
from tests.soak.stage import send, until

EDIT_S = 4.0
"""For how long a file stays edited or broken."""

SPEC = {
    "robot": "toy_function",
    "iterations": 3,
    "repetitions": 1,
    "priority": 10,
    "budget": {"controller_evaluations": 60, "selection_evaluations": 30, "simulator_evaluations": 30},
}

_numbers = count()


def submitting(kind: Any) -> Any:
    """Submit an experiment with such a strategy before all others, and wait until it has begun."""

    def inflict(stage: Any) -> bool:
        one = submitted(stage, {"strategy": f"{PREFIX}_{kind}"}, kind)
        return one is not None and until(lambda: _state(stage, one) not in {"QUEUED", None}, 60)

    return inflict


def submitted(stage: Any, spec: Any, name: Any) -> Any:
    """Submit an experiment before all others, and return its id; None if that was not acknowledged."""
    body = SPEC | spec | {"name": f"fault {next(_numbers)}: {name}"}
    record = stage.history.ask(stage.http, "submit", "POST", "/experiments", body)
    return record.answer["id"] if record.acknowledged else None


def edited(stage: Any) -> bool:
    """Save a comment in a file that no experiment names, and end a worker, so that one starts with other files."""
    return _changed(stage, "\n# edited\n", "worker")


def broken(stage: Any) -> bool:
    """Save a typo in that file, and end a supervisor, so that another starts with it."""
    return _changed(stage, "\nclass Typo(\n", "supervisor")


def _changed(stage: Any, addition: Any, role: Any) -> bool:
    file = stage.plugins / "bystander.py"
    before = (FOLDER / file.name).read_text()
    file.write_text(before + addition)
    try:
        found = stage.of(role)
        hit = bool(found) and send(random.choice(found), signal.SIGKILL)
        time.sleep(EDIT_S)
    finally:
        file.write_text(before)
    return hit


def _state(stage: Any, experiment: Any) -> Any:
    try:
        return stage.http.get(f"/experiments/{experiment}").json().get("state")
    except (httpx2.HTTPError, ValueError):
        return None
