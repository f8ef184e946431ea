"""The tables of the document: studies, Fig. 4, Fig. 3 and costs, as rows of Markdown."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from benchmarks.findings import Found, found
from benchmarks.reproduction import paper
from benchmarks.reproduction.studies import Arm, Study
from gaplab.schemas.lifecycle import State
from gaplab.services.core.arrays import FloatArray
from gaplab.services.figures.words import spoken
from gaplab.services.reports.numbers import MISSING
from gaplab.services.store.session import Store

FIGURE_3 = (0, 2, 4, 6, 8)
"""Samples before those panels of the paper's Fig. 3, and none."""

TOY = "toy_function"


def is_toy(study: Study) -> bool:
    """Return whether a study is of the toy function."""
    return study.arms[0].spec.robot.name == TOY


def in_words(study: Study) -> str:
    """Return robot, engines, budget and repetitions of a study in words."""
    spec, reality = study.arms[0].spec, study.arms[0].read.spec["reality"]["engine"]
    where = "a robot on a bench" if reality is None else reality["name"]
    return (
        f"{spec.robot.name}: {spec.engine.name} for a reality in {where}, budget {spec.budget.preset}, controllers by "
        f"{spec.controller_optimizer.name}, repetitions: {_repetitions(study)}"
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table as Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)


def study_row(study: Study, links: Sequence[str]) -> tuple[str, ...]:
    """Return what a study is, after links to its archives; the first has its label in this document."""
    spec = study.arms[0].spec
    budget, reality = spec.budget, study.arms[0].read.spec["reality"]
    sizes = budget.controller_evaluations, budget.selection_evaluations, budget.simulator_evaluations
    shares = [f"{100 * size / full:.3g} %" for size, full in zip(sizes, paper.EVALUATIONS, strict=True)]
    reused = "; transfers reused" if budget.reuse_transfer else ""
    divided = "; a tuning's divided by its samples" if spec.tuner.options.get("equal_rollouts") else ""
    divided += "".join(sorted({_weightiest(arm) for arm in study.arms}))
    preset = f"{budget.preset}, {spec.controller_optimizer.name}"
    truth = ", ".join(
        f"{spoken(name).lower()} {'hidden' if value is None else value}"
        for name, value in reality["parameters"].items()
    )
    simulated = "a robot on a bench" if reality["engine"] is None else reality["engine"]["name"]
    return (
        f"{', '.join(links)}: {study.name}",
        spec.robot.name,
        spec.engine.name,
        f"{simulated} ({truth})" if truth else simulated,
        "/".join(sorted({str(arm.spec.seed) for arm in study.arms})),
        f"{preset}: {' / '.join(f'{size:,}' for size in sizes)} ({', '.join(shares)} of the paper's){reused}{divided}",
        str(study.last if study.present else 0),
        _repetitions(study),
        f"{sum(arm.read.progress.rollouts_done for arm in study.arms):,}",
        f"{sum(arm.core_hours for arm in study.arms):.2f}",
    )


STUDY_HEAD = (
    "study",
    "robot",
    "simulators",
    "reality",
    "seed",
    "evaluations: controller / selection / tuning",
    "iterations",
    "repetitions",
    "rollouts",
    "core-hours",
)


def _weightiest(arm: Arm) -> str:
    """Return how many simulators score a selection, if not all."""
    options = arm.spec.strategy.options
    if not options.get("weightiest"):
        return ""
    return f"; selections scored by {options['weightiest']} of {options['simulators']} simulators"


def _repetitions(study: Study) -> str:
    """Return the repetitions that most experiments have, and those that differ."""
    counts = [arm.repetitions for arm in study.arms]
    usual = max(set(counts), key=counts.count)
    others = [
        _exception(arm) for arm in study.arms if arm.repetitions != usual or arm.read.state is not State.COMPLETED
    ]
    return f"{usual} ({'; '.join(others)})" if others else f"{usual}"


def _exception(arm: Arm) -> str:
    state = "" if arm.read.state is State.COMPLETED else f", {arm.read.state.value}"
    planned = f" of {arm.spec.repetitions}" if arm.repetitions < arm.spec.repetitions else ""
    return f"{spoken(arm.read.name).lower()} {arm.repetitions}{planned}{state}"


