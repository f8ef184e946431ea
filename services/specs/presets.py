"""The named budgets, each a share of the paper's computation.

With each of them, all strategies select their samples from searches of equal size. `reuse_transfer: true` in a spec
changes that: docs/decisions/a-fair-comparison.md.
"""

from dataclasses import dataclass, replace

from gaplab.schemas.spec import BudgetName


@dataclass(frozen=True)
class Preset:
    """Iterations, repetitions, and the evaluations of each search.

    Attributes:
        as_published: true if options that a spec leaves out are those of the plain, published formulas.
    """

    iterations: int
    repetitions: int
    controller_evaluations: int
    selection_evaluations: int
    simulator_evaluations: int
    as_published: bool = False


# Source: paper, sections 2 and 3; that a selection takes as many evaluations as the final search is its reading
PAPER = Preset(10, 40, 10_000, 10_000, 2_000)

PRESETS: dict[BudgetName, Preset] = {
    # to see that it works: seconds on the toy, about a minute on PyBullet
    "smoke": Preset(2, 2, 60, 30, 60),
    # to see an effect: about an hour on two cores for a study on PyBullet
    "desk": Preset(5, 8, 500, 150, 200),
    "paper": PAPER,
    "as_published": replace(PAPER, as_published=True),
}
