"""What a submitted spec gets where it names none: a budget, an engine, tunables with their bounds, and a reality.

A named budget is a share of the paper's computation. With each of them, all strategies select their samples from
searches of equal size. `reuse_transfer: true` in a spec changes that: docs/decisions/a-fair-comparison.md.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from gaplab.schemas.plugin import PluginRef, TunableRef
from gaplab.schemas.resolved import ResolvedReality, ResolvedTunable
from gaplab.schemas.spec import BudgetName, ExperimentSpec, SharedSettings
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.registry import Registry
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tuners import tuners
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.specs.recorded import is_recorded, recorded_reality
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.tunables.base import BETWEEN, Tunable
from gaplab.services.world.tunables.labels import label_of, proper, tunable_of
from gaplab.services.world.world import World


@dataclass(frozen=True)
class Preset:
    """Iterations, repetitions, and the evaluations of each search.

    Options that a spec leaves out are those of a plug-in's preset of the same name, if it has one.

    Attributes:
        controller_optimizer: optimizer of controllers, if a spec leaves it out; None: that of simulators.
    """

    iterations: int
    repetitions: int
    controller_evaluations: int
    selection_evaluations: int
    simulator_evaluations: int
    controller_optimizer: str | None = None


# Source: paper, sections 2 and 3; that a selection takes as many evaluations as the final search is its reading
PAPER = Preset(10, 40, 10_000, 10_000, 2_000)

PRESETS: dict[BudgetName, Preset] = {
    # to see that it works: seconds on the toy, about a minute on PyBullet
    "smoke": Preset(2, 2, 60, 30, 60),
    # to see an effect: about an hour on two cores for a study on PyBullet
    "desk": Preset(5, 8, 500, 150, 200),
    "paper": PAPER,
    # the whole Fig. 4 at a tenth of the rollouts: docs/lean.md
    "lean": Preset(10, 40, 1_350, 1_350, 2_000, controller_optimizer="cma_es"),
    # the paper's, with the formulas as it prints them: the presets of this name
    "as_published": PAPER,
}


def with_preset(spec: ExperimentSpec) -> ExperimentSpec:
    """Return the spec with the plug-ins and options that its budget and strategy set, where it does not give them."""
    budget, kind = spec.budget.preset, strategies.get(spec.strategy.name)
    optimizer = (kind and kind.controller_optimizer) or PRESETS[budget].controller_optimizer
    of_controllers = spec.controller_optimizer or (PluginRef(name=optimizer) if optimizer else None)
    changes: dict[str, Any] = {
        "strategy": _with(budget, spec.strategy, strategies),
        "tuner": _with(budget, spec.tuner, tuners),
        "controller_optimizer": of_controllers and _with(budget, of_controllers, optimizers),
    }
    changed = {name: value for name, value in changes.items() if value != getattr(spec, name)}
    return spec.model_copy(update=changed)


def _with(budget: str, ref: PluginRef, registry: Registry[Any]) -> PluginRef:
    if ref.name not in registry:
        return ref
    plugin = registry[ref.name]
    options = {**plugin.preset(budget), **plugin.preset(ref.preset), **ref.options}
    return ref.model_copy(update={"options": options})


def default_engine(robot: Robot | type[Robot]) -> str:
    """Return the engine that the robot names, or another of gaplab's own if that one cannot run its world here.

    PyBullet has no wheels for Python 3.12 and later. There, the quadruped's engine is MuJoCo. The resolved spec records
    the choice, so a stored experiment does not depend on it.
    """
    world = (robot.example() if isinstance(robot, type) else robot).world
    named = engines.get(robot.engine)
    if named is None or (named.available() and runs(named, world) and not named.lacks(world)):
        return robot.engine
    others = (name for name, engine in engines.own.items() if engine.available())
    able = (name for name in others if runs(engines[name], world) and not engines[name].lacks(world))
    return next(able, robot.engine)


def runs(engine: type[Engine], world: World) -> bool:
    """Return whether the engine can run a robot's world; one that raises cannot."""
    try:
        return engine.runs(world)
    except Exception:  # noqa: BLE001 - an external engine concerns only the specs that name it
        return False


def with_usual_tunables(spec: ExperimentSpec, robot: Robot) -> ExperimentSpec:
    """Return the spec with the robot's usual tunables, if it names none and the robot has some."""
    if "tunables" in spec.model_fields_set or not robot.usual_tunables:
        return spec
    return spec.model_copy(update={"tunables": tuple(TunableRef(name=label) for label in robot.usual_tunables)})


def shared_fields(spec: SharedSettings, names: Iterable[str]) -> dict[str, Any]:
    """Return fields of a study's spec, or of a check's, for an experiment; those that it leaves out stay so."""
    return {name: getattr(spec, name) for name in names if name in spec.model_fields_set}


def with_bounds(ref: TunableRef, robot: Robot) -> ResolvedTunable:
    """Return a tunable by its proper label, with its bounds."""
    tunable = tunable_of(ref.name)
    lower, upper = bounds_of(ref, tunable, robot)
    return ResolvedTunable(name=label_of(tunable), lower=lower, upper=upper)


def bounds_of(ref: TunableRef, tunable: Tunable, robot: Robot) -> tuple[float, float]:
    """Return the bounds of a tunable; a missing one is the tunable's own for the robot."""
    lower, upper = tunable.bounds(robot.world)
    return lower if ref.lower is None else ref.lower, upper if ref.upper is None else ref.upper


def honoured(tunable: Tunable, engine: type[Engine]) -> bool:
    """Return whether a tunable changes what an engine simulates, or what lies between it and the sensors."""
    return tunable.field in BETWEEN or tunable.field in engine.honours


SIMULATED_PROBES, PHYSICAL_PROBES = "each", "last"
"""Which transferred controllers are measured by default."""


def completed(registry: Registry[Any], ref: PluginRef) -> PluginRef:
    """Return the reference with every option, as specs name it."""
    _, options = registry.check(ref)
    return PluginRef(name=ref.name, options=options.model_dump(mode="json", by_alias=True))


def with_proper_labels(ref: PluginRef, named: Iterable[str]) -> PluginRef:
    """Return a complete reference with the tunables that its options name by their proper labels."""
    labels = {name: proper(name) for name in named}
    options = {
        name: [labels.get(each, each) for each in value] if isinstance(value, list) else value
        for name, value in ref.options.items()
    }
    return PluginRef(name=ref.name, options=options)


def resolved_reality(spec: ExperimentSpec, robot: Robot, ref: PluginRef, engine: type[Engine]) -> ResolvedReality:
    """Return the reality of a spec with every field; the engine is that of a simulated one."""
    if is_recorded(spec):
        return recorded_reality(spec)
    if spec.reality.kind == "physical":
        return _physical_reality(spec, robot)
    return ResolvedReality.filled_from(
        spec.reality,
        engine=completed(engines, ref),
        parameters=_truth(spec, robot, engine),
        probes=spec.reality.probes or SIMULATED_PROBES,
        noise=spec.reality.noise or None,
        noise_unit=spec.reality.noise_unit or None,
    )


def _physical_reality(spec: ExperimentSpec, robot: Robot) -> ResolvedReality:
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
