"""The named budgets, each a share of the paper's computation, and what they set besides numbers.

With each of them, all strategies select their samples from searches of equal size. `reuse_transfer: true` in a spec
changes that: docs/decisions/a-fair-comparison.md.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.spec import BudgetName, ExperimentSpec
from gaplab.services.core.registry import Plugin, Registry
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tuners import tuners


@dataclass(frozen=True)
class Preset:
    """Iterations, repetitions, and the evaluations of each search.

    Attributes:
        as_published: true if options that a spec leaves out are those of the plain, published formulas.
        lean: true if options and the optimizer of controllers that a spec leaves out save rollouts.
    """

    iterations: int
    repetitions: int
    controller_evaluations: int
    selection_evaluations: int
    simulator_evaluations: int
    as_published: bool = False
    lean: bool = False


# Source: paper, sections 2 and 3; that a selection takes as many evaluations as the final search is its reading
PAPER = Preset(10, 40, 10_000, 10_000, 2_000)

PRESETS: dict[BudgetName, Preset] = {
    # to see that it works: seconds on the toy, about a minute on PyBullet
    "smoke": Preset(2, 2, 60, 30, 60),
    # to see an effect: about an hour on two cores for a study on PyBullet
    "desk": Preset(5, 8, 500, 150, 200),
    "paper": PAPER,
    # the whole Fig. 4 at a tenth of the rollouts: docs/lean.md
    "lean": Preset(10, 40, 1_350, 1_350, 2_000, lean=True),
    "as_published": replace(PAPER, as_published=True),
}

LEAN_OPTIMIZER = PluginRef(name="cma_es")
"""Optimizer of controllers of a lean budget."""


def with_preset(spec: ExperimentSpec) -> ExperimentSpec:
    """Return the spec with the plug-ins and options that its preset sets, where the spec does not give them."""
    preset = PRESETS[spec.budget.preset]
    if not (preset.as_published or preset.lean):
        return spec
    changes: dict[str, Any] = {
        "strategy": _with(preset, spec.strategy, strategies),
        "tuner": _with(preset, spec.tuner, tuners),
    }
    if preset.lean:
        changes["controller_optimizer"] = spec.controller_optimizer or LEAN_OPTIMIZER
    return spec.model_copy(update=changes)


def preset_options(preset: Preset, kind: type[Plugin]) -> Mapping[str, Any]:
    """Return the options of a plug-in that a preset sets."""
    if preset.as_published:
        return kind.published
    return kind.lean if preset.lean else {}


def _with(preset: Preset, ref: PluginRef, registry: Registry[Any]) -> PluginRef:
    options = preset_options(preset, registry[ref.name]) if ref.name in registry else {}
    return PluginRef(name=ref.name, options={**options, **ref.options})
