"""The number of rollouts that a spec costs."""

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.controller_search import Allowance
from gaplab.services.core.held_out import seen_of
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tuners import tuners
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
    tuned = sum(_of_tuning(spec, number) for number in range(iterations + 1)) if strategy.tunes else 0
    return transfer.rollouts * (iterations + 1) + selections + tuned


def _of_tuning(spec: ResolvedSpec, iteration: int) -> int:
    """Return the rollouts of the tuning of an iteration, with the tests on samples that are held out."""
    samples = iteration + len(spec.reality.samples)
    seen = seen_of(samples, spec.held_out)
    return spec.budget.simulator_evaluations // tuners.create(spec.tuner).divisor(seen) * seen + samples - seen