def figure_4(study: Study) -> str:
    """Return the recorded fitness over direct by number of samples, beside the paper's."""
    arms = [arm for arm in study.arms if not arm.read.direct]
    counts = range(min(paper.ITERATIONS, max(arm.last for arm in arms)) + 1)
    rows = [_paper_row("the paper, with simulated fit", counts, learned=True)]
    rows += [_paper_row("the paper, the other three", counts, learned=False)]
    rows += [_ratios(study, arm, counts) for arm in arms]
    return table(("samples", *map(str, counts)), rows)


def _paper_row(name: str, counts: Sequence[int], *, learned: bool) -> tuple[str, ...]:
    spread = f" ± {paper.LEARNED_SD[0]:.2f} to {paper.LEARNED_SD[1]:.2f}"
    known = {0: f"{paper.START:.2f}"}
    if learned:
        known |= {3: f"≥ {paper.AFTER_THREE:.2f}{spread}", 10: f"{paper.AFTER_TEN:.2f}{spread}"}
    return name, *(known.get(count, MISSING) for count in counts)


def _ratios(study: Study, arm: Arm, counts: Sequence[int]) -> tuple[str, ...]:
    cells = []
    for count in counts:
        values = arm.values(count, count) / study.unit
        deviation = f" ± {values.std(ddof=1):.2f}" if len(values) > 1 else ""
        cells.append(f"{values.mean():.2f}{deviation}" if len(values) and np.isfinite(values).all() else MISSING)
    return f"{spoken(arm.read.name)} ({arm.repetitions})", *cells


def direct_in_words(study: Study) -> str:
    """Return the study's direct baseline and the paper's in a sentence."""
    own = study.direct
    printed = f"the paper's is {paper.DIRECT:.2f} ± {paper.DIRECT_SD:.2f} ({paper.DIRECT_REPETITIONS} repetitions)"
    if not len(own):
        return f"The study has no direct baseline, so it has no ratios; {printed}."
    deviation = f" ± {own.std(ddof=1):.2f}" if len(own) > 1 else ""
    unit = next((curve.unit for curve in study.curves if curve.unit), "")
    return f"Direct is {own.mean():.2f}{deviation} {unit} ({len(own)} repetitions); {printed}."


def figure_3(store: Store, study: Study) -> tuple[str, str]:
    """Return the distance of the best simulators from the truth, and the fitness, of a toy study; by samples."""
    counts = [count for count in FIGURE_3 if count <= study.last]
    distances, ratios = [], []
    for arm in (own for name in study.present if (own := study.arm(name))):
        away = found(store, arm.read.id)
        distances.append((spoken(arm.strategy), *(distance(away.get(count)) for count in counts)))
        ratios.append((spoken(arm.strategy), *(_mean(arm.values(count, count) / study.unit) for count in counts)))
    head = "samples", *map(str, counts)
    return table(head, distances), table(head, ratios)


def distance(findings: Found | None) -> str:
    """Return the median distance of simulators from the truth, with the bounds of each tunable scaled to 1."""
    return MISSING if findings is None else f"{np.median(np.linalg.norm(findings.away, axis=1)):.2f}"


def _mean(values: FloatArray) -> str:
    return f"{values.mean():.2f}" if len(values) and np.isfinite(values).all() else MISSING


def cost_rows(label: str, study: Study) -> Iterator[tuple[str, ...]]:
    """Yield what each experiment of a study took."""
    for arm in study.arms:
        progress = arm.read.progress
        yield (
            label,
            spoken(arm.read.name),
            str(arm.repetitions),
            f"{progress.rollouts_done:,}",
            f"{progress.rollouts_saved:,}",
            f"{arm.core_hours:.2f}",
            f"{arm.attempts:,}" if arm.attempts else MISSING,
            f"{arm.held_core_hours:.2f}" if arm.attempts else MISSING,
        )


COST_HEAD = (
    "study",
    "experiment",
    "repetitions",
    "rollouts",
    "saved",
    "core-hours of stored steps",
    "attempts",
    "core-hours of attempts",
)
