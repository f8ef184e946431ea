"""What speaks for and against a claim, and the verdict on it.

A claim is made of statements. A statement has two p-values: of the hypothesis that it does not hold, which supports it
if small, and of the hypothesis that it holds in the size that the paper's own numbers imply, which refutes it if small.
Each repetition is one value.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from benchmarks.reproduction.paper import POWER as POWER_OF
from benchmarks.reproduction.paper import SIMULATED_FIT, WEAK, deviation
from benchmarks.reproduction.statements import POWER, SIGNIFICANT
from gaplab.services.core.statistics import holm
from gaplab.services.core.trends import FEWEST_REPETITIONS
from gaplab.services.reports.numbers import probability


class Verdict(StrEnum):
    """What a study says of a claim."""

    REPRODUCED = "reproduced"
    SMALLER = "smaller"
    NOT = "not"
    OPEN = "open"
    ABSENT = "absent"


MOST_NAMED = 3
"""Statements that a reason names."""

RULES = (
    f"A statement is **shown** if the p of the hypothesis that it does not hold is below {SIGNIFICANT}. It is "
    "**refuted** if the p of the hypothesis that it holds, in the least size that the paper's own numbers imply, is "
    f"below {SIGNIFICANT}. These p are two-sided, but for tests that two means are within a margin.",
    "*reproduced*: every statement of the claim is shown. *reproduced, smaller*: so it is, but one is refuted in its "
    "size. *not*: a statement is refuted, and is not shown in a smaller size. *open*: anything else. A claim that the "
    "study cannot speak of is *not in this study*.",
    "A claim needs all of its statements, so the p that show them are not corrected (an intersection–union test). One "
    "refuted statement refutes the claim, so the p that refute are corrected by Holm's method over its statements; the "
    "tables have each p as it is before. Nothing is corrected over the claims.",
    "The least size of a difference is the one that the paper's design would have found with a power of "
    f"{POWER_OF:.0%} (Simonsohn 2015), in the paper's own standard deviations: {deviation(SIMULATED_FIT[0]):.2f} of "
    f"direct for the strategies with simulated fit, and {deviation(WEAK[0]):.2f} for the others. A smaller one could "
    "hardly have given the paper its p.",
    "Sample size: each repetition is one value, its mean over the numbers of evaluations that the claim names. A group "
    f"of fewer than {FEWEST_REPETITIONS} repetitions says nothing, so its statement is open. A p above {SIGNIFICANT} "
    "refutes nothing: too few repetitions leave a claim open. The reason then says which difference the study could "
    f"show with a power of {POWER:.0%}.",
    "Spread: strategies vary unequally, so a difference counts only if both Student's and Welch's p are below "
    f"{SIGNIFICANT}; the larger of the two is given.",
    "Equal budgets: the experiments of a study have one robot, engine and budget. A claim that compares strategies is "
    "open if these select their samples from searches of unequal size, as with `reuse_transfer`. A comparison with the "
    "direct baseline concerns the search for controllers only.",
    "A claim that names more strategies or samples than the study has is refuted by those that it has, but not "
    "reproduced by them.",
    "The paper's claims are of its quadruped. A study of the toy function is judged by the same rules, but its "
    "verdicts say nothing of a robot: evolution in the toy's reality finds the maximum, which no strategy can "
    "pass (C2).",
    "A verdict holds for the budget, the robot, the engines and the optimizer of its study. Under `lean`, controllers "
    "come from CMA-ES: these are claims on the paper's strategies with another optimizer. Of several experiments with "
    "one strategy, the first counts.",
    "The hours at hand, and no result, decided how many repetitions a study has.",
)
"""The rules of a verdict, in sentences."""


@dataclass(frozen=True)
class Evidence:
    """One statement of a claim.

    Attributes:
        statement: the statement, as part of a sentence.
        supports: p of the hypothesis that it does not hold; None if undefined.
        refutes: p of the hypothesis that it holds in the paper's size; None if undefined.
        estimate: what the study has in its place, with an interval.
        opposed: p of the hypothesis that its opposite does not hold; None if undefined, or if it has no opposite.
    """

    statement: str
    supports: float | None = None
    refutes: float | None = None
    estimate: str = ""
    opposed: float | None = None


@dataclass(frozen=True)
class Examined:
    """A claim as a study shows it.

    Attributes:
        here: the study's numbers.
        paper_test: result of the paper's own test.
        evidence: the statements; none if the study has nothing that the claim speaks of.
        lacking: what the claim names and the study lacks.
        unequal: why strategies are compared unfairly; None if they are not.
        findable: the least difference that the study could find, or what it would need, in a sentence.
    """

    here: str
    paper_test: str
    evidence: tuple[Evidence, ...]
    lacking: tuple[str, ...] = ()
    unequal: str | None = None
    findable: str = ""


@dataclass(frozen=True)
class Judged:
    """A verdict, with the test that it rests on, and the reason."""

    verdict: Verdict
    careful: str
    why: str


def judge(examined: Examined) -> Judged:
    """Return the verdict on a claim, by `RULES`."""
    lacking = f"Missing: {', '.join(examined.lacking)}." if examined.lacking else ""
    if not examined.evidence:
        return Judged(Verdict.ABSENT, "", lacking)
    shown = [each for each in examined.evidence if each.supports is not None and each.supports < SIGNIFICANT]
    smaller = _refuted(examined.evidence)
    refuted = [each for each in smaller if each not in shown]
    careful = _careful(examined.evidence, shown, refuted)
    if examined.unequal:
        return Judged(Verdict.OPEN, careful, f"Not a fair comparison: {examined.unequal}. {lacking}".strip())
    if refuted:
        return Judged(Verdict.NOT, careful, f"Refuted: {'; '.join(map(_refutation, refuted))}.")
    if len(shown) == len(examined.evidence):
        if lacking:
            return Judged(Verdict.OPEN, careful, f"Shown for what the study has. {lacking}")
        return _all_shown(careful, smaller)
    told = _undecided([each for each in examined.evidence if each not in shown])
    return Judged(Verdict.OPEN, careful, " ".join(filter(None, (told, examined.findable, lacking))))


def _all_shown(careful: str, smaller: Sequence[Evidence]) -> Judged:
    if not smaller:
        return Judged(Verdict.REPRODUCED, careful, "Every statement is shown.")
    told = _some([each.statement for each in smaller])
    return Judged(Verdict.SMALLER, careful, f"Every statement is shown, but smaller than in the paper: {told}.")


def _refuted(evidence: Sequence[Evidence]) -> list[Evidence]:
    """Return the evidence that is refuted, by corrected p."""
    corrected = holm([each.refutes for each in evidence])
    return [each for each, p in zip(evidence, corrected, strict=True) if p is not None and p < SIGNIFICANT]


def _refutation(one: Evidence) -> str:
    if one.opposed is not None and one.opposed < SIGNIFICANT:
        return f"{one.statement} (p {probability(one.refutes)}; the opposite is shown, p {probability(one.opposed)})"
    return f"{one.statement} (p {probability(one.refutes)})"


def _careful(evidence: Sequence[Evidence], shown: Sequence[Evidence], refuted: Sequence[Evidence]) -> str:
    """Return how many statements are shown and refuted, with the weakest support."""
    known = [each for each in evidence if each.supports is not None]
    parts = [f"{len(shown)} of {len(evidence)} shown"]
    parts += [f"{len(refuted)} refuted"] if refuted else []
    if known:
        weakest = max(known, key=lambda each: each.supports or 0.0)
        parts.append(f"largest p {probability(weakest.supports)} ({weakest.statement})")
    return "; ".join(parts)


def _undecided(evidence: Sequence[Evidence]) -> str:
    unknown = [each.statement for each in evidence if each.supports is None]
    decided = [each.statement for each in evidence if each.supports is not None]
    told = [f"Neither shown nor refuted: {_some(decided)}."] if decided else []
    told += [f"Too few values: {_some(unknown)}."] if unknown else []
    return " ".join(told)


def _some(statements: Sequence[str]) -> str:
    """Return the first statements, and how many follow; the tables of statements have all."""
    more = len(statements) - MOST_NAMED
    told = "; ".join(statements[:MOST_NAMED])
    return f"{told}; and {more} more" if more > 0 else told
