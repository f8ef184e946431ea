"""The tables of claims: verdicts, reasons and statements, as Markdown."""

from collections.abc import Mapping
from functools import cache

from benchmarks.reproduction.claims import CLAIMS, Claim
from benchmarks.reproduction.evidence import Examined, Judged, Verdict, judge, worded
from benchmarks.reproduction.studies import Study
from benchmarks.reproduction.tables import table

WORDS = {
    Verdict.REPRODUCED: "**reproduced**",
    Verdict.SMALLER: "**reproduced**, smaller",
    Verdict.NOT: "**not reproduced**",
    Verdict.OPEN: "open",
    Verdict.ABSENT: "not in this study",
}
UNDECIDED = {Verdict.OPEN, Verdict.ABSENT}
CLAIM_HEAD = "study", "verdict", "here", "the paper's test", "our test", "why"
STATEMENT_HEAD = "study", "statement", "here", "p that shows it", "p that refutes it"


@cache
def judged(claim: Claim, study: Study) -> tuple[Examined, Judged]:
    """Return a claim as a study shows it, and the verdict."""
    examined = claim.examine(study)
    return examined, judge(examined)


def decides(study: Study) -> bool:
    """Return whether a study reproduces or refutes a claim."""
    return any(judged(claim, study)[1].verdict not in UNDECIDED for claim in CLAIMS)


def in_short(study: Study) -> str:
    """Return the claims of each verdict in a study, as a list in Markdown; undecided ones are keys alone."""
    found = {verdict: [claim for claim in CLAIMS if judged(claim, study)[1].verdict is verdict] for verdict in Verdict}
    return "\n".join(
        f"- {WORDS[verdict]}: {'; '.join(_named(claim, study) for claim in claims)}."
        for verdict, claims in found.items()
        if claims
    )


def _named(claim: Claim, study: Study) -> str:
    """Return a claim in a few words, with its statements if some are refuted; the key alone of an undecided one."""
    examined, found = judged(claim, study)
    if found.verdict in UNDECIDED:
        return claim.key
    shown = [each.statement for each in examined.evidence if each.shown and each.statement not in found.refuted]
    sides = {"shown": shown, "refuted": found.refuted} if found.refuted else {}
    told = [f"; {side}: {', '.join(each.lower() for each in names)}" for side, names in sides.items() if names]
    return f"{claim.title} ({claim.key}{''.join(told)})"


def verdicts(studies: Mapping[str, Study]) -> str:
    """Return the verdict on each claim by study."""
    rows = (
        (f"{claim.key}: {claim.says}", *(WORDS[judged(claim, study)[1].verdict] for study in studies.values()))
        for claim in CLAIMS
    )
    return table(("claim", *studies), rows)


def reasons(claim: Claim, studies: Mapping[str, Study]) -> str:
    """Return the verdicts on a claim with numbers, tests and reasons."""
    found = {label: judged(claim, study) for label, study in studies.items()}
    rows = (
        (label, WORDS[verdict.verdict], examined.here, examined.paper_test, verdict.careful, verdict.why)
        for label, (examined, verdict) in found.items()
    )
    return table(CLAIM_HEAD, rows)


def statements(claim: Claim, studies: Mapping[str, Study]) -> str:
    """Return the statements of a claim with estimates and both p."""
    rows = (
        (label, each.statement, each.tested.estimate, worded(each.tested.shows), worded(each.tested.refutes))
        for label, study in studies.items()
        for each in judged(claim, study)[0].evidence
    )
    return table(STATEMENT_HEAD, rows)
