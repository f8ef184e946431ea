"""Clients: they submit, read, and move experiments through their life cycle, and write down what they were told.

Which verbs there are is asked of the service. Nothing is asked twice: whether a request that got no answer took effect
is for the checker to find out.
"""

import random
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import count
from threading import Event, Lock, Thread
from typing import Any

import httpx2

from gaplab.schemas.lifecycle import State
from tests.soak.operators import PHYSICAL, QUADRUPED, Operator

VERBS = {"cancel": 2, "pause": 3, "resume": 4, "stop": 1, "extend": 2}
"""Those that are used, if the service has them, and how often compared with each other."""

OPEN = 8
"""Experiments that clients keep in the queue: enough for both supervisors to have something to do."""

READS = ("", "/samples", "/repetitions", "/curve")

TOY = {
    "robot": "toy_function",
    "iterations": 3,
    "repetitions": 3,
    "budget": {"controller_evaluations": 200, "selection_evaluations": 60, "simulator_evaluations": 30},
}
ON_A_BENCH = TOY | {"iterations": 2, "repetitions": 2, "strategy": "simulated_fit"}
BENCHES, OPERATORS = 2, 2
STRATEGIES = ("simulated_fit", "random", "known_fit", "direct")
TOY_STRATEGIES = (*STRATEGIES, "calm", {"name": "simulated_fit_and_informative", "options": {"simulators": 4}})


def specs(rng: Any) -> Iterator[Any]:
    """Specs without end, of few kinds: what they should come to is computed once for each."""
    for number in count():
        base, strategies = (QUADRUPED | {"repetitions": 2}, STRATEGIES) if number % 4 == 3 else (TOY, TOY_STRATEGIES)
        if number % 5 == 4:
            yield "/experiments", ON_A_BENCH | {"reality": PHYSICAL | {"bench": f"bench {rng.randrange(BENCHES)}"}}
        elif number % 3 == 2:
            yield "/studies", base | {"strategies": rng.sample(strategies, 2)}
        else:
            yield "/experiments", base | {"strategy": rng.choice(strategies)}


class Clients:
    """Some clients in threads of their own.

    Args:
        http: client of the service.
        history: where they write down what they were told.
        seed: of what they do; when they do it is chance.
        number: of clients.
    """

    def __init__(self, http: Any, history: Any, seed: Any, number: Any = 3) -> None:
        self._http, self._history = http, history
        self._stopping = Event()
        self._known: list[Any] = []
        self._open = 0
        self._verbs: list[Any] = []
        self._reserved: set[str] = set()
        self._operators = [Operator(self._http, history, f"operator {each}") for each in range(OPERATORS)]
        self._turns = [Lock() for _ in range(number + OPERATORS)]
        self._threads = [
            Thread(target=self._use, args=(name, random.Random(f"{seed}-{name}")), daemon=True)
            for name in range(number)
        ]
        self._threads += [
            Thread(target=self._measure, args=(number + place, operator), daemon=True)
            for place, operator in enumerate(self._operators)
        ]

    def start(self) -> None:
        """Find out what the service can do, and begin."""
        paths = self._http.get("/openapi.json").json()["paths"]
        self._verbs = [verb for verb in VERBS if f"/studies/{{id}}/{verb}" in paths]
        for thread in self._threads:
            thread.start()

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Ask for nothing within the block."""
        with ExitStack() as stack:
            for turn in self._turns:
                stack.enter_context(turn)
            yield

    @contextmanager
    def reserved(self, bench: str) -> Iterator[None]:
        """Let no operator use this bench within the block."""
        self._reserved.add(bench)
        try:
            yield
        finally:
            self._reserved.remove(bench)

    def stop(self) -> None:
        """Ask for nothing more."""
        self._stopping.set()
        for thread in self._threads:
            if thread.is_alive():
                thread.join()

    def wake(self) -> None:
        """Resume what is paused, and measure what is wanted, so that it can end."""
        for waiting in self._in(State.WAITING):
            self._operators[0].offer_again(waiting)
        self._operators[0].work()
        for state in {str(each) for each in State} & {"PAUSING", "PAUSED"}:
            for paused in self._in(state):
                self._ask("resume", "POST", f"/studies/{paused}/resume")

    def under_way(self) -> Any:
        """Experiments that have not ended."""
        return [each for state in State if not state.ended for each in self._in(state)]

    def _in(self, state: Any) -> Any:
        answer = self._http.get("/studies", params={"limit": 500, "q": f"experiment_state = {state}"})
        answer.raise_for_status()
        found = [each for study in answer.json()["items"] for each in study["experiments"]]
        return [each["id"] for each in found if each["state"] == state]

    def _use(self, name: Any, rng: Any) -> None:
        wanted = specs(rng)
        for number in count():
            if self._stopping.wait(rng.uniform(0.1, 0.6)):
                return
            with self._turns[name]:
                self._look(rng)
                if self._open < OPEN:
                    path, spec = next(wanted)
                    self._submit(path, spec | {"name": f"client {name}, number {number}"})
                if self._known and rng.random() < 0.1:
                    self._move(rng)

    def _measure(self, place: int, operator: Operator) -> None:
        while not self._stopping.wait(0.5):
            with self._turns[place]:
                operator.work(frozenset(self._reserved))

    def _look(self, rng: Any) -> None:
        """Read something that exists, and what is under way."""
        if self._known:
            one, _ = rng.choice(self._known)
            self._ask("read", "GET", f"/experiments/{one}{rng.choice(READS)}")
        try:
            self._open = len(self._in(State.QUEUED)) + len(self._in(State.RUNNING))
        except (httpx2.HTTPError, ValueError):
            return

    def _move(self, rng: Any) -> None:
        """An experiment to another state, if it may: one of the latest, or to be extended any."""
        verb = rng.choices(self._verbs, [VERBS[each] for each in self._verbs])[0]
        one, spec = rng.choice(self._known if verb == "extend" else self._known[-OPEN:])
        what = rng.choice(("iterations", "repetitions"))
        body = {what: spec[what] + 1} if verb == "extend" else None
        self._ask(verb, "POST", f"/studies/{one}/{verb}", body)

    def _submit(self, path: Any, spec: Any) -> None:
        record = self._ask("submit", "POST", path, spec)
        if record.acknowledged:
            found = record.answer.get("experiments", [record.answer])
            self._known += [(each["id"], spec) for each in found]
            self._open += len(found)

    def _ask(self, verb: Any, method: Any, path: Any, body: Any = None) -> Any:
        record = self._history.ask(self._http, verb, method, path, body)
        if record.status is None:
            time.sleep(0.2)
        return record
