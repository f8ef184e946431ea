"""The verdict on a claim, by the rules that `page.toml` states."""

from collections.abc import Sequence
from enum import StrEnum
from functools import cache
from typing import NamedTuple

from benchmarks.reproduction.claims import Claim, Evidence, Examined, examine
from benchmarks.reproduction.statistics import pooled
from benchmarks.reproduction.studies import Study
from gaplab.services.findings.statistics import SIGNIFICANT, holm
from gaplab.services.findings.wording import probability

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
