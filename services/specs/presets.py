"""The named budgets, each a share of the paper's computation.

With the smoke and desk budgets, *simulated fit* selects from a larger search than the other strategies, unless
`reuse_transfer` is off: docs/decisions/no-wasted-rollout.md.
"""

from dataclasses import dataclass

from gaplab.schemas.spec import BudgetName


@dataclass(frozen=True)
class Preset:
    """Iterations, repetitions, and the evaluations of each search."""

    iterations: int
    repetitions: int
    controller_evaluations: int
    selection_evaluations: int
    simulator_evaluations: int


PRESETS: dict[BudgetName, Preset] = {
    # to see that it works: seconds on the toy, about a minute on PyBullet
    "smoke": Preset(2, 2, 60, 30, 60),
    # to see an effect: about an hour on two cores for a study on PyBullet
    "desk": Preset(5, 8, 500, 150, 200),
    # Source: paper, sections 2 and 3; that a selection takes as many evaluations as the final search is its reading
    "paper": Preset(10, 40, 10_000, 10_000, 2_000),
}
