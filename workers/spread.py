"""The parts of one call, done by this core and by others: who is slow gets less of them, and nobody is waited for."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from time import monotonic
from typing import TypeAlias

import ray
from ray.exceptions import RayError

from gaplab.services.core.arrays import Fitnesses, Genomes, Parameters
from gaplab.services.core.ports import Simulate
from gaplab.workers.helpers import Handle

Part: TypeAlias = tuple[Genomes, Parameters]

AHEAD = 2
"""Parts that a helper is lent at a time: while it does one, the next one waits for it."""

SLOWEST = 2.0
"""What takes so many times as long as expected is not waited for."""

SHARE = 0.8
"""Of what is left, what is dealt at once: the rest evens out how fast cores are."""


def sizes(rows: int, cores: int, least: int) -> list[int]:
    """How many rows each part has: large ones at both ends, where work begins, and small ones where it meets.

    Every core is dealt most of its fair share at first, then most of what is left, and so on: equal cores end together
    after few parts, and of unequal ones the faster does more of the small ones.

    Source: "factoring", Hummel, Schonberg and Flynn 1992.

    Args:
        rows: to be divided.
        cores: this one included.
        least: rows of a part, but for the last one.
    """
    ours: list[int] = []
    theirs: list[int] = []
    while rows:
        size = max(least, int(SHARE * rows / cores))
        for core in range(cores):
            part = min(size, rows)
            rows -= part
            (theirs if core else ours).append(part)
    return [part for part in ours + theirs[::-1] if part]


@dataclass(frozen=True)
class Loan:
    """A part that is with a helper, and until when it should be back."""

    part: int
    helper: Handle
    until: float


class Spread:
    """Does the first part here and lends the last ones, then the next here, and so on until both meet.

    A part that is lent and has not come back in its time when nothing else is left is done here as well. A core that is
    slow, dead, or taken by somebody else therefore costs little more than the time of a part.

    Args:
        parts: of the call.
        here: does a part on this core.
        helpers: do parts on other cores.
        rollout_s: what a rollout should take, in seconds.

    Attributes:
        gained: rollouts that others did.
        lost: rollouts that were lent, and had to be done here after all.
        dead: helpers that answer nothing any more.
    """

    def __init__(self, parts: Sequence[Part], here: Simulate, helpers: Sequence[Handle], rollout_s: float) -> None:
        self.gained = self.lost = 0
        self.dead: list[Handle] = []
        self._parts = parts
        self._here = here
        self._rollout_s = rollout_s
        self._left = deque(range(len(parts)))
        self._room = deque(helper for _ in range(AHEAD) for helper in helpers)
        self._lent: dict[ray.ObjectRef[Fitnesses], Loan] = {}
        self._done: dict[int, Fitnesses] = {}

    def run(self) -> list[Fitnesses]:
        """What came of the parts, in their order."""
        while self._left or self._lent:
            self._collect(patient=not self._left)
            while len(self._left) > 1 and self._room:
                self._lend(self._left.pop(), self._room.popleft())
            if self._left:
                index = self._left.popleft()
                self._done[index] = self._here(*self._parts[index])
        return [self._done[index] for index in sorted(self._done)]

    def _lend(self, index: int, helper: Handle) -> None:
        before = sum(self._rollouts(loan.part) for loan in self._lent.values() if loan.helper is helper)
        until = monotonic() + SLOWEST * self._rollout_s * (before + self._rollouts(index))
        self._lent[helper.part.remote(*self._parts[index])] = Loan(index, helper, until)

    def _collect(self, *, patient: bool) -> None:
        """Take what has come back; if there is nothing else to do and nothing has in its time, take back the latest."""
        if not self._lent:
            return
        until = next(reversed(self._lent.values())).until if patient else 0.0
        wait_s = max(0.0, until - monotonic())
        ready, _ = ray.wait(list(self._lent), num_returns=1 if patient else len(self._lent), timeout=wait_s)
        for ref in ready:
            self._take(self._lent.pop(ref), ref)
        if patient and not ready:
            self._take_back(self._lent.popitem()[1])

    def _take(self, loan: Loan, ref: "ray.ObjectRef[Fitnesses]") -> None:
        try:
            self._done[loan.part] = ray.get(ref)
            self.gained += self._rollouts(loan.part)
            self._room.append(loan.helper)
        except RayError:  # its node or its process died
            self._room.clear()
            self.dead.append(loan.helper)
            self._take_back(loan)

    def _take_back(self, loan: Loan) -> None:
        self.lost += self._rollouts(loan.part)
        self._left.append(loan.part)

    def _rollouts(self, part: int) -> int:
        genomes, parameters = self._parts[part]
        return len(genomes) * len(parameters)
