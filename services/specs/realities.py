"""Reality of a submitted spec, with every default."""

from typing import Any

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.resolved import ResolvedReality
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.registry import Registry
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.tunables.labels import label_of, proper, tunable_of
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.specs.tunables import honoured

SIMULATED_PROBES, PHYSICAL_PROBES = "each", "last"
"""Which transferred controllers are measured by default."""


def completed(registry: Registry[Any], ref: PluginRef) -> PluginRef:
    """Return the reference with every option, as specs name it."""
    _, options = registry.check(ref)
    return PluginRef(name=ref.name, options=options.model_dump(mode="json", by_alias=True))


def simulated_reality(spec: ExperimentSpec, robot: Robot, ref: PluginRef, engine: type[Engine]) -> ResolvedReality:
    """Return a simulated reality with every field."""
    return ResolvedReality(
        kind="simulated",
        engine=completed(engines, ref),
        parameters=_truth(spec, robot, engine),
        bench=None,
        repeats=1,
        probes=spec.reality.probes or SIMULATED_PROBES,
        samples=(),
        limits=None,
        beyond="warn",
    )


def physical_reality(spec: ExperimentSpec, robot: Robot) -> ResolvedReality:
    """Return a physical reality with every field."""
    return ResolvedReality.filled_from(
        spec.reality,
        engine=None,
        parameters={},
        bench=spec.reality.bench or robot.label,
        probes=spec.reality.probes or ("never" if spec.iterations == 0 else PHYSICAL_PROBES),
    )


def _truth(spec: ExperimentSpec, robot: Robot, engine: type[Engine]) -> dict[str, float]:
    """Return the given parameters of reality, and the robot's for other tunables that reality's engine honours.

    A group of unequal parts has no number that would leave the robot as it is: reality has none then.
    """
    world = robot.world
    nominal = {
        label_of(tunable): value
        for tunable in (tunable_of(ref.name) for ref in spec.tunables)
        if honoured(tunable, engine) and tunable.edit(world, value := tunable.read(world)) == world
    }
    return {**nominal, **{proper(label): value for label, value in spec.reality.parameters.items()}}
