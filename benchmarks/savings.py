"""Rollouts saved in a whole study at desk budgets; none of them could have changed a number."""

from benchmarks.measure import Row
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.strategies import strategies
from gaplab.services.core.types import Cost, Selected, Transferred, Tuned
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment

REPETITIONS = 3


def costs() -> list[tuple[type, Cost]]:
    """Return kind and cost of every step of six strategies on the toy function."""
    specs = [
        resolve_experiment(ExperimentSpec.model_validate({"strategy": name, "robot": "toy_function", "budget": "desk"}))
        for name in (ref.name for ref in StudySpec().strategies)
        if strategies[name].takes_samples
    ]
    return [
        (type(step), step.cost)
        for spec in specs
        for number in range(REPETITIONS)
        for step in repetition(setting(spec, number))
        if isinstance(step, Selected | Tuned | Transferred)
    ]


def rows() -> list[Row]:
    """Measure the ratio of rollouts without and with savings, in tuning and in all phases."""
    all_costs = costs()
    return [
        _row("rollouts of tuning, toy at desk budgets", [cost for kind, cost in all_costs if kind is Tuned], "2"),
        _row("rollouts of all phases", [cost for _, cost in all_costs], "1.4"),
    ]


def _row(figure: str, steps: list[Cost], target: str) -> Row:
    done, saved = sum(each.rollouts for each in steps), sum(each.saved for each in steps)
    return Row(figure, f"{done:,} simulated, {saved:,} saved", (done + saved) / done, "without saving", target)


if __name__ == "__main__":
    for row in rows():
        print(row.figure, row.value, row.ratio)
