"""Faults of operators and drivers of a robot on a bench: each has an experiment, and a bench, of its own."""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from typing import Any

import httpx2

from tests.soak.operators import PHYSICAL, Operator, right
from tests.soak.plugin_faults import submitted
from tests.soak.stage import until

WAIT_S = 60.0
"""For how long a fault waits for its experiment to ask for a measurement."""

MEND_S = 180.0
"""After which a wrong value that was not corrected stays wrong, and the checker finds it."""

NONSENSE: tuple[dict[str, Any], ...] = (
    {"values": ["nan"]},
    {"values": [0.1, 0.2]},
    {"values": [0.1], "unit": "furlongs"},
    {"values": None},
    {"values": [1e400]},
)

_numbers = count()

Inflict = Callable[[Operator, Any], None]


def _dies(operator: Operator, request: Any) -> None:
    """Take the request, and never answer."""
    operator.take(request["id"])
    until(lambda: (_now(operator, request) or {}).get("state") == "open", WAIT_S)


def _comes_late(operator: Operator, request: Any) -> None:
    """Answer after the take ran out."""
    if taken := operator.take(request["id"], 1):
        time.sleep(2.0)
        operator.answer(taken, right(taken["genome"]))


def _repeats_itself(operator: Operator, request: Any) -> None:
    """Answer twice, and a third time with something else."""
    if taken := operator.take(request["id"]):
        for value in (right(taken["genome"]), right(taken["genome"]), -1.0):
            operator.answer(taken, value)


def _are_many(operator: Operator, request: Any) -> None:
    """Take the request at the same time as others."""
    others = [Operator(operator.http, operator.history, f"{operator.name} {number}") for number in range(4)]
    with ThreadPoolExecutor(len(others)) as pool:
        takes = list(pool.map(lambda each: each.take(request["id"]), others))
    for each, taken in zip(others, takes, strict=True):
        if taken:
            each.answer(taken, right(taken["genome"]))


def _talks_nonsense(operator: Operator, request: Any) -> None:
    """Answer with what is not a measurement, and die."""
    if taken := operator.take(request["id"]):
        for changes in NONSENSE:
            operator.answer(taken, verb="nonsense", **changes)


def _lies(operator: Operator, request: Any) -> None:
    """Answer for the holder of the request: without a take, with one that never was, with a stale token, and again."""
    honest = Operator(operator.http, operator.history, f"{operator.name}, an honest one")
    if taken := honest.take(request["id"], lease_s=120.0):  # longer than any fault keeps the service away
        wrong, stale = right(taken["genome"]) + 1.0, {"Authorization": f"Bearer gaplab_stale_{'0' * 64}"}
        for take in (None, taken["takes"] + 1, 2**31 - 1):
            operator.answer(taken, wrong, verb="lie", take=take)
        operator.answer(taken, wrong, verb="nonsense", headers=stale)
        for changes in NONSENSE:
            operator.answer(taken, verb="nonsense", **changes)
        if honest.answer(taken, right(taken["genome"])).acknowledged:
            operator.answer(taken, wrong, verb="lie")


def _slips(operator: Operator, request: Any) -> None:
    """Answer with a wrong number, and correct it later."""
    if taken := operator.take(request["id"]):
        operator.answer(taken, right(taken["genome"]) + 1.0)
        time.sleep(2.0)
    until(lambda: _mended(operator, request), MEND_S)


def _mended(operator: Operator, request: Any) -> bool:
    """Whether no wrong value counts any more; one that does is corrected."""
    now = _now(operator, request)
    wrong = [
        each["id"]
        for each in (now or {}).get("answers", ())
        if each["state"] == "counted" and each["values"] != [right(request["genome"])]
    ]
    for answer in wrong:
        operator.correct(answer, right(request["genome"]))
    return now is not None and not wrong


def _now(operator: Operator, request: Any) -> Any:
    """The request as it is now; None if the service does not say."""
    try:
        answer = operator.http.get(f"/requests/{request['id']}")
        return answer.json() if answer.status_code == 200 else None
    except (httpx2.HTTPError, ValueError):
        return None


KINDS: dict[str, Inflict] = {
    "driver dies": _dies,
    "driver comes late": _comes_late,
    "driver repeats itself": _repeats_itself,
    "operators are many": _are_many,
    "driver talks nonsense": _talks_nonsense,
    "driver lies": _lies,
    "operator slips": _slips,
}


def inflicting(kind: str) -> Any:
    """Submit an experiment whose reality is on a bench, wait for its request, and misbehave there."""

    def inflict(stage: Any) -> bool:
        bench = f"bench of fault {next(_numbers)}"
        with stage.clients.reserved(bench):
            spec = {"strategy": "simulated_fit", "reality": PHYSICAL | {"bench": bench}}
            if submitted(stage, spec, kind) is None:
                return False
            operator, found = Operator(stage.http, stage.history, kind), []
            if not until(lambda: found.extend(operator.pending(bench=bench)) or found, WAIT_S):  # type: ignore[func-returns-value]
                return False
            KINDS[kind](operator, found[0])
            return True

    return inflict
