"""The systems that are compared, and what each needs: its strategy, and settings that it does not share with all."""

from dataclasses import dataclass
from pathlib import Path

from benchmarks.systems.judging import DESK, Arm, Reads, Spec, arms

NOISE = 0.05
"""Standard deviation of the noise, m/s: 0.1 of about what `direct` reaches at desk scale."""

REALITIES: dict[str, Spec] = {
    "inside": {},
    "inside-noisy": {"noise_unit": NOISE},
    "outside": {"engine": "physx"},
    "outside-noisy": {"engine": "physx", "noise_unit": NOISE},
}
"""Realities within the span of the simulators, which are of MuJoCo, and beyond it: no MuJoCo is PhysX."""

READINGS: Spec = {"discrepancy": "readings"}
IN_TURN: Spec = {
    "preset": "desk",
    "controller_evaluations": 100,
    "selection_evaluations": 100,
    "simulator_evaluations": 50,
}
WARM: Spec = {"name": "search", "options": {"warm_start": True}}

SETTINGS: dict[str, Spec] = {
    "fitness": {},
    "lean": {},
    "untuned": {},
    "cited": {},
    "later": {},
    "gauss-newton": READINGS | {"tuner": "gauss_newton"},
    "abc-smc": READINGS | {"tuner": "abc_smc"},
    "climbers": READINGS | {"tuner": "climbers"},
    "absolute": {"discrepancy": "absolute_fitness"},
    "simopt": {
        "discrepancy": {"name": "readings", "options": {"absolute_weight": 0.5}},
        "tuner": "simopt",
    },
    "turns": {"tuner": WARM, "budget": IN_TURN},
    "six": {"tunables": ["dynamic_friction", "static_friction", "restitution", "motor_gain", "mass", "length_scale"]},
}
"""What studies have beside `DESK`, by the last part of their names; some differ in their strategies alone."""

DISTRIBUTION: Spec = {"name": "weighted", "preset": "chebotar_2019", "options": {"simulators": 5}}
"""With 20 draws for each evaluation of a controller it would have ten times the rollouts of others."""

PAPER, CITED, LATER, UNTUNED, BASE = "the paper's", "cited", "later", "without samples", "in reality"


@dataclass(frozen=True)
class Row:
    """A system.

    Attributes:
        name: in the table.
        group: where it is from.
        strategy: as in a spec.
        settings: key of `SETTINGS`.
    """

    name: str
    group: str
    strategy: str | Spec
    settings: str = "fitness"


def _lean(name: str) -> Spec:
    """Return a strategy whose selections are scored by the ten weightiest of its 20 simulators."""
    return {"name": name, "preset": "lean"}


ROWS = [
    Row("random", PAPER, "random"),
    Row("known fit", PAPER, "known_fit"),
    Row("informative", PAPER, _lean("informative"), "lean"),
    Row("simulated fit", PAPER, "simulated_fit"),
    Row("simulated fit and unique", PAPER, "simulated_fit_and_unique"),
    Row("simulated fit and informative", PAPER, _lean("simulated_fit_and_informative"), "lean"),
    Row("simulated fit, six tunables", PAPER, "simulated_fit", "six"),
    Row("weighted sum", PAPER, _lean("weighted"), "lean"),
    Row("interleaved evolution", PAPER, "interleaved", "turns"),
    Row("estimation–exploration", CITED, "estimation_exploration", "climbers"),
    Row(
        "estimation–exploration, disagreement",
        CITED,
        {"name": "estimation_exploration", "preset": "bongard_2005"},
        "climbers",
    ),
    Row("Back-to-Reality", CITED, "back_to_reality", "absolute"),
    Row("surrogate of reality", CITED, "surrogate", "cited"),
    Row("fit unless near", CITED, _lean("fit_unless_near"), "lean"),
    Row("surrogate of the residual", CITED, "residual", "cited"),
    Row("transferability", CITED, "transferability", "cited"),
    Row("farthest", LATER, "farthest", "later"),
    Row("Gauss–Newton on readings", LATER, "simulated_fit", "gauss-newton"),
    Row("ASID", LATER, {"name": "weighted", "preset": "asid_2024"}, "gauss-newton"),
    Row("ABC-SMC on readings", LATER, "simulated_fit", "abc-smc"),
    Row("intelligent trial and error", LATER, "intelligent_trial_and_error", "later"),
    Row("SimOpt", LATER, DISTRIBUTION, "simopt"),
    Row("BayRn", LATER, "bayrn", "later"),
    Row("domain randomization", UNTUNED, "domain_randomization", "untuned"),
    Row(
        "domain randomization, fewer rollouts",
        UNTUNED,
        {"name": "domain_randomization", "options": {"equal_rollouts": True}},
        "untuned",
    ),
    Row("noise envelope", UNTUNED, "noise_envelope", "untuned"),
    Row("direct", BASE, "direct", "untuned"),
]
"""A notebook may insert a row with settings of its own; `direct`, which others are compared with, is last."""


def study(reality: str, settings: str) -> Spec:
    """Return the study of these settings in a reality; its strategies are in the order of `ROWS`."""
    strategies = [row.strategy for row in ROWS if row.settings == settings]
    return DESK | SETTINGS[settings] | {"strategies": strategies, "reality": REALITIES[reality]}


def label(reality: str, settings: str) -> str:
    """Return the label of a study."""
    return f"comparison-{reality}-{settings}"


def compared(reality: str, *names: str) -> Reads:
    """Return a function that reads the experiments of rows in a reality, or computes their studies."""

    def read(folder: Path, changes: Spec) -> list[Arm]:
        found = []
        for name in names:
            row = next(each for each in ROWS if each.name == name)
            beside = [each for each in ROWS if each.settings == row.settings]
            spec = study(reality, row.settings) | changes
            found.append(arms(label(reality, row.settings), spec, folder)[beside.index(row)])
        return found

    return read
