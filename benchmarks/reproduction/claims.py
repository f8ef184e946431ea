"""The paper's claims on a study, which `page.toml` has with their rules: each kind of claim is one function here.

A verdict follows from what a claim finds in a study, or in several together.
"""

import tomllib
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.reproduction import paper, statistics
from benchmarks.reproduction.statistics import Tested, pooled
from benchmarks.reproduction.studies import Arm, Study
from gaplab.schemas.comparisons import Test
from gaplab.services.core.arrays import FloatArray
from gaplab.services.figures.words import number_of, spoken
from gaplab.services.findings.statistics import SIGNIFICANT, compare, finite, holm
from gaplab.services.findings.wording import probability

DATA = tomllib.loads(Path(__file__).with_name("page.toml").read_text(encoding="utf-8"))
NO_TEST, NO_DIRECT = "none in the paper", "direct baseline"
FEWEST_SAMPLES = 4
"""Samples below which a curve has no two halves to compare."""
GROUPS = {"fit": paper.FIT, "best": paper.FIT[2:], "all": paper.STRATEGIES}


@dataclass(frozen=True, eq=False)
class Claim:
    """A claim of the paper, as `page.toml` has it: its kind says which of the other fields it has."""

    key: str
    kind: str
    says: str
    rule: str
    strategies: str = ""
    levels: Sequence[tuple[int, float]] = ()
    transferred: bool = False
    span: Sequence[int] = ()
    pairs: Sequence[str] = ()
    p: float | None = None
    counts: int = 1
    late: bool = False

    def least(self, first: str, second: str) -> float:
        """Return the least difference of two strategies that agrees with the paper's; 0 if it tests none."""
        return 0.0 if self.p is None else paper.least((first, second), self.p, self.counts)


CLAIMS = tuple(Claim(**each) for each in DATA["claims"])


class Evidence(NamedTuple):
    """One statement of a claim; `opposed` is p of the hypothesis that its opposite does not hold, if it has one."""

    statement: str
    tested: Tested
    opposed: float | None = None


class Examined(NamedTuple):
    """A claim as a study shows it.

    Attributes:
        lacking: what the claim names and the study lacks.
        evidence: the statements; none if the study has nothing that the claim speaks of.
        here: the study's numbers.
        paper_test: result of the paper's own test.
        unequal: why strategies are compared unfairly; None if they are not.
    """

    lacking: Sequence[str]
    evidence: Sequence[Evidence] = ()
    here: str = ""
    paper_test: str = ""
    unequal: str | None = None


def examine(claim: Claim, study: Study) -> Examined:
    """Return a claim as a study shows it."""
    kinds: dict[str, Callable[[Claim, Study], Examined]] = {"start": _start, "reach": _reach, "spread": _spread}
    return (kinds | {"order": _order, "rises": _shape, "flattens": _shape})[claim.kind](claim, study)


def _start(_: Claim, study: Study) -> Examined:
    starts = [own for arm in study.of() if len(own := arm.values(0, 0))]
    if not len(study.direct) or not starts:
        return Examined(_lacking(study, paper.STRATEGIES) if len(study.direct) else [NO_DIRECT])
    tested = statistics.near(np.concatenate(starts), study.direct, paper.START, paper.START_MARGIN)
    ratios = [own.mean() / study.unit for own in starts]
    here = f"{tested.estimate} of direct; strategies {min(ratios):.2f} to {max(ratios):.2f}"
    return Examined([], [Evidence(f"all together near {paper.START:.2f}", tested)], here, NO_TEST)


