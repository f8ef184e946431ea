"""The violations of a spec, each with its pointer into the spec and the permitted values."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from gaplab.schemas.mistakes import pointer_to
from gaplab.schemas.plugin import TunableRef
from gaplab.schemas.resolved import ResolvedBudget
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.strategies.base import Strategy
from gaplab.services.core.tuners.base import Tuner
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.specs.defaults import bounds_of, honoured, runs
from gaplab.services.specs.recorded import is_recorded, kind_violations, recorded_violations
from gaplab.services.world.robots import robots
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.tunables.base import Tunable
from gaplab.services.world.tunables.labels import label_of, proper, tunable_of

OF_LOOPS = {True: "observes while it acts", False: "plans its commands in advance"}
"""What a controller does that is a loop, and one that is not."""


def tunable_violations(spec: ExperimentSpec, robot: Robot, engine: type[Engine]) -> Iterator[Violation]:
    """Yield tunables that are unknown, repeated, or of what the robot lacks or the engine ignores; bounds out of range.

    The engine is that of the simulators.
    """
    counts = Counter(proper(ref.name) for ref in spec.tunables)
    for index, ref in enumerate(spec.tunables):
        pointer = f"/tunables/{index}"
        try:
            tunable = tunable_of(ref.name, pointer)
        except InvalidSpec as error:
            yield from error.violations
            continue
        yield from _place_violations(tunable, robot, engine, pointer)
        if tunable.lack(robot.world) is None:
            yield from _bound_violations(ref, tunable, robot, pointer)
        if (count := counts[label_of(tunable)]) > 1:
            yield Violation(pointer, ref.name, f"{ref.name} is named {count} times; once is permitted")


def tuning_violations(robot: Robot, discrepancy: Discrepancy, tuner: Tuner) -> Iterator[Violation]:
    """Yield a discrepancy of readings that the robot does not have, and one that the tuner cannot minimise."""
    if discrepancy.senses and not robot.sensors.size:
        able = [name for name, each in discrepancies.items() if not each.senses]
        message = f"the {robot.label} has no sensors; {' and '.join(able)} need none"
        yield Violation("/discrepancy", discrepancy.name, message, able)
    if tuner.needs_squares and not discrepancy.squares:
        able = [name for name, each in discrepancies.items() if each.squares]
        message = f"the tuner {tuner.name} needs a sum of squares, and {discrepancy.name} is not one"
        yield Violation("/discrepancy", discrepancy.name, message, able)


def strategy_violations(
    spec: ExperimentSpec, strategy: Strategy, robot: Robot, optimizer: Optimizer
) -> Iterator[Violation]:
    """Yield what a strategy lacks: sensors of the robot, tunables that it names, samples, objectives.

    The optimizer is that of controllers.
    """
    own = optimizers.get(strategy.controller_optimizer or "")
    if own is not None and own.objectives and not optimizer.objectives:
        able = [name for name, each in optimizers.items() if each.objectives]
        message = f"{strategy.name} has several objectives, and the optimizer {optimizer.name} has one"
        yield Violation("/controller_optimizer", optimizer.name, message, able)
    if spec.iterations == 0 and strategy.takes_samples and not spec.reality.samples:
        message = "0 iterations tune on samples from before alone, and the spec has none"
        yield Violation("/iterations", 0, message, "at least 1, or samples in /reality/samples")
    if strategy.senses and not robot.sensors.size:
        able = [name for name, each in robots.items() if each.example().sensors.size]
        message = (
            f"the {robot.label} has no sensors, and {strategy.name} with these options selects by readings; "
            f"robots with sensors: {', '.join(able) or 'none'}"
        )
        yield Violation("/strategy", strategy.name, message, able)
    tuned = [proper(ref.name) for ref in spec.tunables]
    for name in strategy.named_tunables:
        if proper(name) not in tuned:
            message = f"{strategy.name} names {name}, which the spec does not tune; it tunes {' and '.join(tuned)}"
            yield Violation("/strategy/options", name, message, tuned)


def engine_violations(robot: Robot, places: Mapping[type[Engine], str]) -> Iterator[Violation]:
    """Yield what the robot's world uses and an engine does not honour, and what its motions need and an engine cannot.

    Each engine has its place in the spec.
    """
    start = robot.motion(robot.known).start
    needs = {
        "closes_loops": (robot.loops, "the controller of the {} observes while it acts, and {} closes no loop"),
        "tells_joints": (robot.joints, "the task of the {} needs its joints, and {} tells nothing about them"),
        "sets_starts": (start is not None, "a motion of the {} says how it begins, and {} begins as the world does"),
    }
    able = {name: each for name, each in engines.items() if runs(each, robot.world)}
    for engine, pointer in places.items():
        for field in engine.lacks(robot.world):
            others = [name for name, each in able.items() if field not in each.lacks(robot.world)]
            message = f"the {robot.label} uses {field}, which {engine.name} does not honour; {able_to(others)}"
            yield Violation(pointer, engine.name, message, others)
        for can, (needed, why) in needs.items():
            if needed and not getattr(engine, can):
                others = [name for name, each in able.items() if getattr(each, can)]
                message = f"{why.format(robot.label, engine.name)}; {able_to(others)}"
                yield Violation(pointer, engine.name, message, others)


def able_to(able: Sequence[str]) -> str:
    """Return which engines do what another does not, for a sentence."""
    return f"{' and '.join(able) or 'no engine'} {'do' if len(able) > 1 else 'does'}"


def _bound_violations(ref: TunableRef, tunable: Tunable, robot: Robot, pointer: str) -> Iterator[Violation]:
    lower, upper = bounds_of(ref, tunable, robot)
    for side in ("lower", "upper"):
        if (given := getattr(ref, side)) is not None:
            yield from _range_violations(tunable, given, f"{pointer}/{side}")
    if lower >= upper:
        yield Violation(pointer, [lower, upper], f"lower must be below upper, not {lower:g} and {upper:g}")


def _range_violations(tunable: Tunable, value: float, pointer: str) -> Iterator[Violation]:
    if not tunable.least <= value <= tunable.greatest:
        permitted = f"{tunable.least:g} to {tunable.greatest:g}"
        yield Violation(pointer, value, f"{label_of(tunable)} must be from {permitted}, not {value:g}", permitted)


def _place_violations(tunable: Tunable, robot: Robot, engine: type[Engine], pointer: str) -> Iterator[Violation]:
    name = label_of(tunable)
    if (lack := tunable.lack(robot.world)) is not None:
        why, permitted = lack
        yield Violation(pointer, name, f"{name}: {why}", permitted)
    yield from _reading_violations(tunable, robot, pointer)
    if not honoured(tunable, engine):
        able = [each.name for each in engines.values() if honoured(tunable, each)]
        message = f"{engine.name} does not honour {name}; {able_to(able)}"
        yield Violation(pointer, name, message, able)


def _reading_violations(tunable: Tunable, robot: Robot, pointer: str) -> Iterator[Violation]:
    """Yield a tunable of commands that are known in advance or of sensors, if the robot has none of these."""
    name = label_of(tunable)
    if tunable.of_loops not in {None, robot.loops}:
        of, other = OF_LOOPS[bool(tunable.of_loops)], OF_LOOPS[robot.loops]
        message = f"{name} is of a controller that {of}, and that of the {robot.label} {other}"
        yield Violation(pointer, name, message, f"left out, or a controller that {of}")
    sensors, read = tunable.sensors(robot.world), robot.sensors.names
    if sensors and not robot.loops and not {*sensors} & {*read}:
        message = f"{name} is of {' and '.join(sensors)}, and the {robot.label} reads {' and '.join(read) or 'nothing'}"
        yield Violation(pointer, name, f"{message}; a task may read more", "a task that reads it")


def reality_violations(
    spec: ExperimentSpec, strategy: Strategy, robot: Robot, *, simulated: type[Engine], engine: type[Engine]
) -> Iterator[Violation]:
    """Yield fields of reality of another kind; parameters that are unknown or out of range; direct use of hardware.

    `simulated` is the engine of the simulators, `engine` that of reality.
    """
    yield from kind_violations(spec.reality)
    if is_recorded(spec):
        yield from recorded_violations(spec, strategy)
        return
    if spec.reality.kind == "physical":
        yield from _physical_violations(spec, strategy)
        return
    if strategy.in_reality and engine is not simulated and not engine.repeatable:
        message = f"{strategy.name} evolves in reality itself, and the engine {engine.name!r} may move hardware"
        yield Violation("/strategy", strategy.name, message, "another strategy, or an engine with `repeatable = True`")
    yield from parameter_violations(spec.reality.parameters, robot, engine, ("reality", "parameters"))
    yield from _noise_violations(spec, strategy)
    if engine is not simulated and not engine.repeatable:
        for name in ("noise", "noise_unit"):
            if given := getattr(spec.reality, name):
                message = f"the engine {engine.name!r} may move hardware, whose measurements have noise of their own"
                yield Violation(f"/reality/{name}", given, message, "left out")


def _noise_violations(spec: ExperimentSpec, strategy: Strategy) -> Iterator[Violation]:
    """Yield noise as a share of the scale of fitness, if it has a size too, or there is no scale."""
    if spec.reality.noise and spec.reality.noise_unit:
        message = "noise is a share of the scale of fitness and noise_unit its size; a reality has one of them"
        yield Violation("/reality/noise", spec.reality.noise, message, "left out, or without noise_unit")
    if spec.reality.noise and not strategy.transfer_simulators(1):
        message = f"{strategy.name} searches for nothing to transfer, so fitness has no scale that noise is a share of"
        yield Violation("/reality/noise", spec.reality.noise, message, "noise_unit, in the unit of fitness")


def parameter_violations(
    parameters: Mapping[str, float], robot: Robot, engine: type[Engine], place: Sequence[str | int]
) -> Iterator[Violation]:
    """Yield values of tunables that are unknown, out of range, of what the robot lacks, or ignored by the engine.

    `place` are the names and numbers that lead to them.
    """
    for name, value in parameters.items():
        pointer = pointer_to([*place, name])
        try:
            tunable = tunable_of(name, pointer)
        except InvalidSpec as error:
            yield from error.violations
            continue
        yield from _place_violations(tunable, robot, engine, pointer)
        yield from _range_violations(tunable, value, pointer)


def _physical_violations(spec: ExperimentSpec, strategy: Strategy) -> Iterator[Violation]:
    reality = spec.reality
    if strategy.in_reality:
        message = f"{strategy.name} evolves in reality itself, in thousands of evaluations of the physical robot"
        yield Violation("/strategy", strategy.name, message, "another strategy, or a simulated reality")
    if reality.probes == "never" and not strategy.takes_samples:
        message = f"{strategy.name} takes no samples, so without probes nothing would be measured"
        yield Violation("/reality/probes", reality.probes, message, ["each", "last"])


def budget_violations(
    budget: ResolvedBudget,
    strategy: Strategy,
    tunables: int,
    optimizers: tuple[Optimizer, Optimizer],
    tuner: Tuner,
    divisor: int,
) -> Iterator[Violation]:
    """Yield searches whose budget is smaller than what they begin with: of most, a population.

    Args:
        budget: with every number.
        strategy: selects and transfers.
        tunables: number of tunables.
        optimizers: of controllers, and of simulators, if the tuner uses one.
        tuner: finds simulators.
        divisor: number that divides the evaluations of the last tuning.
    """
    of_controllers, of_simulators = optimizers
    least, shared = of_controllers.least_evaluations, strategy.equal_rollouts
    transfer = strategy.transfer_simulators(tunables) if shared else 1
    needed = {"controller_evaluations": (budget.controller_evaluations, least, transfer, "simulators")}
    if strategy.searches and strategy.takes_samples:
        selection = strategy.selection_simulators(tunables, learned=False) if shared else 1
        needed["selection_evaluations"] = (budget.selection_evaluations, least, selection, "simulators")
    if strategy.takes_samples and strategy.tunes:
        needed["simulator_evaluations"] = (
            budget.simulator_evaluations,
            tuner.least_evaluations(of_simulators, strategy.ensemble),
            divisor,
            "samples",
        )
    for name, (given, population, count, what) in needed.items():
        minimum = population * count
        if given < minimum:
            message = f"{given} evaluations are fewer than the {population} that the search needs to begin"
            message += f"; equal_rollouts divides them by {count} {what}" if count > 1 else ""
            yield Violation(f"/budget/{name}", given, message, f"at least {minimum}")
