"""The rollouts of the whole of Fig. 4 with each part of the preset `lean`, as gaplab estimates them before a study."""

from collections.abc import Mapping
from typing import Any

from rich.table import Table

from benchmarks.findings import table_of
from gaplab.schemas.spec import StudySpec
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tuners import tuners
from gaplab.services.specs.presets import LEAN_OPTIMIZER, PRESETS
from gaplab.services.specs.resolution import resolve_study
from gaplab.services.specs.rollouts import expected_rollouts

LEAN = PRESETS["lean"]
WEIGHTIEST = [
    {"name": ref.name, "options": dict(strategies[ref.name].lean)} for ref in StudySpec().strategies
]  # fmt: skip

PARTS: Mapping[str, Mapping[str, Any]] = {
    "paper": {},
    "controllers alone": {
        "budget": {
            "controller_evaluations": LEAN.controller_evaluations,
            "selection_evaluations": LEAN.selection_evaluations,
        },
        "controller_optimizer": LEAN_OPTIMIZER,
    },
    "tunings alone": {"tuner": {"name": "search", "options": dict(tuners["search"].lean)}},
    "simulators of most weight alone": {"strategies": WEIGHTIEST},
    "lean": {"budget": "lean"},
}
"""Each part of `lean` alone, between the whole budgets."""


def rollouts(part: Mapping[str, Any]) -> int:
    """Return the rollouts of Fig. 4: six strategies with 40 repetitions of 10 iterations, and 100 of `direct`."""
    resolved = resolve_study(StudySpec.model_validate({"direct_repetitions": 100, **part}))
    return sum(expected_rollouts(each) * each.repetitions for each in resolved)


def count_table() -> Table:
    """Return the rollouts of Fig. 4 with each part."""
    table = table_of("Rollouts of the whole of Fig. 4", ("budget", "rollouts", "of paper"))
    whole = rollouts(PARTS["paper"])
    for name, part in PARTS.items():
        table.add_row(name, f"{rollouts(part):,}", f"{rollouts(part) / whole:.4f}")
    return table
