"""One repetition on many cores: it shares its calls with helpers, which are Ray actors on idle cores.

A slow helper gets fewer parts of a call; no call waits for one.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import ceil
from time import monotonic, perf_counter
from typing import Any, TypeAlias

import numpy as np
import ray
from numpy.typing import NDArray
from ray.exceptions import RayError

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genomes, Outcomes, Parameters
from gaplab.services.core.ports import Sense, Simulate
from gaplab.services.specs.assembly import simulated
from gaplab.workers.expected import Versions, check_here

CHECK_S = 1.0
"""Interval between checks for idle cores."""

LONGEST_PAUSE_S = 30.0
"""Longest pause before helpers that cost time are tried again; the pause doubles each time."""

SIMULATE, SENSE = "simulate", "sense"
"""Questions to a Helper, which it answers as a Simulate and as a Sense."""

Handle: TypeAlias = Any
"""A handle of a Helper actor, which Ray does not type."""


@ray.remote(max_restarts=0)
class Helper:
    """A process that simulates on request.

    Ray places it where a core is idle and still counts that core as idle, so the next repetition can take it. It has no
    permit, and no hardware. It has the variables of the task that starts it, and so its plug-ins.
    """

    def __init__(self, spec: str, expected: Versions) -> None:
        check_here(expected)
        compute = simulated(ResolvedSpec.model_validate_json(spec))
        self._compute = dict(zip((SIMULATE, SENSE), compute, strict=True))

    def answer(self, question: str, genomes: Genomes, parameters: Parameters) -> FloatArray:
        """Return the fitnesses or outcomes of genomes `(n, g)` in simulators `(m, p)`."""
        return self._compute[question](genomes, parameters)


class Helpers:
    """The helpers of a repetition, one for each idle core; they end with this object.

    A helper must start and load an engine, and other programs may use its core. So each helper first gets a rollout
    whose answer is not needed, and is ready once it has answered.
    """

    def __init__(self, spec: ResolvedSpec, versions: Versions) -> None:
        self._spec = spec.model_dump_json()
        self._versions = versions
        self._starting: dict[ray.ObjectRef[FloatArray], Handle] = {}
        self._ready: list[Handle] = []
        self._idle = 0
        self._checked = -CHECK_S
        self._pause_s = CHECK_S

    def ready(self, genomes: Genomes, parameters: Parameters) -> list[Handle]:
        """Return the helpers that can simulate now; new ones warm up with these genomes and parameters."""
        if monotonic() - self._checked > self._pause_s:
            self._check(genomes, parameters)
        if self._starting:
            answered, _ = ray.wait(list(self._starting), num_returns=len(self._starting), timeout=0)
            for answer in answered:
                self._admit(answer)
        return self._ready

    def helped(self, but_for: Sequence[Handle] = ()) -> None:
        """Keep all helpers except these; the next check replaces them."""
        self._ready = [helper for helper in self._ready if helper not in but_for]
        self._pause_s = CHECK_S

    def failed(self) -> None:
        """End all helpers, because their parts took longer than on this core."""
        for helper in (*self._ready, *self._starting.values()):
            ray.kill(helper)
        self._ready, self._starting = [], {}
        self._checked = monotonic()
        self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)

    def _check(self, genomes: Genomes, parameters: Parameters) -> None:
        self._checked = monotonic()
        before, self._idle = self._idle, int(ray.available_resources().get("CPU", 0))
        del self._ready[max(before, self._idle) :]  # one check may miss an idle core
        useful = len(genomes) * len(parameters) - 1
        for _ in range(min(self._idle, useful) - len(self._ready) - len(self._starting)):
            helper = Helper.remote(self._spec, self._versions)  # type: ignore[attr-defined]  # Ray adds it
            self._starting[helper.answer.remote(SIMULATE, genomes[:1], parameters[:1])] = helper

    def _admit(self, answer: "ray.ObjectRef[FloatArray]") -> None:
        helper = self._starting.pop(answer)
        try:
            ray.get(answer)
            self._ready.append(helper)
        except RayError:  # its node or its process died, or has other versions
            self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)


Part: TypeAlias = tuple[Genomes, Parameters]

QUEUED = 2
"""Parts that a helper has at a time: one that it simulates, and one that waits for it."""

SLOWEST = 2.0
"""A part is taken back after this multiple of its expected time."""

SHARE = 0.8
"""Share of the remaining rows in one deal; later deals even out differences in speed."""


def sizes(rows: int, cores: int, least: int) -> list[int]:
    """Return the number of rows of each part: large parts at both ends, where work begins, small ones in the middle.

    Each core, this one too, first gets most of its fair share, then most of its share of the rest, and so on. Equal
    cores end together after few parts; of unequal cores, the faster one simulates more of the small parts. Only the
    last part has fewer rows than `least`.

    Source: "factoring", Hummel, Schonberg and Flynn 1992.
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
    """A part that a helper simulates, and the time by which it should answer."""

    part: int
    helper: Handle
    until: float


