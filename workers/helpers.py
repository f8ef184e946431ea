"""Processes on idle cores that do parts of one repetition's calls."""

from collections.abc import Sequence
from functools import cache
from time import monotonic
from typing import Any, TypeAlias

import ray
from ray.exceptions import RayError

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import Fitnesses, Genomes, Parameters
from gaplab.services.core.ports import Simulate
from gaplab.services.specs.assembly import setting
from gaplab.workers.nodes import Versions, check_here

LOOK_S = 1.0
"""How often it is looked which cores are idle."""

LONGEST_PAUSE_S = 30.0
"""Cores that were no help are tried again after a pause that doubles each time, up to this."""

Handle: TypeAlias = Any
"""Of an actor; Ray types it no further."""


@ray.remote(max_restarts=0)
class Helper:
    """A process that simulates what it is asked to.

    Ray places it where a core is idle, and counts that core as idle still: a repetition that comes next gets it.
    """

    def __init__(self, spec: str, expected: Versions) -> None:
        check_here(expected)
        self._simulate = _simulation(spec)

    def part(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """`(n, g)` genomes × `(m, p)` parameters -> `(n, m)` fitnesses; nan where the physics failed."""
        return self._simulate(genomes, parameters)


@cache
def _simulation(spec: str) -> Simulate:
    return setting(ResolvedSpec.model_validate_json(spec), 0).simulate


class Helpers:
    """As many as there are idle cores; they end with this object.

    A process has to start and to load an engine, and its core may be taken by what Ray knows nothing of. So each is
    first asked for what nobody waits for, and counts once it has answered.
    """

    def __init__(self, spec: ResolvedSpec, versions: Versions) -> None:
        self._spec = spec.model_dump_json()
        self._versions = versions
        self._starting: dict[ray.ObjectRef[Fitnesses], Handle] = {}
        self._ready: list[Handle] = []
        self._idle = 0
        self._looked = -LOOK_S
        self._pause_s = LOOK_S

    def ready(self, genomes: Genomes, parameters: Parameters) -> list[Handle]:
        """Those that would help with rollouts of these genomes and parameters now."""
        if monotonic() - self._looked > self._pause_s:
            self._look(genomes, parameters)
        if self._starting:
            answered, _ = ray.wait(list(self._starting), num_returns=len(self._starting), timeout=0)
            for answer in answered:
                self._meet(answer)
        return self._ready

    def helped(self, but_for: Sequence[Handle] = ()) -> None:
        """They were worth asking, but for these: others take their places at the next look."""
        self._ready = [each for each in self._ready if each not in but_for]
        self._pause_s = LOOK_S

    def failed(self) -> None:
        """What they were asked for took longer than it would have taken here: they are ended."""
        for helper in (*self._ready, *self._starting.values()):
            ray.kill(helper)
        self._ready, self._starting = [], {}
        self._looked = monotonic()
        self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)

    def _look(self, genomes: Genomes, parameters: Parameters) -> None:
        self._looked = monotonic()
        before, self._idle = self._idle, int(ray.available_resources().get("CPU", 0))
        del self._ready[max(before, self._idle) :]  # Ray counts a core as taken for a moment now and then
        useful = len(genomes) * len(parameters) - 1
        for _ in range(min(self._idle, useful) - len(self._ready) - len(self._starting)):
            helper = Helper.remote(self._spec, self._versions)  # type: ignore[attr-defined]  # Ray adds it
            self._starting[helper.part.remote(genomes[:1], parameters[:1])] = helper

    def _meet(self, answer: "ray.ObjectRef[Fitnesses]") -> None:
        helper = self._starting.pop(answer)
        try:
            ray.get(answer)
            self._ready.append(helper)
        except RayError:  # its node or its process died, or has other versions
            self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)