def _reach(claim: Claim, study: Study) -> Examined:
    names, arms = GROUPS[claim.strategies], study.of(GROUPS[claim.strategies])
    levels = [(count, fitness / paper.DIRECT) for count, fitness in claim.levels if count <= study.last]
    lacking = [*([] if len(study.direct) else [NO_DIRECT]), *_lacking(study, names)]
    lacking += [_ends(study, count) for count, _ in claim.levels if arms and count > study.last]
    if not len(study.direct) or not arms or not levels:
        return Examined(lacking)
    verb, evidence, here = " transfers" if claim.transferred else "", [], defaultdict[str, list[str]](list)
    for count, share in levels:
        for arm in arms:
            values = finite(arm.transferred[:, count]) if claim.transferred else arm.values(count, count)
            tested = statistics.reaches(values, study.direct, share)
            evidence.append(Evidence(f"{spoken(arm.strategy)}{verb} above {share:.2f} after {count}", tested))
            told = f"{values.mean() / study.unit:.2f}" if len(values) else "nothing"
            here[spoken(arm.strategy)].append(f"{told} after {count}")
    return Examined(lacking, evidence, "; ".join(f"{name} {', '.join(each)}" for name, each in here.items()), NO_TEST)


def _spread(_: Claim, study: Study) -> Examined:
    if study.last < 3:
        return Examined([f"value after 3 samples: it ends after {study.last}"])
    sides = [
        {arm.strategy: own for arm in study.of(names) if len(own := arm.complete(3, study.last)) > 1}
        for names in (paper.FIT, paper.WEAK)
    ]
    names = [name for side in sides for name in side]
    lacking = [spoken(name).lower() for name in paper.STRATEGIES if name not in names]
    if not all(sides):
        return Examined(lacking)
    tested = statistics.narrower(*(list(side.values()) for side in sides))
    here = f"ratio of the deviations over 3 to {study.last} samples {tested.estimate}"
    evidence = Evidence(f"ratio of the deviations below {paper.NEARER_TO_A_THIRD:.2f}", tested)
    return Examined(lacking, [evidence], here, NO_TEST, study.unequal(names))


def _shape(claim: Claim, study: Study) -> Examined:
    arms, lacking = study.of(), _lacking(study, paper.STRATEGIES)
    if not arms or study.last < FEWEST_SAMPLES:
        return Examined([*lacking, *([_ends(study, FEWEST_SAMPLES)] if arms else [])])
    middle, last, evidence, told = study.last // 2, study.last, [], []
    (unit, of_direct), rises = (1.0, "") if np.isnan(study.unit) else (study.unit, " of direct"), claim.kind == "rises"
    for arm in arms:
        recorded = arm.complete(0, last)
        early, late = recorded[:, middle] - recorded[:, 0], recorded[:, -1] - recorded[:, middle]
        gains = early + late if rises else early / middle - late / (last - middle)
        tested = statistics.above([gains], paper.LEAST_RISE if rises else 0.0, study.unit)
        evidence.append(Evidence(f"{spoken(arm.strategy)} {claim.kind}", tested))
        if len(recorded):
            both = (_signed(float(each.mean() / unit)) for each in (early, late))
            told.append(f"{spoken(arm.strategy)} {' and '.join(both)}")
    here = f"gain{of_direct} to {middle} samples, and from there to {last}: {'; '.join(told)}"
    return Examined(lacking, evidence, here, NO_TEST)


class Pair(NamedTuple):
    """A statement that one strategy is above another, with its values in a study.

    Attributes:
        words: the statement.
        least: the least difference that agrees with the paper's, as a share of direct; 0 if it gives none.
        groups: values `(r,)` of the first and the second, one for each repetition.
        student: the paper's test, of the values at all numbers of evaluations.
    """

    words: str
    least: float
    groups: tuple[FloatArray, FloatArray]
    student: Test


