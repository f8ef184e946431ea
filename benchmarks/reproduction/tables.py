"""The tables of the document: studies, Fig. 4, Fig. 3 and costs, as rows of Markdown."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from benchmarks.findings import Found, found
from benchmarks.reproduction import paper
from benchmarks.reproduction.studies import Arm, Study
from gaplab.schemas.lifecycle import State
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.curves import best_of_searches, mean_and_deviation
from gaplab.services.core.statistics import finite
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
    search, selection = spec.budget.controller_evaluations, spec.budget.selection_evaluations
    selections = "" if search == selection else f", samples from searches of {selection:,} evaluations"
    return (
        f"{spec.robot.name}: {spec.engine.name} for a reality in {where}, budget {spec.budget.preset}, controllers by "
        f"{spec.controller_optimizer.name}{selections}, repetitions: {repetitions_in_words(study)}"
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table as Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)


def paper_rows(studies: Sequence[Study]) -> Iterator[tuple[str, ...]]:
    """Yield the settings of the paper and of studies, each a row with a name."""
    specs = [study.arms[0].spec for study in studies]
    yield "robot", "quadruped with 12 joints", *(spec.robot.name for spec in specs)
    realities = ["a bench" if spec.reality.engine is None else spec.reality.engine.name for spec in specs]
    engines = (f"{spec.engine.name}, {where}" for spec, where in zip(specs, realities, strict=True))
    yield "simulators, reality", "physx, physx", *engines
    yield "optimizer of controllers", "steady state", *(spec.controller_optimizer.name for spec in specs)
    for what, size, of in (
        ("search for a transferred controller", 0, "controller_evaluations"),
        ("search for a sample", 1, "selection_evaluations"),
    ):
        told = (f"{getattr(spec.budget, of):,}" for spec in specs)
        yield f"evaluations of a {what}", f"{paper.EVALUATIONS[size]:,}", *told
    yield "simulators of an ensemble that score a sample", "20", *map(_scoring, studies)
    yield "evaluations of a tuning", f"{paper.EVALUATIONS[2]:,}", *map(_tunings, specs)
    yield "samples", str(paper.ITERATIONS), *(str(study.last) for study in studies)
    yield "repetitions", f"{paper.REPETITIONS} (direct {paper.DIRECT_REPETITIONS})", *map(repetitions_in_words, studies)
    truths = [study.arms[0].read.spec["reality"]["parameters"] for study in studies]
    told = (", ".join("hidden" if value is None else str(value) for value in truth.values()) for truth in truths)
    yield "static friction, dynamic friction, restitution", "1.0, 0.8, 0.0", *told


def _tunings(spec: ResolvedSpec) -> str:
    divided = " / samples" if spec.tuner.options.get("equal_rollouts") else ""
    return f"{spec.budget.simulator_evaluations:,}{divided}"


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
        repetitions_in_words(study),
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
    return f"; selections scored by {_scored_by(arm)} simulators" if arm.spec.strategy.options.get("weightiest") else ""


def _scored_by(arm: Arm) -> str:
    """Return how many of an ensemble of simulators score a selection; empty without an ensemble."""
    options = arm.spec.strategy.options
    size, some = options.get("simulators"), options.get("weightiest")
    return "" if size is None else f"{some} of {size}" if some else f"{size}"


def _scoring(study: Study) -> str:
    return ", ".join(sorted({_scored_by(arm) for arm in study.arms} - {""})) or MISSING


def repetitions_in_words(study: Study) -> str:
    """Return the repetitions that most experiments have, the planned ones if there are more, and what differs."""
    counts = [(arm.repetitions, arm.spec.repetitions) for arm in study.arms]
    usual, planned = max(counts, key=lambda count: (counts.count(count), count))
    others = [
        _exception(arm, planned)
        for arm in study.arms
        if arm.repetitions != usual or arm.read.state is not State.COMPLETED
    ]
    told = _of_planned(usual, planned)
    return f"{told} ({'; '.join(others)})" if others else told


def _exception(arm: Arm, planned: int) -> str:
    """Return the repetitions of an experiment, where most of its study are planned with this number."""
    state = "" if arm.read.state is State.COMPLETED else f", {arm.read.state.value}"
    own = arm.spec.repetitions
    count = f"{arm.repetitions}" if own == planned else _of_planned(arm.repetitions, own)
    return f"{spoken(arm.read.name).lower()} {count}{state}"


def _of_planned(count: int, planned: int) -> str:
    return f"{count} of {planned}" if count < planned else f"{count}"


def figure_4(study: Study) -> str:
    """Return the recorded fitness over direct by number of samples, beside the paper's and that of many searches."""
    arms = [arm for arm in study.arms if not arm.read.direct]
    counts = range(min(paper.ITERATIONS, max(arm.last for arm in arms)) + 1)
    learned = {0: f"{paper.START:.2f}", 3: f"≥ {paper.AFTER_THREE:.2f}", 10: f"{paper.AFTER_TEN:.2f}"}
    every = {0: f"{paper.START:.2f}", 10: f"about {paper.AT_LAST:.2f}"}
    rows = [("the paper, with simulated fit", *(learned.get(count, MISSING) for count in counts))]
    rows += [("the paper, all six", *(every.get(count, MISSING) for count in counts))]
    best = best_of(study)[: len(counts)]
    rows += [("direct, the best of samples + 1", *best, *[MISSING] * (len(counts) - len(best)))]
    rows += [_ratios(study, arm, counts) for arm in arms]
    return table(("samples", *map(str, counts)), rows)


