"""Helpers: Ray actors on idle cores that simulate parts of a repetition's calls."""

from collections.abc import Sequence
from time import monotonic
from typing import Any, TypeAlias

import ray
from ray.exceptions import RayError

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import Fitnesses, Genomes, Outcomes, Parameters
from gaplab.services.specs.assembly import simulated
from gaplab.workers.nodes import Versions, check_here

CHECK_S = 1.0
"""Interval between checks for idle cores."""

LONGEST_PAUSE_S = 30.0
"""Longest pause before helpers that cost time are tried again; the pause doubles each time."""

SIMULATE, SENSE = "part", "sense"
"""Methods of a Helper that answer as a Simulate and as a Sense."""

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
        self._simulate, self._sense = simulated(ResolvedSpec.model_validate_json(spec))

    def part(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """Return the `(n, m)` fitnesses of genomes `(n, g)` in simulators `(m, p)`; nan where the physics failed."""
        return self._simulate(genomes, parameters)

    def sense(self, genomes: Genomes, parameters: Parameters) -> Outcomes:
        """Return fitness and readings `(n, m, 1 + q)` of genomes `(n, g)` in simulators `(m, p)`."""
        return self._sense(genomes, parameters)


class Helpers:
    """The helpers of a repetition, one for each idle core; they end with this object.

    A helper must start and load an engine, and other programs may use its core. So each helper first gets a rollout
    whose answer is not needed, and is ready once it has answered.
    """

    def __init__(self, spec: ResolvedSpec, versions: Versions) -> None:
        self._spec = spec.model_dump_json()
        self._versions = versions
        self._starting: dict[ray.ObjectRef[Fitnesses], Handle] = {}
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
            self._starting[helper.part.remote(genomes[:1], parameters[:1])] = helper

    def _admit(self, answer: "ray.ObjectRef[Fitnesses]") -> None:
        helper = self._starting.pop(answer)
        try:
            ray.get(answer)
            self._ready.append(helper)
        except RayError:  # its node or its process died, or has other versions
            self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)
