"""Resolution: from a submitted spec to a resolved one, with every default; all violations are raised together.

From a resolved spec follow the number of rollouts that it costs, and the hardware that it moves.
"""

from bisect import bisect_right
from collections import Counter
from collections.abc import Sequence
from hashlib import sha256
from typing import Any

from gaplab.schemas.costs import Stop
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.resolved import ResolvedBudget, ResolvedSpec
from gaplab.schemas.sensitivity import Checked, SensitivitySpec
from gaplab.schemas.spec import ExperimentSpec, SharedSettings, StudySpec
from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.errors import InvalidSpec, Violation, gather
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.registry import Registry
from gaplab.services.core.search import Allowance
from gaplab.services.core.strategies import strategies
from gaplab.services.core.strategies.base import Strategy
from gaplab.services.core.tuners import tuners
from gaplab.services.core.tuners.base import Tuner
from gaplab.services.core.tuning import seen_of
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.specs.blame import refusing_specs
from gaplab.services.specs.defaults import (
    PRESETS,
    Preset,
    completed,
    default_engine,
    resolved_reality,
    runs,
    shared_fields,
    with_bounds,
    with_preset,
    with_proper_labels,
    with_usual_tunables,
)
from gaplab.services.specs.measured import bench_violations
from gaplab.services.specs.recorded import check_recordings, is_recorded, pool_of, selectable, with_recordings
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.violations import (
    budget_violations,
    engine_violations,
    reality_violations,
    strategy_violations,
    tunable_violations,
    tuning_violations,
)
from gaplab.services.world.controllers import controllers
from gaplab.services.world.robots import robots
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.tasks import tasks

NEED_NO_OTHERS: tuple[Registry[Any], ...] = (
    robots,
    controllers,
    tasks,
    strategies,
    optimizers,
    discrepancies,
    tuners,
)
"""The kinds of plug-ins of a spec that can be created without others; the field of each has the name of its kind."""


@refusing_specs()
def resolve_experiment(spec: ExperimentSpec) -> ResolvedSpec:
    """Return the spec with every field, as it is stored and run. Resolving it again changes nothing.

    Raises:
        InvalidSpec: with every violation, each with its pointer into the spec; or an external plug-in raised an error.
    """
    resolved = _complete(spec)
    return resolved if spec.stop is None or is_direct(spec) else _affordable(resolved, spec.stop)


def _complete(spec: ExperimentSpec) -> ResolvedSpec:
    """Return the spec with every field, and all of its iterations."""
    spec, preset = with_recordings(with_preset(spec)), PRESETS[spec.budget.preset]
    robot, strategy, controllers, simulators, discrepancy, tuner = _created(spec)
    check_recordings(spec, robot)  # a motion of another robot says nothing
    spec = with_usual_tunables(spec, robot)
    simulated = spec.engine or PluginRef(name=default_engine(robot))
    own = spec.reality.engine if spec.reality.kind == "simulated" else None
    real, place = own or simulated, "/reality/engine" if own else "/engine"
    engine, reality_engine = gather(lambda: usable(simulated, robot, "/engine"), lambda: usable(real, robot, place))
    budget, iterations = _budget(spec, preset), _iterations(spec, strategy, preset)
    divisor = tuner.divisor(seen_of(iterations + len(spec.reality.samples), spec.held_out))
    if violations := [
        *engine_violations(robot, {reality_engine: "/reality/engine", engine: "/engine"}),
        *tunable_violations(spec, robot, engine),
        *strategy_violations(spec, strategy, robot, controllers),
        *tuning_violations(robot, discrepancy, tuner),
        *reality_violations(spec, strategy, robot, simulated=engine, engine=reality_engine),
        *bench_violations(spec, robot, discrepancy),
        *budget_violations(budget, strategy, len(spec.tunables), (controllers, simulators), tuner, divisor),
    ]:
        raise InvalidSpec(violations)
    plugins = {each.kind: (ref := getattr(spec, each.kind)) and completed(each, ref) for each in NEED_NO_OTHERS}
    plugins["strategy"] = with_proper_labels(plugins["strategy"], strategy.named_tunables)
    return ResolvedSpec.filled_from(
        spec,
        **plugins,
        stop=None,
        name=spec.name or _label(strategy, spec),
        iterations=iterations,
        repetitions=spec.repetitions or preset.repetitions,
        controller_optimizer=completed(optimizers, spec.controller_optimizer or spec.optimizer),
        engine=completed(engines, simulated),
        tunables=tuple(with_bounds(ref, robot) for ref in spec.tunables),
        reality=resolved_reality(spec, robot, real, reality_engine),
        budget=budget,
    )


