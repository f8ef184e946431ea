"""Recorded reality: the pool of a spec, what drives and rates a robot that repeats it, and the samples that it is."""

from collections.abc import Iterator

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.resolved import ResolvedReality, ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec, PoolRef, RealitySpec
from gaplab.services.core.arrays import Genome, Genomes, frozen
from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.core.strategies import strategies
from gaplab.services.core.strategies.base import Strategy
from gaplab.services.core.streams import stream
from gaplab.services.core.types import Outcome, Sample
from gaplab.services.world import robot_library
from gaplab.services.world.pools import Pool, fit_violations
from gaplab.services.world.robot_library import RECORDED
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.sensing import Sensors

HELD_OUT = 0.2
"""Share of a pool that is held out by default."""

WITH_OPTIONS = "estimation_exploration with select: disagreement, or weighted with information_weight alone"
"""Strategies that need no fitness with some options."""

OF_KINDS = {
    "simulated": ("engine", "parameters", "noise", "noise_unit"),
    "physical": ("bench", "repeats", "samples", "limits", "beyond"),
    RECORDED: ("pool", "held_out"),
}
"""Fields of a reality that one kind alone has."""


def is_recorded(spec: ExperimentSpec) -> bool:
    """Return whether a spec has a recorded reality."""
    return spec.reality.kind == RECORDED


def pool_of(spec: ExperimentSpec) -> Pool:
    """Return the pool of a spec whose reality is recorded.

    Raises:
        InvalidSpec: it is not known here.
    """
    ref = spec.reality.pool or PoolRef(name="none")
    return robot_library.pool(ref.sha256 or "unknown", ref.name)


def kind_violations(reality: RealitySpec) -> Iterator[Violation]:
    """Yield fields of a reality of another kind, unless they say what is so anyway."""
    usual = RealitySpec()
    for kind, names in OF_KINDS.items():
        for name in names if kind != reality.kind else ():
            if getattr(reality, name) not in (getattr(usual, name), 0):
                message = f"{name} is of a {kind} reality, and this one is {reality.kind}"
                value = reality.model_dump(mode="json")[name]
                yield Violation(f"/reality/{name}", value, message, f"left out, or kind: {kind}")


def with_recordings(spec: ExperimentSpec) -> ExperimentSpec:
    """Return a spec with a recorded reality with the controller, the task and the discrepancy of its pool.

    Raises:
        InvalidSpec: it names no pool that is known here, or another controller, task or discrepancy.
    """
    if not is_recorded(spec):
        return spec
    if spec.reality.pool is None:
        message = "a recorded reality has a pool; gaplab pool import makes one"
        raise InvalidSpec([Violation("/reality/pool", None, message, "a pool that is stored")])
    pool = pool_of(spec)
    own = PluginRef(name=RECORDED, options={"sha256": pool.sha256, "name": pool.name})
    message = "a recorded reality brings a controller and a task of its own; leave this out"
    if wrong := [
        Violation(f"/{place}", ref.name, message, "left out")
        for place in ("controller", "task")
        if (ref := getattr(spec, place)) not in (None, own)
    ]:
        raise InvalidSpec(wrong)
    changes = {"controller": own, "task": own}
    compared = spec.discrepancy if "discrepancy" in spec.model_fields_set else PluginRef(name="readings")
    if compared.name == "readings":
        seconds = float(max(0.001, pool.times_s[-1] - pool.times_s[0]))
        changes["discrepancy"] = compared.model_copy(update={"options": {"seconds": seconds, **compared.options}})
    return spec.model_copy(update=changes)


def check_recordings(spec: ExperimentSpec, robot: Robot) -> None:
    """Raise InvalidSpec, with every violation, if a spec's recordings are of another robot."""
    if is_recorded(spec) and (found := list(fit_violations(pool_of(spec), robot.world, robot.label, "/reality/pool"))):
        raise InvalidSpec(found)


