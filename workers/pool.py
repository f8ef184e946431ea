"""One repetition on many cores: while cores are idle, the rollouts of a call are spread over them."""

from functools import cache
from time import monotonic, perf_counter

import numpy as np
import ray
from ray.exceptions import RayError

from schemas.spec import ExperimentSpec
from services.core.arrays import Fitnesses, Genomes, Parameters
from services.core.ports import Simulate
from services.simulation import setting

LEAST_S = 0.02
"""A part that is sent to another core is worth at least this much work; sending costs a twentieth of it."""

LOOK_S = 1.0
"""How often it is looked which cores are idle."""

PATIENCE = 3.0
"""A part that takes so many times as long as expected waits for a core that somebody else took, or for one that has yet
to load the engine: it is done here, and what comes back later is not looked at."""


class Pool:
    """A Simulate that spreads its rollouts over the idle cores of the cluster, with the same numbers.

    Args:
        spec: resolved; another core builds the simulation from it, and keeps it warm.
        simulate: the same simulation here.
        batch: rollouts that the engine likes at a time.
    """

    def __init__(self, spec: ExperimentSpec, simulate: Simulate, batch: int) -> None:
        self._spec = ray.put(spec.model_dump_json())
        self._simulate = simulate
        self._batch = batch
        self._rollout_s = 0.0
        self._idle = 0
        self._looked = -LOOK_S

    def batch(self) -> int:
        """Rollouts that one call should ask for, if there is a choice: as many as keep all cores busy."""
        return self._batch * (1 + self._helpers())

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """`(n, g)` genomes × `(m, p)` parameters -> `(n, m)` fitnesses; nan where the physics failed."""
        by_genome = len(genomes) >= len(parameters)
        many = len(genomes) if by_genome else len(parameters)
        count = min(1 + self._helpers(), many, self._worthwhile(len(genomes) * len(parameters)))
        parts = [
            (genomes[rows], parameters) if by_genome else (genomes, parameters[rows])
            for rows in np.array_split(np.arange(many), max(1, count))
        ]
        fitnesses = [self._here(*parts[0])] if len(parts) == 1 else self._spread(parts)
        return np.concatenate(fitnesses, axis=0 if by_genome else 1)

    def _spread(self, parts: list[tuple[Genomes, Parameters]]) -> list[Fitnesses]:
        """The first part here, the others elsewhere; what comes back too late or not at all is done here after all."""
        sent = [_part.remote(self._spec, *part) for part in parts[1:]]
        first = self._here(*parts[0])
        patience_s = PATIENCE * self._rollout_s * max(len(g) * len(p) for g, p in parts)
        _, late = ray.wait(sent, num_returns=len(sent), timeout=patience_s)
        if late:
            self._idle = 0
        return [first, *(self._fetched(ref, part, late) for ref, part in zip(sent, parts[1:], strict=True))]

    def _fetched(
        self, ref: "ray.ObjectRef[Fitnesses]", part: tuple[Genomes, Parameters], late: list["ray.ObjectRef[Fitnesses]"]
    ) -> Fitnesses:
        if ref in late:
            return self._simulate(*part)
        try:
            return ray.get(ref)
        except RayError:  # its node or its process died
            self._idle = 0
            return self._simulate(*part)

    def _here(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        begun = perf_counter()
        fitnesses = self._simulate(genomes, parameters)
        self._rollout_s = (perf_counter() - begun) / fitnesses.size
        return fitnesses

    def _worthwhile(self, rollouts: int) -> int:
        """Into how many parts so many rollouts may be cut."""
        return int(rollouts * self._rollout_s / LEAST_S)

    def _helpers(self) -> int:
        """Cores that are idle now, or were a moment ago."""
        if monotonic() - self._looked > LOOK_S:
            self._idle = int(ray.available_resources().get("CPU", 0))
            self._looked = monotonic()
        return self._idle


@ray.remote(num_cpus=1, max_retries=0)
def _part(spec: str, genomes: Genomes, parameters: Parameters) -> Fitnesses:
    """The fitnesses of one part, on another core."""
    return _simulation(spec)(genomes, parameters)


@cache
def _simulation(spec: str) -> Simulate:
    return setting(ExperimentSpec.model_validate_json(spec), 0).simulate
