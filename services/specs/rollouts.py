"""What follows from a resolved spec: the number of rollouts that it costs, and the hardware that it moves."""

from hashlib import sha256

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.search import Allowance
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tuners import tuners
from gaplab.services.core.tuning import seen_of
from gaplab.services.engines import engines
from gaplab.services.specs.blame import refusing_specs


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
    known = bool(spec.reality.samples)
    selections = sum(
        Allowance.of_selection(strategy, budget.selection_evaluations, tunables, learned=number > 1 or known).rollouts
        for number in range(1, iterations + 1)
    )
    transfer = Allowance.of_transfer(strategy, budget.controller_evaluations, tunables)
    tuned = sum(_of_tuning(spec, number) for number in range(iterations + 1)) if strategy.takes_samples else 0
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
