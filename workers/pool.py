"""One repetition on many cores: while cores are idle, the rollouts of a call are spread over them."""

from functools import cache
from math import ceil
from time import monotonic, perf_counter

import numpy as np
import ray

from schemas.spec import ExperimentSpec
from services.core.arrays import Fitnesses, Genomes, Parameters
from services.core.ports import Simulate
from services.simulation import setting
from workers.nodes import Versions, check_here
from workers.spread import Answer, Spread, sizes

LEAST_S = 0.01
"""A part that is lent to another core is worth at least this much work; lending costs less than a tenth of it."""

LOOK_S = 1.0
"""How often it is looked which cores are idle."""

LONGEST_PAUSE_S = 30.0
"""Cores that were no help are tried again after a pause that doubles each time, up to this."""

OURS_S = 0.4
"""A core that did a part stays ours for half a second, in which Ray does not count it among the idle ones."""


class Pool:
    """A Simulate that spreads its rollouts over the idle cores of the cluster, with the same numbers.

    Args:
        spec: resolved; another core builds the simulation from it, and keeps it warm.
        simulate: the same simulation here.
        batch: rollouts that the engine likes at a time.
        versions: that a node must have to help.
    """

    def __init__(self, spec: ExperimentSpec, simulate: Simulate, batch: int, versions: Versions | None = None) -> None:
        self._spec = ray.put(spec.model_dump_json())
        self._simulate = simulate
        self._batch = batch
        self._versions = versions or {}
        self._rollout_s = 0.0
        self._idle = 0
        self._looked = -LOOK_S
        self._pause_s = LOOK_S
        self._helped = 0
        self._back = -OURS_S

    def batch(self) -> int:
        """Rollouts that one call should ask for, if there is a choice: as many as keep all cores busy."""
        return self._batch * (1 + self._helpers())

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """`(n, g)` genomes × `(m, p)` parameters -> `(n, m)` fitnesses; nan where the physics failed."""
        helpers = self._helpers()
        if not helpers or self._rollout_s * len(genomes) * len(parameters) < 2 * LEAST_S:
            return self._here(genomes, parameters)
        by_genome = len(genomes) >= len(parameters)
        rows, across = (len(genomes), len(parameters)) if by_genome else (len(parameters), len(genomes))
        least = ceil(max(LEAST_S / self._rollout_s, self._batch) / across)
        ends = np.cumsum(sizes(rows, 1 + helpers, least))[:-1]
        parts = [
            (genomes[part], parameters) if by_genome else (genomes, parameters[part])
            for part in np.split(np.arange(rows), ends)
        ]
        return np.concatenate(self._spread(parts, helpers), axis=0 if by_genome else 1)

    def _spread(self, parts: list[tuple[Genomes, Parameters]], helpers: int) -> list[Fitnesses]:
        spread = Spread(
            [self._rollout_s * len(genomes) * len(parameters) for genomes, parameters in parts],
            here=lambda index: self._here(*parts[index]),
            lend=lambda index: _part.remote(self._spec, self._versions, *parts[index]),
            helpers=helpers,
        )
        fitnesses = spread.run()
        self._helped, self._back = len(spread.helped), monotonic()
        if spread.lost_s > spread.gained_s:  # cores that seem idle have other work, of which Ray knows nothing
            self._idle = 0
            self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)
        else:
            self._pause_s = LOOK_S
        return fitnesses

    def _here(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        begun = perf_counter()
        fitnesses = self._simulate(genomes, parameters)
        self._rollout_s = (perf_counter() - begun) / fitnesses.size
        return fitnesses

    def _helpers(self) -> int:
        """Cores that are idle now, or were a moment ago."""
        if monotonic() - self._looked > self._pause_s:
            ours = self._helped if monotonic() - self._back < OURS_S else 0
            self._idle = int(ray.available_resources().get("CPU", 0)) + ours
            self._looked = monotonic()
        return self._idle


@ray.remote(num_cpus=1, max_retries=0)
def _part(spec: str, expected: Versions, genomes: Genomes, parameters: Parameters) -> Answer:
    """The fitnesses of one part, on another core, which must have the versions that this one has."""
    check_here(expected)
    return ray.get_runtime_context().get_worker_id(), _simulation(spec)(genomes, parameters)


@cache
def _simulation(spec: str) -> Simulate:
    return setting(ExperimentSpec.model_validate_json(spec), 0).simulate
