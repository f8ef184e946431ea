"""What studies are and their results beside the paper's, as tables of Markdown and sentences."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from benchmarks.findings import Found
from benchmarks.reproduction import paper
from benchmarks.reproduction.statistics import Difference, narrower
from benchmarks.reproduction.studies import Arm, Study
from gaplab.schemas.lifecycle import State
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.curves import best_of_searches, mean_and_deviation
from gaplab.services.figures.words import spoken
from gaplab.services.findings.statistics import finite
from gaplab.services.findings.wording import MISSING

STUDY_HEAD = (
    *("study", "robot", "simulators", "reality", "seed", "evaluations: controller / selection / tuning"),
    *("iterations", "repetitions", "rollouts", "core-hours"),
)
SIZES = " / ".join(f"{size:,}" for size in paper.EVALUATIONS)
THE_PAPER = (
    *("the paper", "quadruped with 12 joints", "physx"),
    *("physx (static friction 1.0, dynamic friction 0.8, restitution 0.0)", MISSING, f"steady state: {SIZES}"),
    *(str(paper.ITERATIONS), f"{paper.REPETITIONS} (direct {paper.DIRECT_REPETITIONS})", MISSING, MISSING),
)
"""The row of the paper; its ensembles have 20 simulators."""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table as Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)


def study_row(study: Study, links: Sequence[str]) -> tuple[str, ...]:
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


FIGURE_3 = (0, 2, 4, 6, 8)
"""Samples before those panels of the paper's Fig. 3, and none."""
ORIGINS = ("strategy", "samples", "last sample", "best sample", "transferred", "recorded", "from a sample", "distance")
KINDS = {"recorded": "recorded", "transferred": "transferred alone", "chances": "equal chances"}
"""Kinds of fitness, in words: recorded as in the paper, of transferred controllers alone, and the best of these."""
FIRST = 3
"""Samples from which on the paper compares the strategies."""


def figure_4(study: Study) -> str:
    """Return the recorded fitness over direct by number of samples, beside the paper's and that of many searches."""
    arms = [arm for arm in study.arms if not arm.read.direct]
    counts = range(min(paper.ITERATIONS, max(arm.last for arm in arms)) + 1)
    learned = {0: f"{paper.START:.2f}", 3: f"≥ {paper.AFTER_THREE:.2f}", 10: f"{paper.AFTER_TEN:.2f}"}
    every = {0: f"{paper.START:.2f}", 10: f"about {paper.AT_LAST:.2f}"}
    best = best_of(study)[: len(counts)]
    rows = [
        ("the paper, with simulated fit", *(learned.get(count, MISSING) for count in counts)),
        ("the paper, all six", *(every.get(count, MISSING) for count in counts)),
        ("direct, the best of samples + 1", *best, *[MISSING] * (len(counts) - len(best))),
        *(_ratios(study, arm, counts) for arm in arms),
    ]
    return table(("samples", *map(str, counts)), rows)


def best_of(study: Study) -> list[str]:
    """Return the expected best of 1, 2, 3 … direct searches over direct; nothing if there are too few searches."""
    return [f"{each / study.unit:.2f}" for each in best_of_searches(study.direct) if each is not None]


def _ratios(study: Study, arm: Arm, counts: Sequence[int]) -> tuple[str, ...]:
    each = [arm.values(count, count) / study.unit for count in counts]
    sizes = sorted({len(values) for values in each} - {0})
    told = " to ".join(map(str, dict.fromkeys([sizes[0], sizes[-1]] if sizes else [0])))
    return f"{spoken(arm.read.name)} ({told})", *(_mean(values, spread=True) for values in each)


def direct_in_words(study: Study) -> str:
    """Return the study's direct baseline and the paper's in a sentence."""
    printed = f"the paper's is {paper.DIRECT:.2f} ± {paper.DIRECT_SD:.2f} ({paper.DIRECT_REPETITIONS} repetitions)"
    if not len(study.direct):
        return f"The study has no direct baseline, so it has no ratios; {printed}."
    told, repetitions = f"Direct is {_mean(study.direct, spread=True)}", f"({len(study.direct)} repetitions)"
    if study.toy:
        return f"{told} {repetitions}."
    return f"{told} {next((curve.unit for curve in study.curves if curve.unit), '')} {repetitions}; {printed}."