def _order(claim: Claim, study: Study) -> Examined:
    named = [tuple(each.split(" > ")) for each in claim.pairs]
    names = [name for name in paper.STRATEGIES if any(name in pair for pair in named)]
    lacking, (first, last) = _lacking(study, names), (claim.span[0], min(claim.span[1], study.last))
    present = [arms for pair in named if len(arms := study.of(pair)) > 1]
    if not present or last < first:
        return Examined([*lacking, *([_ends(study, first)] if present else [])])
    pairs = [_pair(claim, one, other, first, last) for one, other in present]
    return Examined(
        lacking,
        [
            Evidence(
                pair.words,
                statistics.above(pair.groups, pair.least, study.unit),
                statistics.above(pair.groups[::-1], 0.0, study.unit).shows,
            )
            for pair in pairs
        ],
        _least(study, pairs),
        _paper_test(claim, pairs, first, last),
        study.unequal(names),
    )


def _pair(claim: Claim, one: Arm, other: Arm, first: int, last: int) -> Pair:
    words = f"{spoken(one.strategy)} above {spoken(other.strategy).lower()}"
    pooled = (finite(arm.recorded[:, first : last + 1]) for arm in (one, other))
    groups = one.values(first, last), other.values(first, last)
    return Pair(words, claim.least(one.strategy, other.strategy), groups, compare(*pooled)[0])


def _least(study: Study, pairs: Sequence[Pair]) -> str:
    """Return the smallest lead of the strategies that the paper has ahead; it may be negative."""
    known = [
        (float(pair.groups[0].mean() - pair.groups[1].mean()), pair) for pair in pairs if all(map(len, pair.groups))
    ]
    if not known:
        return ""
    least, pair = min(known, key=lambda each: each[0])
    whose, unit = ("", 1.0) if np.isnan(study.unit) else (" of direct", study.unit)
    return f"{'difference' if len(known) == 1 else 'least difference'} {_signed(least / unit)}{whose} ({pair.words})"


def _paper_test(claim: Claim, pairs: Sequence[Pair], first: int, last: int) -> str:
    if claim.p is None:
        return NO_TEST
    where = f"at {number_of('sample', first)}" if first == last else f"pooled over {first} to {last} samples"
    known = [(pair.student.p, pair) for pair in pairs if pair.student.p is not None]
    found = sum(p < claim.p and (pair.student.statistic or 0.0) > 0 for p, pair in known)
    largest = max(known, key=lambda each: each[0], default=None)
    told = f"; largest p {probability(largest[0])} ({largest[1].words})" if largest else ""
    return f"Student {where}: {found} of {number_of('pair', len(pairs))} with p < {claim.p:g}{told}"


def _lacking(study: Study, names: Sequence[str]) -> list[str]:
    return [spoken(name).lower() for name in names if not study.arm(name)]


def _ends(study: Study, count: int) -> str:
    return f"value after {number_of('sample', count)}: it ends after {study.last}"


def _signed(value: float) -> str:
    return f"{value:+.3f}".replace("-", "\N{MINUS SIGN}")


OTHER_WAY = "the other way"
"""In the place of a p whose estimate points away from what the p would show."""
MOST_NAMED = 3
"""Statements that a reason names."""


class Verdict(StrEnum):
    """What a study says of a claim, as the page writes it."""

    REPRODUCED = "**reproduced**"
    SMALLER = "**reproduced**, smaller"
    NOT = "**not reproduced**"
    OPEN = "open"
    ABSENT = "not in this study"

    @property
    def reproduced(self) -> bool:
        """Return whether the claim is reproduced, as large as in the paper or smaller."""
        return self in {Verdict.REPRODUCED, Verdict.SMALLER}


class Judged(NamedTuple):
    """A verdict: what was examined, the test that it rests on, and the reason."""

    verdict: Verdict
    examined: Examined
    careful: str
    why: str


@cache
def judge(claim: Claim, *studies: Study) -> Judged:
    """Return the verdict of a study on a claim; of several, on the estimates of its statements taken together."""
    each = [examine(claim, study) for study in studies]
    return _judged(each[0] if len(each) == 1 else _together(each))


