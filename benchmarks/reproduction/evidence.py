"""What speaks for and against a claim, and the verdict on it.

A claim is made of statements. A statement has two p-values: of the hypothesis that it does not hold, which supports it
if small, and of the hypothesis that it holds in the size that the paper's own numbers imply, which refutes it if small.
Each repetition is one value.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from benchmarks.reproduction.paper import CORRELATIONS, SIMULATED_FIT, WEAK, deviation
from benchmarks.reproduction.paper import POWER as PAPER_POWER
from benchmarks.reproduction.statements import POWER, Tested
from gaplab.services.core.equivalence import SIGNIFICANT
from gaplab.services.core.statistics import holm
from gaplab.services.core.trends import FEWEST_REPETITIONS
from gaplab.services.reports.numbers import probability

NO_TEST = "none in the paper"
OTHER_WAY = "the other way"
"""In the place of a p whose estimate points away from what the p would show."""


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
    "**refuted** if the p of the hypothesis that it holds, in the size that the claim's rule names, is below "
    f"{SIGNIFICANT}. All p are two-sided, those of margins too. They are of Welch's t, since strategies vary "
    "unequally; but C3 has a bootstrap over repetitions, and C8a and C8b Student's t of gains that are paired by "
    "repetition.",
    "*reproduced*: every statement of the claim is shown. *reproduced, smaller*: so it is, but one is shown to be "
    "smaller than in the paper. *not reproduced*: a statement is refuted, and is not shown in a smaller size. *open*: "
    "anything else. A claim that the study cannot speak of is *not in this study*.",
    "A claim needs all of its statements, so the p that show them are not corrected (an intersection–union test). One "
    "refuted statement refutes the claim, so the p that refute are corrected by Holm's method over its statements; the "
    "tables have each p as it is before. Nothing is corrected over the claims, nor over the studies: of many true "
    "claims, up to one in forty is refuted by chance, and of many false claims of one statement, as many are "
    "*reproduced*. The rates are higher where results were read while a study grew, and for C3 in a small study: with "
    "six repetitions, the bootstrap shows in one of twenty that a ratio of exactly 0.58 is below it.",
    "The least size of a difference is the one that the paper's design would have found with a power of "
    f"{PAPER_POWER:.0%} (Simonsohn 2015), in the paper's own standard deviations: {deviation(SIMULATED_FIT[0]):.2f} of "
    f"direct for the strategies with simulated fit, and {deviation(WEAK[0]):.2f} for the others. A smaller one gives "
    "such a p in less than a third of such studies. Where the paper takes several numbers of samples together, we "
    f"suppose that the values of a repetition correlate at {CORRELATIONS[0]} with simulated fit, and at "
    f"{CORRELATIONS[1]} without, about as ours do. If they correlated more, the sizes would be smaller, and refuting "
    "harder.",
    "Two choices make these sizes larger than Simonsohn's: the limit is the p that the paper prints, not 5 %, and "
    "sizes are shares of direct, not standard deviations, which are smaller here than in the paper. Verdicts depend "
    "on that. In MuJoCo, with either choice of his, C5c is *reproduced*, not *smaller*; with sizes in standard "
    "deviations, C6 is *open*. For a reality in PhysX, with 5 %, C5b is *open*. On the toy, with sizes in standard "
    "deviations, C5c, C6 and, with the paper's budget, C5a are *open*, and C4a is *not reproduced*.",
    "Margins of ours are the factors in C3, half of the paper's rise in C8a, that the first half gains more in C8b, "
    "and the four samples of C2b.",
    "Sample size: each repetition is one value, its mean over the numbers of samples that the claim names. A group "
    f"of fewer than {FEWEST_REPETITIONS} repetitions says nothing, so its statement is open. A p above {SIGNIFICANT} "
    "refutes nothing: too few repetitions leave a claim open. The reason then says which difference such a study finds "
    f"in {POWER:.0%} of cases.",
    "Equal budgets: the experiments of a study have one robot, engine and budget. A claim that compares strategies is "
    "open if these select their samples from searches of unequal size, as with `reuse_transfer`. Direct selects no "
    "samples, so claims on direct are judged nevertheless; but better selections may raise a strategy over direct.",
    "If a study lacks strategies or samples that a claim names, the others can refute the claim, but not reproduce it.",
    "A verdict holds for the budget, the robot, the engines and the optimizer of its study. Under `lean`, controllers "
    "come from CMA-ES: these are claims on the paper's strategies with another optimizer. Of several experiments with "
    "one strategy, the first counts.",
    "Computing time decided how many repetitions a study has. The results were read each time before more repetitions "
    "were added, and no p is corrected for this. Where fewer were computed than planned, their number is followed by "
    "the planned one, as in *20 of 40*. The supposed correlations, and the direction of C5b and C6, were chosen after "
    "results were read; before, both were *open* in MuJoCo, where they are now *not reproduced*. So was the second "
    "factor of C3: without it, C3 is *reproduced* where it is *reproduced, smaller*. C2b, C4c and C8c were added after "
    "results were read, and C8 was a single claim, which was *open*. Controls were chosen to explain results.",
)
"""The rules of a verdict, in sentences."""


@dataclass(frozen=True)
class Evidence:
    """One statement of a claim.

    Attributes:
        statement: the statement, as part of a sentence.
        tested: its p-values and its estimate.
        opposed: p of the hypothesis that its opposite does not hold; None if undefined, or if it has no opposite.
    """

    statement: str
    tested: Tested
    opposed: float | None = None

    @property
    def shown(self) -> bool:
        """Return whether it is shown."""
        return _significant(self.tested.shows)

    @property
    def smaller(self) -> bool:
        """Return whether it is shown to be smaller than in the paper by a test of its own."""
        return _significant(self.tested.smaller)


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
    """A verdict.

    Attributes:
        verdict: the verdict.
        careful: the test that it rests on.
        why: the reason.
        refuted: the statements that refute the claim; empty unless it is `NOT`.
    """

    verdict: Verdict
    careful: str
    why: str
    refuted: tuple[str, ...] = ()


def judge(examined: Examined) -> Judged:
    """Return the verdict on a claim, by `RULES`."""
    lacking = f"Missing: {', '.join(examined.lacking)}." if examined.lacking else ""
    if not examined.evidence:
        return Judged(Verdict.ABSENT, "", lacking)
    shown = [each for each in examined.evidence if each.shown]
    too_small = _refuted(examined.evidence)
    refuted = [each for each in too_small if not each.shown]
    careful = _careful(examined.evidence, shown, refuted)
    if examined.unequal:
        return Judged(Verdict.OPEN, careful, f"Not a fair comparison: {examined.unequal}. {lacking}".strip())
    if refuted:
        told = f"Refuted: {'; '.join(map(_refutation, refuted))}."
        return Judged(Verdict.NOT, careful, told, tuple(each.statement for each in refuted))
    if len(shown) == len(examined.evidence):
        if lacking:
            return Judged(Verdict.OPEN, careful, f"Shown for what the study has. {lacking}")
        return _all_shown(careful, [each for each in examined.evidence if each.smaller or each in too_small])
    told = _undecided([each for each in examined.evidence if not each.shown])
    return Judged(Verdict.OPEN, careful, " ".join(filter(None, (told, examined.findable, lacking))))


def _all_shown(careful: str, smaller: Sequence[Evidence]) -> Judged:
    if not smaller:
        return Judged(Verdict.REPRODUCED, careful, "Every statement is shown.")
    told = _some([each.statement for each in smaller])
    return Judged(Verdict.SMALLER, careful, f"Every statement is shown, but smaller than in the paper: {told}.")


def _refuted(evidence: Sequence[Evidence]) -> list[Evidence]:
    """Return the evidence that is refuted, by corrected p."""
    corrected = holm([each.tested.refutes for each in evidence])
    return [each for each, p in zip(evidence, corrected, strict=True) if _significant(p)]


def _significant(p: float | None) -> bool:
    return p is not None and p < SIGNIFICANT


def _refutation(one: Evidence) -> str:
    told = f"p {worded(one.tested.refutes)}"
    if _significant(one.opposed):
        told += f"; the opposite is shown, p {worded(one.opposed)}"
    return f"{one.statement} ({told})"


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


def worded(p: float | None) -> str:
    """Return a p in words: without a number if the estimate points away from what the p would show.

    A p that three decimals do not tell from the limit has four.
    """
    if p is not None and f"{p:.3f}" == f"{SIGNIFICANT:.3f}":
        return f"{p:.4f}"
    return OTHER_WAY if p == 1.0 else probability(p)


def _undecided(evidence: Sequence[Evidence]) -> str:
    unknown = [each.statement for each in evidence if each.tested.shows is None]
    decided = [each.statement for each in evidence if each.tested.shows is not None]
    told = [f"Neither shown nor refuted: {_some(decided)}."] if decided else []
    told += [f"Too few values, or none that vary: {_some(unknown)}."] if unknown else []
    return " ".join(told)


def _some(statements: Sequence[str]) -> str:
    """Return the first statements, and how many follow; the tables of statements have all."""
    more = len(statements) - MOST_NAMED
    told = "; ".join(statements[:MOST_NAMED])
    return f"{told}; and {more} more" if more > 0 else told