def _affordable(spec: ResolvedSpec, stop: Stop) -> ResolvedSpec:
    """Return a spec with as many of its iterations as are expected to stay within a cost.

    Raises:
        InvalidSpec: not even the first does.
    """
    planned = spec.iterations if takes_samples(spec) else 0

    def cost(iterations: int) -> float:
        return stop.of(iterations, expected_rollouts(spec.model_copy(update={"iterations": iterations})), 0.0)

    if (least := cost(min(1, planned))) > stop.at:
        message = f"{spec.name} takes {least:.6g} until its first result, which exceeds {stop.at:.6g}"
        raise InvalidSpec([Violation("/stop/at", stop.at, message, f"at least {least:.6g}")])
    iterations = bisect_right(range(planned + 1), stop.at, key=cost) - 1
    return spec.model_copy(update={"iterations": iterations}) if planned else spec


def _iterations(spec: ExperimentSpec, strategy: Strategy, preset: Preset) -> int:
    """Return the iterations of a spec; of a recorded reality, all recordings unless it says otherwise."""
    if is_recorded(spec) and (spec.iterations is None or not strategy.takes_samples):
        return selectable(spec)
    return preset.iterations if spec.iterations is None else spec.iterations


def _created(spec: ExperimentSpec) -> tuple[Robot, Strategy, Optimizer, Optimizer, Discrepancy, Tuner]:
    """Return the plug-ins of a spec that need no others to be created; of the optimizers, that of controllers first."""
    given = spec.controller_optimizer
    return gather(
        lambda: robot_of(spec),
        lambda: strategies.create(spec.strategy, "/strategy"),
        lambda: optimizers.create(given or spec.optimizer, "/controller_optimizer" if given else "/optimizer"),
        lambda: optimizers.create(spec.optimizer, "/optimizer"),
        lambda: discrepancies.create(spec.discrepancy, "/discrepancy"),
        lambda: tuners.create(spec.tuner, "/tuner"),
    )


def resolve(spec: StudySpec | ExperimentSpec) -> tuple[ResolvedSpec, ...]:
    """Return the resolved spec of each experiment of a study, in the order of its strategies; or of one experiment.

    Raises:
        InvalidSpec: with every violation, each with its pointer into the spec, once.
    """
    if isinstance(spec, ExperimentSpec):
        return (resolve_experiment(spec),)
    shared = shared_fields(spec, StudySpec.model_fields.keys() & ExperimentSpec.model_fields.keys())
    resolved: list[ResolvedSpec] = []
    violations: dict[tuple[str, str], Violation] = {}
    for index, strategy in enumerate(spec.strategies):
        experiment = ExperimentSpec(**{**shared, "name": None}, strategy=strategy)
        if spec.direct_repetitions is not None and is_direct(experiment):
            experiment = experiment.model_copy(update={"repetitions": spec.direct_repetitions})
        try:
            resolved.append(resolve_experiment(experiment))
        except InvalidSpec as error:
            found = (each.moved("/strategy", f"/strategies/{index}") for each in error.violations)
            violations.update({(each.pointer, each.message): each for each in found})
    if violations:
        raise InvalidSpec(violations.values())
    return _named_apart(resolved)


def _named_apart(resolved: Sequence[ResolvedSpec]) -> tuple[ResolvedSpec, ...]:
    """Return the specs of a study with distinct names: options that differ are in them, equal specs get numbers."""
    often, met = Counter(spec.name for spec in resolved), Counter[str]()
    named = []
    for spec in resolved:
        met[spec.name] += 1
        number = f" ({met[spec.name]})"
        name = spec.name[: 200 - len(number)] + number if often[spec.name] > 1 else spec.name
        named.append(spec.model_copy(update={"name": name}))
    return tuple(named)


def resolve_sensitivity(spec: SensitivitySpec) -> Checked:
    """Return the complete subject of a sensitivity check.

    Raises:
        InvalidSpec: with every violation, as an experiment with these settings would have.
    """
    shared = shared_fields(spec, SharedSettings.model_fields)
    resolved = resolve_experiment(ExperimentSpec(**shared, strategy=PluginRef(name="random")))
    return Checked.filled_from(resolved, points=spec.points, evaluations=spec.evaluations)


def is_direct(spec: ExperimentSpec) -> bool:
    """Return whether the experiment is the direct baseline, evolution in reality itself."""
    return spec.strategy.name in strategies and strategies[spec.strategy.name].in_reality