def figure_3(study: Study) -> tuple[str, str]:
    """Return the fitness of transferred controllers over direct, and the distance of the best simulators."""
    counts = [count for count in FIGURE_3 if count <= study.last]
    head = "samples", *map(str, counts)
    ratios, distances = [], []
    for arm in study.of():
        over = arm.transferred / study.unit
        ratios.append((spoken(arm.strategy), *(_mean(finite(over[:, count])) for count in counts)))
        distances.append((spoken(arm.strategy), *(_distance(arm.tuned.get(count)) for count in counts)))
    return table(head, ratios), table(head, distances)


def origins(study: Study) -> str:
    """Return whether recorded fitness is that of samples or of transferred controllers, and how near simulators are."""
    return table(ORIGINS, (row for arm in study.of() for row in _origin(study, arm)))


def _origin(study: Study, arm: Arm) -> Iterator[tuple[str, ...]]:
    best = np.fmax.accumulate(arm.samples, axis=1)
    for count in (each for each in (1, FIRST, paper.ITERATIONS) if each <= arm.last):
        columns = (fitness[:, count] / study.unit for fitness in (arm.samples, best, arm.transferred, arm.recorded))
        from_sample = best[:, count] > np.nan_to_num(arm.transferred[:, count], nan=-np.inf)
        known = np.isfinite(arm.recorded[:, count])
        share = f"{from_sample[known].mean():.0%}" if known.any() else MISSING
        means = (_mean(finite(values)) for values in columns)
        yield spoken(arm.strategy), str(count), *means, share, _distance(arm.tuned.get(count))


def lead(study: Study, kind: str, first: int, last: int) -> Difference | None:
    """Return the mean of the means with simulated fit less that of the others, over direct.

    Each repetition is one value, its mean from the first to the last number of samples in a kind of fitness of `KINDS`,
    and each strategy counts alike. None if the study lacks one of both groups, or if a strategy has fewer than two
    repetitions.
    """
    found = []
    for sign, groups in zip((1.0, -1.0), both_sides(study, kind, first, last), strict=True):
        means = [Difference.mean(group.mean(axis=1)) for group in groups]
        found += [(sign / len(groups), mean) for mean in means if mean]
        if not groups or not all(means):
            return None
    return Difference.sum(found).over(study.unit)


def spread(study: Study, kind: str) -> str:
    """Return how many times the others' the standard deviations with simulated fit are; a dash if it is unknown."""
    sides = both_sides(study, kind, FIRST, study.last)
    if study.last < FIRST or not all(sides) or min(len(group) for side in sides for group in side) < 2:
        return MISSING
    return narrower(*sides).estimate


def leads(study: Study) -> str:
    """Return the lead of simulated fit by number of samples, and over all from the third on, for each kind."""
    counts = range(study.last + 1)
    spans = [(count, count) for count in counts] + [(FIRST, study.last)] * (study.last >= FIRST)
    over = [f"{FIRST} to {study.last}", "ratio of deviations"] if len(spans) > len(counts) else []
    rows = []
    for kind, words in KINDS.items():
        cells = [found.told() if (found := lead(study, kind, *span)) else MISSING for span in spans]
        rows.append((words, *cells, *([spread(study, kind)] if over else [])))
    return table(("lead", *map(str, counts), *over), rows)


def both_sides(study: Study, kind: str, first: int, last: int) -> list[list[FloatArray]]:
    """Return the values `(r, k)` with simulated fit, and of the others, in repetitions with all kinds of fitness."""
    columns = slice(first, last + 1)
    return [
        [
            getattr(arm, kind)[:, columns][np.isfinite(arm.recorded[:, columns] + arm.chances[:, columns]).all(axis=1)]
            for arm in study.of(names)
        ]
        for names in (paper.FIT, paper.WEAK)
    ]


def _distance(found: Found | None) -> str:
    """Return the median distance of simulators from the truth, with the bounds of each tunable scaled to 1."""
    return MISSING if found is None else f"{np.median(np.linalg.norm(found.away, axis=1)):.2f}"


def _mean(values: FloatArray, *, spread: bool = False) -> str:
    """Return the mean of values `(n,)`, and their standard deviation if asked; a dash without values."""
    _, mean, deviation = mean_and_deviation(values)
    told = MISSING if mean is None else f"{mean:.2f}"
    return f"{told} ± {deviation:.2f}" if spread and deviation is not None else told