def best_of(study: Study) -> list[str]:
    """Return the expected best of 1, 2, 3 … direct searches over direct; nothing if there are too few searches."""
    return [f"{each / study.unit:.2f}" for each in best_of_searches(study.direct) if each is not None]


def _ratios(study: Study, arm: Arm, counts: Sequence[int]) -> tuple[str, ...]:
    each = [arm.values(count, count) / study.unit for count in counts]
    sizes = sorted({int(np.isfinite(values).sum()) for values in each} - {0})
    told = " to ".join(map(str, [sizes[0], sizes[-1]] if len(sizes) > 1 else sizes or [0]))
    return f"{spoken(arm.read.name)} ({told})", *(_mean(values, spread=True) for values in each)


def direct_in_words(study: Study) -> str:
    """Return the study's direct baseline and the paper's in a sentence."""
    own = study.direct
    printed = f"the paper's is {paper.DIRECT:.2f} ± {paper.DIRECT_SD:.2f} ({paper.DIRECT_REPETITIONS} repetitions)"
    if not len(own):
        return f"The study has no direct baseline, so it has no ratios; {printed}."
    told = f"Direct is {_mean(own, spread=True)}"
    if is_toy(study):
        return f"{told} ({len(own)} repetitions)."
    unit = next((curve.unit for curve in study.curves if curve.unit), "")
    return f"{told} {unit} ({len(own)} repetitions); {printed}."


def figure_3(store: Store, study: Study) -> tuple[str, str]:
    """Return the distance of the best simulators from the truth, and the fitness of transferred controllers."""
    counts = [count for count in FIGURE_3 if count <= study.last]
    distances, ratios = [], []
    for arm in (own for name in study.present if (own := study.arm(name))):
        away, probed = found(store, arm.read.id), arm.transferred / study.unit
        distances.append((spoken(arm.strategy), *(distance(away.get(count)) for count in counts)))
        ratios.append((spoken(arm.strategy), *(_mean(finite(probed[:, count])) for count in counts)))
    head = "samples", *map(str, counts)
    return table(head, distances), table(head, ratios)


def distance(findings: Found | None) -> str:
    """Return the median distance of simulators from the truth, with the bounds of each tunable scaled to 1."""
    return MISSING if findings is None else f"{np.median(np.linalg.norm(findings.away, axis=1)):.2f}"


def _mean(values: FloatArray, *, spread: bool = False) -> str:
    """Return the mean of values `(n,)`, and their standard deviation if asked; a dash without values."""
    _, mean, deviation = mean_and_deviation(values)
    told = MISSING if mean is None else f"{mean:.2f}"
    return f"{told} ± {deviation:.2f}" if spread and deviation is not None else told
