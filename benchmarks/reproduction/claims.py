"""The paper's claims C1 to C8, each with its rule; `pairs.py` has those that strategies differ."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from benchmarks.reproduction import paper, statements
from benchmarks.reproduction.evidence import NO_TEST, Evidence, Examined
from benchmarks.reproduction.pairs import (
    fit_strategies_differ,
    fit_strategies_lead,
    known_fit_leads_random,
    one_sample_wins,
    uniqueness_gains,
    weak_strategies_differ,
)
from benchmarks.reproduction.studies import Study
from gaplab.services.core.arrays import FloatArray
from gaplab.services.figures.words import number_of, spoken
from gaplab.services.reports.numbers import signed

NEARER_TO_A_THIRD = (1 / 3) ** 0.5
"""Ratio of standard deviations that is as far from a third as from 1, by factors."""

NO_DIRECT = "direct baseline"
FEWEST_SAMPLES = 4
"""Samples below which a curve has no two halves to compare."""


def starts_at_two_thirds(study: Study) -> Examined:
    """Return the evidence that controllers of random simulators have `paper.START` of direct (C1)."""
    lacking = tuple(spoken(name).lower() for name in paper.STRATEGIES if not study.arm(name))
    starts = {name: own for name in study.present if len(own := study.values(name, 0, 0))}
    if not len(study.direct) or not starts:
        return Examined("", "", (), lacking if len(study.direct) else (NO_DIRECT,))
    together = np.concatenate(list(starts.values()))
    tested = statements.near(together, study.direct, paper.START, paper.START_MARGIN)
    ratios = [own.mean() / study.unit for own in starts.values()]
    here = f"{tested.estimate} of direct; strategies {min(ratios):.2f} to {max(ratios):.2f}"
    return Examined(here, NO_TEST, (Evidence(f"all together near {paper.START:.2f}", tested),))


def three_samples_reach_direct(study: Study) -> Examined:
    """Return the evidence that strategies with simulated fit reach direct after three samples, and pass it (C2)."""
    present = [name for name in paper.SIMULATED_FIT if study.arm(name)]
    lacking = [spoken(name).lower() for name in paper.SIMULATED_FIT if name not in present]
    if not len(study.direct) or not present or study.last < 3:
        missing = [] if len(study.direct) else [NO_DIRECT]
        short = [f"value after 3 samples: it ends after {study.last}"] if present and study.last < 3 else []
        return Examined("", "", (), (*missing, *lacking, *short))
    evidence = [_reaches(study, name, 3, paper.LEAST_AFTER_THREE) for name in present]
    if study.last >= paper.ITERATIONS:
        evidence += [_reaches(study, name, paper.ITERATIONS, paper.LEAST_AFTER_TEN) for name in present]
    else:
        lacking.append(f"value after {number_of('sample', paper.ITERATIONS)}: it ends after {study.last}")
    counts = [count for count in (3, paper.ITERATIONS) if count <= study.last]
    here = "; ".join(f"{spoken(name)} {', '.join(_ratio(study, name, each) for each in counts)}" for name in present)
    return Examined(here, NO_TEST, tuple(evidence), tuple(lacking))


def one_sample_is_enough(study: Study) -> Examined:
    """Return the evidence that one sample of simulated fit and informative all but reaches direct (C4b)."""
    best = paper.SIMULATED_FIT[2]
    if not study.arm(best) or not len(study.direct) or study.last < 1:
        return Examined("", "", (), (NO_DIRECT if study.arm(best) else spoken(best).lower(),))
    evidence = _reaches(study, best, 1, paper.LEAST_AFTER_THREE)
    return Examined(_ratio(study, best, 1), NO_TEST, (evidence,))


def _reaches(study: Study, name: str, count: int, share: float) -> Evidence:
    tested = statements.reaches(study.values(name, count, count), study.direct, share)
    return Evidence(f"{spoken(name)} above {share:.2f} after {count}", tested)


def _ratio(study: Study, name: str, count: int) -> str:
    values = study.values(name, count, count)
    return f"{values.mean() / study.unit:.2f} after {count}" if len(values) else f"nothing after {count}"


def fit_strategies_vary_less(study: Study) -> Examined:
    """Return the evidence that strategies with simulated fit vary less than 0.58 times as much as the others (C3)."""
    sides = [_complete(study, names) if study.last >= 3 else {} for names in (paper.SIMULATED_FIT, paper.WEAK)]
    names = [name for side in sides for name in side]
    lacking = tuple(spoken(name).lower() for name in paper.STRATEGIES if name not in names)
    if not all(sides):
        short = (f"value after 3 samples: it ends after {study.last}",)
        return Examined("", "", (), lacking if study.last >= 3 else short)
    narrow, wide = (list(side.values()) for side in sides)
    tested = statements.narrower(narrow, wide, NEARER_TO_A_THIRD, 1 / paper.LEAST_TIMES)
    here = f"ratio of the deviations over 3 to {study.last} samples {tested.estimate}"
    evidence = Evidence(f"ratio of the deviations below {NEARER_TO_A_THIRD:.2f}", tested)
    return Examined(here, NO_TEST, (evidence,), lacking, study.unequal(names))


def _complete(study: Study, names: Iterable[str]) -> dict[str, FloatArray]:
    """Return the complete repetitions `(r, k)` from three samples on, of strategies with two or more."""
    found = {name: study.complete(name, 3, study.last) for name in names if study.arm(name)}
    return {name: values for name, values in found.items() if len(values) > 1}


def curves_rise_and_flatten(study: Study) -> Examined:
    """Return the evidence that all curves rise and flatten (C8)."""
    present = study.present
    lacking = [spoken(name).lower() for name in paper.STRATEGIES if name not in present]
    if not present or study.last < FEWEST_SAMPLES:
        short = f"value after {number_of('sample', FEWEST_SAMPLES)}: it ends after {study.last}"
        return Examined("", "", (), (*lacking, *([short] if present else [])))
    middle, evidence, told = study.last // 2, [], []
    for name in present:
        recorded = study.complete(name, 0, study.last)
        early, late = recorded[:, middle] - recorded[:, 0], recorded[:, -1] - recorded[:, middle]
        slowing = early / middle - late / (study.last - middle)
        for verb, gains, least in (("rises", early + late, paper.LEAST_RISE), ("flattens", slowing, 0.0)):
            evidence.append(Evidence(f"{spoken(name)} {verb}", statements.rises(gains, least, study.unit)))
        if len(recorded):
            told.append(f"{spoken(name)} {_gain(study, early)} and {_gain(study, late)}")
    unit = "" if np.isnan(study.unit) else " of direct"
    here = f"gain{unit} to {middle} samples, and from there to {study.last}: {'; '.join(told)}"
    return Examined(here, NO_TEST, tuple(evidence), tuple(lacking))


def _gain(study: Study, gains: FloatArray) -> str:
    unit = 1.0 if np.isnan(study.unit) else study.unit
    return signed(float(gains.mean() / unit))


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes:
        key: its label: C and a number; a letter follows if one sentence of the paper makes several claims.
        title: what it claims, in a few words.
        says: what the paper says.
        rule: the statements that it is made of, and what refutes them.
        examine: examines it in a study.
    """

    key: str
    title: str
    says: str
    rule: str
    examine: Callable[[Study], Examined]


