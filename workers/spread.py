"""The parts of one call, done by this core and by others: who is slow gets less of them, and nobody is waited for."""

from collections import deque
from collections.abc import Callable
from time import perf_counter
from typing import TypeAlias

import ray
from ray.exceptions import RayError

from services.core.arrays import Fitnesses

Answer: TypeAlias = tuple[str, Fitnesses]
"""The core that did a part, and what came of it."""

AHEAD = 2
"""Parts that a core is lent at a time: while it does one, the next one waits for it."""


class Spread:
    """Does the first part here and lends the last ones, then the next here, and so on until both meet.

    A part that is lent and has not come back when nothing else is left is done here as well. A core that is slow, dead,
    or taken by somebody else therefore costs the time of a part.

    Args:
        count: of the parts.
        here: does a part on this core.
        lend: has a part done by another core.
        helpers: other cores.

    Attributes:
        helped: the cores that did a part.
        late: whether parts had to be done here that were lent.
    """

    def __init__(
        self,
        count: int,
        here: Callable[[int], Fitnesses],
        lend: Callable[[int], "ray.ObjectRef[Answer]"],
        helpers: int,
    ) -> None:
        self.helped: set[str] = set()
        self.late = False
        self._here = here
        self._lend = lend
        self._room = AHEAD * helpers
        self._left = deque(range(count))
        self._lent: dict[ray.ObjectRef[Answer], int] = {}
        self._done: dict[int, Fitnesses] = {}
        self._part_s = 0.0

    def run(self) -> list[Fitnesses]:
        """What came of the parts, in their order."""
        while self._left or self._lent:
            self._collect(0.0 if self._left else self._part_s)
            while len(self._left) > 1 and len(self._lent) < self._room:
                index = self._left.pop()
                self._lent[self._lend(index)] = index
            if self._left:
                self._do(self._left.popleft())
        return [self._done[index] for index in sorted(self._done)]

    def _do(self, index: int) -> None:
        begun = perf_counter()
        self._done[index] = self._here(index)
        self._part_s = perf_counter() - begun

    def _collect(self, patience_s: float) -> None:
        """Take what has come back; if nothing comes for so long, take back what was lent last."""
        if not self._lent:
            return
        ready, _ = ray.wait(list(self._lent), num_returns=1 if patience_s else len(self._lent), timeout=patience_s)
        for ref in ready:
            self._take(self._lent.pop(ref), ref)
        if patience_s and not ready:
            self.late = True
            _, index = self._lent.popitem()
            self._left.append(index)

    def _take(self, index: int, ref: "ray.ObjectRef[Answer]") -> None:
        try:
            core, self._done[index] = ray.get(ref)
            self.helped.add(core)
        except RayError:  # its node or its process died, or has other versions
            self.late = True
            self._room = 0
            self._left.append(index)