def recorded_violations(spec: ExperimentSpec, strategy: Strategy) -> Iterator[Violation]:
    """Yield what a recorded reality does not have: fitness, probes, more recordings than its pool."""
    pool, probes = pool_of(spec), spec.reality.probes
    if probes not in (None, "never"):
        yield Violation("/reality/probes", probes, "a recorded reality has no probes", "left out")
    if spec.held_out:
        message = "reality/held_out is the share of the pool that no tuning sees"
        yield Violation("/held_out", spec.held_out, message, "0, or left out")
    if not discrepancies[spec.discrepancy.name].senses:
        able = [name for name, each in discrepancies.items() if each.senses]
        yield Violation("/discrepancy", spec.discrepancy.name, "recordings have readings, and no fitness", able)
    if strategy.needs_fitness or not (strategy.takes_samples or strategy.in_reality) or not strategy.tunes:
        tuning = {name: each for name, each in strategies.items() if each.tunes}
        able = [name for name, each in tuning.items() if each.in_reality or not each().needs_fitness]
        message = f"{strategy.name} selects by fitness with these options, and recordings have none"
        message = message if strategy.needs_fitness else f"{strategy.name} tunes nothing"
        permitted = f"{', '.join(able)}, {WITH_OPTIONS}"
        yield Violation("/strategy", strategy.name, message, permitted)
    if not (most := selectable(spec)):
        message = f"the pool {pool.name} has one recording, and none is left to tune on without it"
        yield Violation("/reality/held_out", spec.reality.held_out, message, "0, or a pool of at least 2 recordings")
    elif spec.iterations is not None and spec.iterations > most:
        message = f"the pool {pool.name} has {most} recordings to select, besides those held out"
        yield Violation("/iterations", spec.iterations, message, f"at most {most}")


def selectable(spec: ExperimentSpec) -> int:
    """Return the number of recordings of a spec's pool that are not held out."""
    return len(pool_of(spec).recordings) - len(held_out(spec))


def recorded_reality(spec: ExperimentSpec) -> ResolvedReality:
    """Return a recorded reality with every field."""
    pool = pool_of(spec)
    share = HELD_OUT if spec.reality.held_out is None else spec.reality.held_out
    return ResolvedReality.filled_from(
        spec.reality,
        pool=PoolRef(name=pool.name, sha256=pool.sha256),
        held_out=share,
        parameters={},
        probes="never",
    )


class RecordedReality:
    """A Reality that answers with what was measured; the fitness is 0, since nothing rates it.

    Attributes:
        candidates: `(n, 1)`: the recordings that may be selected.
        tests: samples that are held out.
        commands: `(N, c)`: commands of all recordings; None if there are none.
    """

    def __init__(self, spec: ResolvedSpec, sensors: Sensors, repetition: int) -> None:
        self._pool, self._sensors = pool_of(spec), sensors
        unseen = held_out(spec, repetition)
        numbers = [number for number in range(len(self._pool.recordings)) if number not in unseen]
        self.candidates: Genomes = frozen([[number] for number in numbers])
        self.tests = tuple(self.sample(frozen([number])) for number in unseen)
        self.commands = self._pool.commands

    def __call__(self, genome: Genome) -> Outcome:
        """Return what was measured in the recording of a genome `(1,)`."""
        readings = self._sensors.standardised(self._pool.readings(int(genome[0])))
        return Outcome(0.0, frozen(readings))

    def sample(self, genome: Genome) -> Sample:
        """Return a recording as a sample."""
        return Sample(genome, *self(genome))

    @property
    def all_samples(self) -> tuple[Sample, ...]:
        """All recordings that may be selected, as samples."""
        return tuple(self.sample(genome) for genome in self.candidates)


def held_out(spec: ExperimentSpec, repetition: int = 0) -> tuple[int, ...]:
    """Return the numbers of the recordings that no tuning sees, ascending: the same for all strategies.

    A share is chosen by the seed, and leaves at least one; of `each`, a repetition holds out one, its own.
    """
    count = len(pool_of(spec).recordings)
    share = HELD_OUT if spec.reality.held_out is None else spec.reality.held_out
    if isinstance(share, str):
        return (repetition % count,)
    most = min(max(1, round(share * count)), count - 1) if share else 0
    return tuple(sorted(stream(spec.seed, "held-out recordings").permutation(count)[:most].tolist()))
