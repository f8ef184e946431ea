"""What studies are, in words and as rows of a table."""

from collections.abc import Iterable, Sequence

from benchmarks.reproduction import paper
from benchmarks.reproduction.studies import Arm, Study
from gaplab.schemas.lifecycle import State
from gaplab.services.figures.words import spoken
from gaplab.services.findings.wording import MISSING

HEAD = (
    *("study", "robot", "simulators", "reality", "seed", "evaluations: controller / selection / tuning"),
    *("iterations", "repetitions", "rollouts", "core-hours"),
)
SIZES = " / ".join(f"{size:,}" for size in paper.EVALUATIONS)
PAPER = (
    *("the paper", "quadruped with 12 joints", "physx"),
    *("physx (static friction 1.0, dynamic friction 0.8, restitution 0.0)", MISSING, f"steady state: {SIZES}"),
    *(str(paper.ITERATIONS), f"{paper.REPETITIONS} (direct {paper.DIRECT_REPETITIONS})", MISSING, MISSING),
)
"""The row of the paper; its ensembles have 20 simulators."""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table as Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)


def row(study: Study, links: Sequence[str]) -> tuple[str, ...]:
    """Return what a study is, after links to its archives; the first has its label in this document."""
    spec, budget = study.spec, study.spec.budget
    sizes = budget.controller_evaluations, budget.selection_evaluations, budget.simulator_evaluations
    shares = ", ".join(f"{100 * size / full:.3g} %" for size, full in zip(sizes, paper.EVALUATIONS, strict=True))
    told = "; transfers reused" if budget.reuse_transfer else ""
    told += "; a tuning's divided by its samples" if spec.tuner.options.get("equal_rollouts") else ""
    told += "".join(sorted({_weightiest(arm) for arm in study.arms}))
    parameters = study.arms[0].read.spec["reality"]["parameters"]
    truth = (f"{spoken(name).lower()} {'hidden' if at is None else at}" for name, at in parameters.items())
    return (
        f"{', '.join(links)}: {study.name}",
        spec.robot.name,
        spec.engine.name,
        f"{study.reality} ({', '.join(truth)})" if parameters else study.reality,
        "/".join(sorted({str(arm.spec.seed) for arm in study.arms})),
        f"{budget.preset}, {spec.controller_optimizer.name}: {' / '.join(f'{size:,}' for size in sizes)} ({shares} of "
        f"the paper's){told}",
        str(study.last if study.present else 0),
        _repetitions(study),
        f"{sum(arm.read.progress.rollouts_done for arm in study.arms):,}",
        f"{sum(arm.core_hours for arm in study.arms):.2f}",
    )


def _repetitions(study: Study) -> str:
    """Return the repetitions that most experiments have, the planned ones if there are more, and what differs."""
    counts = [(arm.repetitions, arm.spec.repetitions) for arm in study.arms]
    usual, planned = max(counts, key=lambda count: (counts.count(count), count))
    unusual = (arm for arm in study.arms if arm.repetitions != usual or arm.read.state is not State.COMPLETED)
    others = []
    for arm in unusual:
        own, state = arm.spec.repetitions, "" if arm.read.state is State.COMPLETED else f", {arm.read.state.value}"
        short = f" of {own}" if own != planned and arm.repetitions < own else ""
        others.append(f"{spoken(arm.read.name).lower()} {arm.repetitions}{short}{state}")
    told = f"{usual} of {planned}" if usual < planned else f"{usual}"
    return f"{told} ({'; '.join(others)})" if others else told


def _weightiest(arm: Arm) -> str:
    """Return how many simulators of an ensemble score a selection, if not all."""
    options = arm.spec.strategy.options
    some, size = options.get("weightiest"), options.get("simulators")
    return f"; selections scored by {some} of {size} simulators" if some else ""
