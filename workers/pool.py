"""One repetition on many cores: it shares its calls with idle cores."""

from collections.abc import Callable
from functools import partial
from math import ceil
from time import perf_counter
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genomes, Outcomes, Parameters
from gaplab.services.core.ports import Sense, Simulate
from gaplab.workers.lending import CHECK_S, SENSE, SIMULATE, Handle, Helpers, Part, SharedCall, sizes
from gaplab.workers.nodes import Versions

Rows: TypeAlias = NDArray[np.intp]

LEAST_S = 0.005
"""Least work, in seconds, of a part for another core; lending costs about a tenth of it."""


class Pool:
    """A Simulate and a Sense that share their rollouts with the idle cores of the cluster; the numbers stay the same.

    Args:
        spec: spec of the experiment, from which helpers build the same Simulate.
        here: that Simulate, on this core.
        per_call: smallest sensible number of rollouts of a call.
        versions: versions that the node of a helper must have.
        sense: that Sense, on this core; None if nothing asks for readings.
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
