"""The parts of one call, done by this core and by others: who is slow gets less of them, and nobody is waited for."""

from collections import deque
from collections.abc import Callable, Sequence
from time import monotonic
from typing import TypeAlias

import ray
from ray.exceptions import RayError

from services.core.arrays import Fitnesses

Answer: TypeAlias = tuple[str, Fitnesses]
"""The core that did a part, and what came of it."""

AHEAD = 2
"""Parts that a core is lent at a time: while it does one, the next one waits for it."""

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


class Spread:
    """Does the first part here and lends the last ones, then the next here, and so on until both meet.

    A part that is lent and has not come back in its time when nothing else is left is done here as well. A core that is
    slow, dead, or taken by somebody else therefore costs little more than the time of a part.

    Args:
        expected_s: what each part should take, in seconds.
        here: does a part on this core.
        lend: has a part done by another core.
        helpers: other cores.

    Attributes:
        helped: the cores that did a part.
        gained_s: of work that others did.
        lost_s: of work that was lent, and had to be done here after all.
    """

    def __init__(
        self,
        expected_s: Sequence[float],
        here: Callable[[int], Fitnesses],
        lend: Callable[[int], "ray.ObjectRef[Answer]"],
        helpers: int,
    ) -> None:
        self.helped: set[str] = set()
        self.gained_s = self.lost_s = 0.0
        self._here = here
        self._lend = lend
        self._room = AHEAD * helpers
        self._left = deque(range(len(expected_s)))
        self._lent: dict[ray.ObjectRef[Answer], tuple[int, float]] = {}
        self._done: dict[int, Fitnesses] = {}
        self._expected_s = expected_s

    def run(self) -> list[Fitnesses]:
        """What came of the parts, in their order."""
        while self._left or self._lent:
            self._collect(patient=not self._left)
            while len(self._left) > 1 and len(self._lent) < self._room:
                index = self._left.pop()
                self._lent[self._lend(index)] = index, monotonic() + SLOWEST * self._expected_s[index]
            if self._left:
                index = self._left.popleft()
                self._done[index] = self._here(index)
        return [self._done[index] for index in sorted(self._done)]

    def _collect(self, *, patient: bool) -> None:
        """Take what has come back; if there is nothing else to do and nothing has in its time, take back the latest."""
        if not self._lent:
            return
        until = next(reversed(self._lent.values()))[1] if patient else 0.0
        wait_s = max(0.0, until - monotonic())
        ready, _ = ray.wait(list(self._lent), num_returns=1 if patient else len(self._lent), timeout=wait_s)
        for ref in ready:
            self._take(self._lent.pop(ref)[0], ref)
        if patient and not ready:
            self._take_back(self._lent.popitem()[1][0])

    def _take(self, index: int, ref: "ray.ObjectRef[Answer]") -> None:
        try:
            core, self._done[index] = ray.get(ref)
            self.helped.add(core)
            self.gained_s += self._expected_s[index]
        except RayError:  # its node or its process died, or has other versions
            self._room = 0
            self._take_back(index)

    def _take_back(self, index: int) -> None:
        self.lost_s += self._expected_s[index]
        self._left.append(index)
