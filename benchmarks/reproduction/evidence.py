"""What speaks for and against a claim, and the verdict on it.

A claim is made of statements. A statement has two p-values: of the hypothesis that it does not hold, which supports it
if small, and of the hypothesis that it holds in the size that the paper's own numbers imply, which refutes it if small.
Each repetition is one value.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from benchmarks.reproduction.statements import POWER, SIGNIFICANT
from gaplab.services.core.statistics import holm
from gaplab.services.core.trends import FEWEST_REPETITIONS
from gaplab.services.reports.numbers import probability


class Verdict(StrEnum):
    """What a study says of a claim."""

    REPRODUCED = "reproduced"
    NOT = "not"
    OPEN = "open"
    ABSENT = "absent"


RULES = (
    f"A statement is **shown** if the p of the hypothesis that it does not hold is below {SIGNIFICANT}. It is "
    "**refuted** if the p of the hypothesis that it holds, in the least size that the paper's own numbers imply, is "
    f"below {SIGNIFICANT}. Both are corrected by Holm's method over the statements of the claim; the tables have each "
    "p as it is before.",
    "*reproduced*: every statement of the claim is shown. *not*: a statement is refuted, and is not shown in a smaller "
    "size. *open*: anything else. *absent*: the study has nothing that the claim speaks of.",
    "Sample size: each repetition is one value, its mean over the numbers of evaluations that the claim names. A group "
    f"of fewer than {FEWEST_REPETITIONS} repetitions says nothing, so its statement is open. A p above {SIGNIFICANT} "
    "refutes nothing: too few repetitions leave a claim open. The reason then says which difference the study could "
    f"find with a power of {POWER:.0%}.",
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
    "A verdict holds for the budget, the robot and the engines of its study. Budgets smaller than the paper's are "
    "stated, and change no verdict. Of several experiments with one strategy, the first counts.",
)
"""The rules of a verdict, in sentences."""


@dataclass(frozen=True)
class Evidence:
    """One statement of a claim.

    Attributes:
        statement: the statement, as part of a sentence.
        supports: p of the hypothesis that it does not hold; None if undefined.
        refutes: p of the hypothesis that it holds in the paper's size; None if undefined.
    """

    statement: str
    supports: float | None = None
    refutes: float | None = None


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
    lacking = f"The study has no {', no '.join(examined.lacking)}." if examined.lacking else ""
    if not examined.evidence:
        return Judged(Verdict.ABSENT, "", lacking)
    shown = _below(examined.evidence, [each.supports for each in examined.evidence])
    refuted = [each for each in _below(examined.evidence, [e.refutes for e in examined.evidence]) if each not in shown]
    careful = _careful(examined.evidence, shown, refuted)
    if examined.unequal:
        return Judged(Verdict.OPEN, careful, f"Not a fair comparison: {examined.unequal}. {lacking}".strip())
    if refuted:
        told = "; ".join(f"{each.statement} (p {probability(each.refutes)})" for each in refuted)
        return Judged(Verdict.NOT, careful, f"Refuted: {told}.")
    if len(shown) == len(examined.evidence):
        if lacking:
            return Judged(Verdict.OPEN, careful, f"Shown for what the study has. {lacking}")
        return Judged(Verdict.REPRODUCED, careful, "Every statement is shown.")
    told = _undecided([each for each in examined.evidence if each not in shown])
    return Judged(Verdict.OPEN, careful, " ".join(filter(None, (told, examined.findable, lacking))))


def _below(evidence: Sequence[Evidence], p_values: Sequence[float | None]) -> list[Evidence]:
    """Return the evidence whose corrected p is significant."""
    corrected = holm(p_values)
    return [each for each, p in zip(evidence, corrected, strict=True) if p is not None and p < SIGNIFICANT]


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
    told = [f"Neither shown nor refuted: {'; '.join(decided)}."] if decided else []
    told += [f"Too few values: {'; '.join(unknown)}."] if unknown else []
    return " ".join(told)
