"""The number of rollouts that a spec costs."""

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.controller_search import Allowance
from gaplab.services.core.held_out import is_held_out
from gaplab.services.core.strategies import strategies


def expected_rollouts(spec: ResolvedSpec) -> int:
    """Return the number of simulated rollouts in one repetition; real-world evaluations do not count.

    Every tuning sees the samples from before the experiment, also that of iteration 0. The evaluations of the direct
    baseline would be real ones. They count, because they are its whole cost.
    """
    strategy, tunables = strategies.create(spec.strategy), len(spec.tunables)
    budget, iterations = spec.budget, spec.iterations if strategy.takes_samples else 0
    knows = bool(spec.reality.samples)
    selections = sum(
        Allowance.of_selection(strategy, budget.selection_evaluations, tunables, learned=number > 1 or knows).rollouts
        for number in range(1, iterations + 1)
    )
    transfer = Allowance.of_transfer(strategy, budget.controller_evaluations, tunables)
    tuning = sum(
        (iterations + 1 - number) * (1 if is_held_out(number, spec.held_out) else budget.simulator_evaluations)
        for number in range(1, iterations + 1)
    )
    tuning += len(spec.reality.samples) * (iterations + 1) * budget.simulator_evaluations
    tuned = tuning if strategy.tunes else 0
    return transfer.rollouts * (iterations + 1) + selections + tuned