CLAIMS = (
    Claim(
        "C1",
        "controllers of a random simulator start at two thirds of direct",
        f"Before any sample every strategy starts alike, at about {paper.START:.2f} of direct.",
        "Before any sample all strategies do the same: they search in a random simulator. So they start alike, but for "
        f"chance, and are taken together. Their mean is within {paper.START_MARGIN:.2f} of {paper.START:.2f} of "
        "direct: half of the last digit of the paper's 0.9, and two standard errors of its mean. Refuted if it is "
        "shown to be outside. The robot was chosen among trials that start at 0.38 to 0.83, so agreement says little. "
        "Where reality is another engine, the start has the gap between the engines as well, which the paper lacks.",
        starts_at_two_thirds,
    ),
    Claim(
        "C2",
        "strategies with simulated fit reach direct after three samples and pass it by ten",
        f"The three strategies with simulated fit reach {paper.AFTER_THREE:.2f} of direct after three samples, and "
        f"{paper.AFTER_TEN:.2f} by ten.",
        f"Each of the three is above {paper.LEAST_AFTER_THREE:.2f} of direct after three samples, and above "
        f"{paper.LEAST_AFTER_TEN:.2f} after ten: the paper's 1.3 and 1.4 may be a rounded 1.25 and 1.35. Refuted if "
        "one is shown to be below. Passing direct does not show a good simulator: recorded fitness is the largest of "
        "the samples and a transferred controller. [Fig. 4](#fig-4) has the best of as many direct searches.",
        three_samples_reach_direct,
    ),
    Claim(
        "C3",
        "strategies with simulated fit vary less than 0.58 times as much as the others",
        "The standard deviation of these three is about a third of the others'.",
        "The ratio of the standard deviations, from three samples on, is by factors nearer to a third than to 1: below "
        f"{NEARER_TO_A_THIRD:.2f}, by a bootstrap over whole repetitions. Refuted if it is shown to be above. Smaller "
        f"than in the paper if it is shown to be above {1 / paper.LEAST_TIMES:.2f}: three may be {paper.LEAST_TIMES}.",
        fit_strategies_vary_less,
    ),
    Claim(
        "C4a",
        "with one sample, simulated fit and informative beats every other",
        "With one sample, simulated fit and informative is significantly different from the other strategies "
        "(p < 0.01), and better.",
        "It is above each of the five others after one sample. Refuted if its lead is shown to be smaller than "
        f"{paper.ONE_SAMPLE.least(*paper.SIMULATED_FIT[:2]):.3f} of direct over a strategy with simulated fit, or "
        f"than {paper.ONE_SAMPLE.least(paper.SIMULATED_FIT[0], paper.WEAK[0]):.3f} over another.",
        one_sample_wins,
    ),
    Claim(
        "C4b",
        "with one sample, simulated fit and informative all but reaches direct",
        "Simulated fit and informative has a nearly perfect result after a single sample.",
        f"It is above {paper.LEAST_AFTER_THREE:.2f} of direct after one sample, as others are after three (C2). "
        "Refuted if it is shown to be below.",
        one_sample_is_enough,
    ),
    Claim(
        "C5a",
        "strategies with simulated fit are above the others beyond two samples",
        "Beyond two samples, each strategy with simulated fit is better than each without (p ≪ 0.001).",
        "Over 3 to 10 samples, each of the three is above each of the other three. Refuted if a lead is shown to be "
        f"smaller than {paper.BEYOND_TWO.least(paper.SIMULATED_FIT[0], paper.WEAK[0]):.3f} of direct.",
        fit_strategies_lead,
    ),
    Claim(
        "C5b",
        "beyond two samples, unique is above plain simulated fit, and both are above the informative one",
        "Beyond two samples, the strategies with simulated fit differ from each other (p ≪ 0.001): the unique one is "
        "above plain simulated fit, and both are above the informative one.",
        "Over 3 to 10 samples, each of the three pairs has this order. Refuted if a lead is shown to be smaller than "
        f"{paper.BEYOND_TWO.least(*paper.SIMULATED_FIT[:2]):.3f} of direct. The paper's p may also be that of each "
        "against the other three strategies (C5a); the order is in its text.",
        fit_strategies_differ,
    ),
    Claim(
        "C5c",
        "known fit is better than random",
        "Beyond two samples, known fit is better than random (p ≈ 0.017).",
        "Over 3 to 10 samples, known fit is above random. Refuted if its lead is shown to be smaller than "
        f"{paper.KNOWN_FIT.least(*paper.WEAK[:2]):.3f} of direct.",
        known_fit_leads_random,
    ),
    Claim(
        "C6",
        "beyond five samples, informative is above known fit, and known fit above random",
        "Beyond five samples, the three weakest strategies differ from one another (p < 0.05): informative is slightly "
        "above the other two, and known fit above random.",
        "Over 6 to 10 samples, each of the three pairs has this order. Refuted if a lead is shown to be smaller than "
        f"{paper.BEYOND_FIVE.least(*paper.WEAK[:2]):.3f} of direct. The paper's p may also be that of each against the "
        "three strategies with simulated fit; [letters](#which-strategies-differ) tell these apart.",
        weak_strategies_differ,
    ),
    Claim(
        "C7",
        "uniqueness gains a little",
        "Uniqueness appears to give a small improvement over plain simulated fit.",
        "Over 3 to 10 samples, simulated fit and unique is above simulated fit. Refuted if it is shown to be below: "
        "the paper tests no such gain. C5b supposes that its p is also of this pair.",
        uniqueness_gains,
    ),
    Claim(
        "C8",
        "all curves rise and flatten",
        "All curves rise, and flatten.",
        "In each strategy the last recorded fitness is above the first, paired by repetition, and the first half "
        "of the samples gains more a sample than the second. Refuted if a rise is shown to be smaller than "
        f"{paper.LEAST_RISE:.2f} of direct, half of the paper's, or if the second half is shown to gain more.",
        curves_rise_and_flatten,
    ),
)