def _together(parts: Sequence[Examined]) -> Examined:
    """Return a claim as several studies show it, in the statements that all of them have."""
    found = [{one.statement: one.tested for one in part.evidence} for part in parts]
    shared = [name for name in found[0] if all(name in each for each in found)]
    evidence = [Evidence(name, pooled([each[name] for each in found])) for name in shared]
    here = "; ".join(f"{each.statement} {each.tested.estimate}" for each in evidence[:MOST_NAMED])
    lacking = list(dict.fromkeys(each for part in parts for each in part.lacking))
    return Examined(lacking, evidence, here, "", next((part.unequal for part in parts if part.unequal), None))


def _judged(examined: Examined) -> Judged:
    evidence = examined.evidence
    lacking = f"Missing: {', '.join(examined.lacking)}." if examined.lacking else ""
    if not evidence:
        return Judged(Verdict.ABSENT, examined, "", lacking)
    shown = [each for each in evidence if significant(each.tested.shows)]
    corrected = holm([each.tested.refutes for each in evidence])
    too_small = [each for each, p in zip(evidence, corrected, strict=True) if significant(p)]
    refuted = [each for each in too_small if each not in shown]
    verdict, why = Verdict.OPEN, f"Shown for what the study has. {lacking}"
    if examined.unequal:
        why = f"Not a fair comparison: {examined.unequal}. {lacking}".strip()
    elif refuted:
        verdict, why = Verdict.NOT, f"Refuted: {'; '.join(map(_refutation, refuted))}."
    elif len(shown) < len(evidence):
        why = f"{_undecided([each for each in evidence if each not in shown])} {lacking}".strip()
    elif not lacking:
        smaller = [each for each in evidence if significant(each.tested.smaller) or each in too_small]
        verdict, why = Verdict.REPRODUCED, "Every statement is shown."
        if smaller:
            verdict, why = Verdict.SMALLER, f"{why[:-1]}, but smaller than in the paper: {_some(smaller)}."
    return Judged(verdict, examined, _careful(evidence, shown, refuted), why)


def significant(p: float | None) -> bool:
    """Return whether a p is known and below the limit."""
    return p is not None and p < SIGNIFICANT


def worded(p: float | None) -> str:
    """Return a p in words: without a number if the estimate points away from what the p would show.

    A p that three decimals do not tell from the limit has four.
    """
    if p is not None and f"{p:.3f}" == f"{SIGNIFICANT:.3f}":
        return f"{p:.4f}"
    return OTHER_WAY if p == 1.0 else probability(p)


def _refutation(one: Evidence) -> str:
    opposite = f"; the opposite is shown, p {worded(one.opposed)}" if significant(one.opposed) else ""
    return f"{one.statement} (p {worded(one.tested.refutes)}{opposite})"


def _careful(evidence: Sequence[Evidence], shown: Sequence[Evidence], refuted: Sequence[Evidence]) -> str:
    """Return how many statements are shown and refuted, with the weakest one."""
    known = [(each.tested.shows, each.statement) for each in evidence if each.tested.shows is not None]
    uncorrected = ", uncorrected" if 0 < len(shown) < len(evidence) else ""
    parts = [f"{len(shown)} of {len(evidence)} shown{uncorrected}"]
    parts += [f"{len(refuted)} refuted"] if refuted else []
    if known:
        p, statement = max(known)
        parts.append(f"largest p: {worded(p)} ({statement})")
    return "; ".join(parts)


def _undecided(evidence: Sequence[Evidence]) -> str:
    unknown = [each for each in evidence if each.tested.shows is None]
    decided = [each for each in evidence if each.tested.shows is not None]
    told = [f"Neither shown nor refuted: {_some(decided)}."] if decided else []
    told += [f"Too few values, or none that vary: {_some(unknown)}."] if unknown else []
    return " ".join(told)


def _some(evidence: Sequence[Evidence]) -> str:
    """Return the first statements, and how many follow; the tables of statements have all."""
    more = len(evidence) - MOST_NAMED
    told = "; ".join(each.statement for each in evidence[:MOST_NAMED])
    return f"{told}; and {more} more" if more > 0 else told