def takes_samples(spec: ExperimentSpec) -> bool:
    """Return whether the experiment takes samples; one without them has iteration 0 only, and a level for a curve."""
    return spec.strategy.name not in strategies or strategies[spec.strategy.name].takes_samples


def usable(ref: PluginRef, robot: Robot, pointer: str) -> type[Engine]:
    """Return an engine that can run a robot's world here.

    Raises:
        InvalidSpec: it is unknown, not installed, or cannot run it; the pointer is its place in the spec.
    """
    engine, _ = engines.check(ref, pointer)
    able = [name for name, each in engines.items() if runs(each, robot.world)]
    if ref.name not in able:
        why = engine.exceeded(robot.world)
        message = f"{ref.name} cannot run the {robot.label}{f', since {why}' if why else ''}; {' and '.join(able)} can"
        raise InvalidSpec([Violation(pointer, ref.name, message, able)])
    if not engine.available():
        installed = [name for name in able if engines[name].available()]
        raise InvalidSpec(
            [Violation(pointer, ref.name, f"the engine {ref.name} is not installed here: {engine.install}", installed)]
        )
    return engine


def _label(strategy: Strategy, spec: ExperimentSpec) -> str:
    """Return what an experiment is called: its strategy, a preset that it names, and the options that differ."""
    kind, preset = type(strategy), spec.strategy.preset
    usual = {**kind.preset(spec.budget.preset), **kind.preset(preset)}
    defaults = kind.Options(**usual).model_dump(mode="json", by_alias=True)
    chosen = strategy.options.model_dump(mode="json", by_alias=True)
    changed = [f"{name} {value}" for name, value in chosen.items() if value != defaults[name]]
    told = [*([preset] if preset else []), *changed]
    return f"{strategy.name} ({', '.join(told)})"[:200] if told else strategy.name


def _budget(spec: ExperimentSpec, preset: Preset) -> ResolvedBudget:
    searches = ("controller_evaluations", "selection_evaluations", "simulator_evaluations")
    given = {name: getattr(spec.budget, name) or getattr(preset, name) for name in searches}
    return ResolvedBudget.filled_from(spec.budget, **given)


@refusing_specs()
def expected_rollouts(spec: ResolvedSpec) -> int:
    """Return the number of simulated rollouts in one repetition; real-world evaluations do not count.

    Every tuning sees the samples from before the experiment, also that of iteration 0. The evaluations of the direct
    baseline would be real ones. They count, because they are its whole cost.

    Raises:
        InvalidSpec: an external plug-in raised an error.
    """
    strategy, tunables = strategies.create(spec.strategy), len(spec.tunables)
    budget, iterations = spec.budget, spec.iterations if strategy.takes_samples else 0
    known, most = bool(spec.reality.samples), budget.selection_evaluations
    recordings = selectable(spec) if is_recorded(spec) else most + iterations
    selections = sum(
        Allowance.of_selection(
            strategy, min(most, recordings - number + 1), tunables, learned=number > 1 or known
        ).rollouts
        for number in range(1, iterations + 1)
    )
    if is_recorded(spec):
        tests = len(pool_of(spec).recordings) - recordings
        counts = range(iterations + 1) if strategy.takes_samples else [recordings]
        return selections + sum(_of_tuning(spec, samples) + tests for samples in counts)
    transfer = Allowance.of_transfer(strategy, budget.controller_evaluations, tunables)
    tunes = strategy.takes_samples and strategy.tunes
    tuned = sum(_of_tuning(spec, number) for number in range(iterations + 1)) if tunes else 0
    return transfer.rollouts * (iterations + 1) + selections + tuned


def _of_tuning(spec: ResolvedSpec, iteration: int) -> int:
    """Return the rollouts of the tuning of an iteration, with the tests on samples that are held out."""
    samples = iteration + len(spec.reality.samples)
    seen = seen_of(samples, spec.held_out)
    return spec.budget.simulator_evaluations // tuners.create(spec.tuner).divisor(seen) * seen + samples - seen


def is_computed(spec: ResolvedSpec) -> bool:
    """Return whether reality is only computed, so that asking it moves nothing."""
    return spec.reality.engine is not None and hardware_of(spec) is None


def hardware_of(spec: ResolvedSpec) -> str | None:
    """Return the name of the hardware that is reality, or None if reality is only computed, or on a bench.

    Equal engines with equal options are the same hardware. An engine that also runs the simulators is computed.
    """
    ref = spec.reality.engine
    if ref is None or ref.name == spec.engine.name or ref.name not in engines or engines[ref.name].repeatable:
        return None
    return f"{ref.name[:20]}-{sha256(ref.model_dump_json().encode()).hexdigest()[:10]}"
