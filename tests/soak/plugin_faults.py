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
        spec = SPEC | {"strategy": f"{PREFIX}_{kind}", "name": f"fault {next(_numbers)}: {kind}"}
        with httpx2.Client(base_url=stage.url, timeout=8, trust_env=False) as http:
            record = stage.history.ask(http, "submit", "POST", "/experiments", spec)
            if not record.acknowledged:
                return False
            path = f"/experiments/{record.answer['id']}"
            return until(lambda: _state(http, path) not in {"QUEUED", None}, 60)

    return inflict


def edited(stage: Any) -> bool:
    """Save a comment in a file that no experiment names, and end a worker, so that new processes import it."""
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


def _state(http: Any, path: Any) -> Any:
    try:
        return http.get(path).json().get("state")
    except (httpx2.HTTPError, ValueError):
        return None
