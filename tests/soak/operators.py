"""Operators of robots on benches: they take requests, measure, and answer.

Their robots have no noise: each controller has one right value, the toy function's, so that a repetition comes to the
steps that a simulated reality gives.
"""

from functools import cache
from typing import Any

import httpx2
import numpy as np

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment

PHYSICAL = {"kind": "physical", "probes": "each"}

TOY = {"strategy": "random", "robot": "toy_function", "budget": "smoke"}

QUADRUPED = {
    "robot": "quadruped",
    "iterations": 1,
    "repetitions": 1,
    "budget": {"controller_evaluations": 25, "selection_evaluations": 20, "simulator_evaluations": 20},
}

LEASE_S = 3
"""Of a take."""


class Operator:
    """Somebody who measures what is wanted.

    Args:
        http: client of the service.
        history: in which requests and answers are written down.
        name: in the service.
    """

    def __init__(self, http: Any, history: Any, name: str) -> None:
        self.http, self.history, self.name = http, history, name

    def work(self, reserved: Any = ()) -> None:
        """Measure what is open, except on benches that are reserved for faults; without a service, nothing."""
        for request in self.pending():
            if request["state"] == "open" and request["bench"] not in reserved and (taken := self.take(request["id"])):
                self.answer(taken, right(taken["genome"]))

    def pending(self, **query: Any) -> Any:
        """The requests that are wanted; none if the service does not answer."""
        try:
            answer = self.http.get("/requests", params={"limit": 200} | query)
            return answer.json()["items"] if answer.status_code == 200 else []
        except (httpx2.HTTPError, ValueError):
            return []

    def take(self, request: str, lease_s: float = LEASE_S) -> Any:
        """Take a request; None if that was not acknowledged."""
        record = self._ask("take", f"/requests/{request}/take", {"operator": self.name, "lease_s": lease_s})
        return record.answer if record.acknowledged else None

    def answer(self, taken: Any, *values: Any, verb: str = "answer", headers: Any = None, **changes: Any) -> Any:
        """Answer a request as it was taken, and return the record, which has this verb."""
        body = {"take": taken["takes"], "values": list(values), "operator": self.name} | changes
        return self._ask(verb, f"/requests/{taken['id']}/measurements", body, headers=headers)

    def correct(self, answer: str, *values: float) -> Any:
        """Replace the values of an answer, and return the record."""
        body = {"values": list(values), "reason": "a slip of the keyboard"}
        return self._ask("correct", f"/measurements/{answer}/corrections", body)

    def offer_again(self, experiment: str) -> None:
        """Offer what was taken too often without an answer."""
        for request in self.pending(experiment=experiment, pending=False):
            if request["state"] == "stuck":
                self._ask("reopen", f"/requests/{request['id']}/reopen", None)

    def _ask(self, verb: str, path: str, body: Any, **sent: Any) -> Any:
        return self.history.ask(self.http, verb, "POST", path, body, **sent)


def right(genome: Any) -> float:
    """The fitness of a controller on any bench."""
    robot = "quadruped" if len(genome) == 24 else "toy_function"
    return float(_reality(robot)(np.array(genome)).fitness)


def as_simulated(robot: str) -> Any:
    """A simulated reality that is like every bench of this robot."""
    return _spec(robot).reality


@cache
def _spec(robot: str) -> Any:
    return resolve_experiment(ExperimentSpec.model_validate(TOY | {"robot": robot}))


@cache
def _reality(robot: str) -> Any:
    return setting(_spec(robot), 0).reality