class SharedCall:
    """One call: this core simulates parts from the front, helpers from the back, until they meet.

    Once no other part is left, this core also simulates a part whose helper is late. So a core that is slow, dead or
    used by another program delays the call by little more than one part. `here` simulates a part on this core, as
    helpers answer the question; a rollout is expected to take `rollout_s`.

    Attributes:
        gained: rollouts that helpers simulated.
        lost: rollouts of parts that were taken back.
        dead: helpers that no longer answer.
    """

    def __init__(
        self,
        parts: Sequence[Part],
        here: Callable[[Genomes, Parameters], FloatArray],
        helpers: Sequence[Handle],
        rollout_s: float,
        question: str = SIMULATE,
    ) -> None:
        self._question = question
        self.gained = self.lost = 0
        self.dead: list[Handle] = []
        self._parts = parts
        self._here = here
        self._rollout_s = rollout_s
        self._left = deque(range(len(parts)))
        self._room = deque(helper for _ in range(QUEUED) for helper in helpers)
        self._lent: dict[ray.ObjectRef[FloatArray], Loan] = {}
        self._done: dict[int, FloatArray] = {}

    def run(self) -> list[FloatArray]:
        """Return the answers of each part, in their order."""
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
        asked = helper.answer.remote(self._question, *self._parts[index])
        self._lent[asked] = Loan(index, helper, until)

    def _collect(self, *, patient: bool) -> None:
        """Take the available answers; if patient, wait for one, and take back the latest part if it is late."""
        if not self._lent:
            return
        until = next(reversed(self._lent.values())).until if patient else 0.0
        wait_s = max(0.0, until - monotonic())
        ready, _ = ray.wait(list(self._lent), num_returns=1 if patient else len(self._lent), timeout=wait_s)
        for ref in ready:
            self._take(self._lent.pop(ref), ref)
        if patient and not ready:
            self._take_back(self._lent.popitem()[1])

    def _take(self, loan: Loan, ref: "ray.ObjectRef[FloatArray]") -> None:
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


Rows: TypeAlias = NDArray[np.intp]

LEAST_S = 0.005
"""Least work, in seconds, of a part for another core; lending costs about a tenth of it."""


class Pool:
    """A Simulate and a Sense that share their rollouts with the idle cores of the cluster; the numbers stay the same.

    Helpers build the same Simulate from the spec as the one `here`; their nodes must have the versions. A call has at
    least `per_call` rollouts. There is no Sense if nothing asks for readings.
    """

    def __init__(
        self,
        spec: ResolvedSpec,
        here: Simulate,
        per_call: int,
        versions: Versions | None = None,
        sense: Sense | None = None,
    ) -> None:
        self._compute: dict[str, Callable[[Genomes, Parameters], FloatArray]] = {SIMULATE: here}
        if sense is not None:
            self._compute[SENSE] = sense
        self._per_call = per_call
        self._rollout_s = 0.0
        self._helpers = Helpers(spec, versions or {})
        self._last: Part | None = None

    def batch_size(self) -> int:
        """Return how many rollouts one call should ask for to keep all cores busy.

        A few rollouts of a fast engine are not worth lending.
        """
        if self._last is None or self._rollout_s * self._per_call < LEAST_S:
            return self._per_call
        return self._per_call * (1 + len(self._helpers.ready(*self._last)))

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """Return the `(n, m)` fitnesses of genomes `(n, g)` in simulators `(m, p)`; nan where the physics failed."""
        return self._shared(SIMULATE, genomes, parameters)

    def sense(self, genomes: Genomes, parameters: Parameters) -> Outcomes:
        """Return fitness and readings `(n, m, 1 + q)` of genomes `(n, g)` in simulators `(m, p)`."""
        return self._shared(SENSE, genomes, parameters)

    def _shared(self, question: str, genomes: Genomes, parameters: Parameters) -> FloatArray:
        self._last = genomes, parameters
        by_genome = len(genomes) >= len(parameters)
        rows, across = (len(genomes), len(parameters)) if by_genome else (len(parameters), len(genomes))

        def part(rows: Rows) -> Part:
            return (genomes[rows], parameters) if by_genome else (genomes, parameters[rows])

        answers: list[FloatArray] = []
        left = np.arange(rows)
        while left.size:
            helpers = self._helpers.ready(genomes, parameters)
            now, left = np.split(left, [self._until_next_check(1 + len(helpers), across)])
            ends = np.cumsum(sizes(len(now), 1 + len(helpers), self._least(across)))[:-1]
            answers += self._done(question, [part(some) for some in np.split(now, ends)], helpers)
        return np.concatenate(answers, axis=0 if by_genome else 1)

    def _until_next_check(self, cores: int, across: int) -> int:
        """Return the number of rows to simulate before the next check for idle cores; 1 while their time is unknown."""
        return max(1, int(cores * CHECK_S / (self._rollout_s * across))) if self._rollout_s else 1

    def _least(self, across: int) -> int:
        """Return the smallest number of rows that is worth lending."""
        return ceil(max(LEAST_S / self._rollout_s, self._per_call) / across) if self._rollout_s else 1

    def _done(self, question: str, parts: list[Part], helpers: list[Handle]) -> list[FloatArray]:
        here = partial(self._here, question)
        if not helpers or len(parts) == 1:
            return [here(*part) for part in parts]
        call = SharedCall(parts, here, helpers, self._rollout_s, question)
        answers = call.run()
        if call.lost > call.gained:
            self._helpers.failed()
        else:
            self._helpers.helped(but_for=call.dead)
        return answers

    def _here(self, question: str, genomes: Genomes, parameters: Parameters) -> FloatArray:
        begun = perf_counter()
        answers = self._compute[question](genomes, parameters)
        self._rollout_s = (perf_counter() - begun) / (len(genomes) * len(parameters))
        return answers
