"""The page, as Markdown, from studies: `page.toml` has its text."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from re import sub
from typing import Any

from benchmarks.reproduction import controls, paper, results, settings
from benchmarks.reproduction.claims import CLAIMS, DATA, Claim
from benchmarks.reproduction.controls import Row
from benchmarks.reproduction.settings import table
from benchmarks.reproduction.studies import Study
from benchmarks.reproduction.verdicts import Verdict, judge, worded
from gaplab.services.core.equivalence import SIGNIFICANT
from gaplab.services.core.trends import FEWEST_REPETITIONS

ROOT = Path(__file__).parents[2]
TEXT: dict[str, str] = DATA["text"]
NUMBERS: dict[str, Any] = {name: value for name, value in vars(paper).items() if name.isupper()} | {
    "PAPER_POWER": paper.POWER,
    "SIGNIFICANT": SIGNIFICANT,
    "FEWEST_REPETITIONS": FEWEST_REPETITIONS,
    "deviation_fit": paper.deviation(paper.FIT[0]),
    "deviation_weak": paper.deviation(paper.WEAK[0]),
}
CLAIM = ("study", "verdict", "here", "the paper's test", "our test", "why")
STATEMENT = ("study", "statement", "here", "p that shows it", "p that refutes it")


@dataclass(frozen=True, eq=False)
class Page:
    """What the page is made of.

    Attributes:
        studies: by their labels.
        controls: studies with one changed setting, by their labels; no claim is judged by them.
        folder: of the page, from which its links begin.
        pictures: address of each picture, by the label of its study and the number of its figure.
    """

    studies: Mapping[str, Study]
    controls: Mapping[str, Study]
    folder: Path
    pictures: Mapping[tuple[str, int], str]

    def text(self) -> str:
        """Return the page."""
        toys = {label: study for label, study in self.studies.items() if label not in self.robots}
        text = TEXT["page"].format(
            **NUMBERS,
            docs=self.docs,
            short="\n\n".join(self._short()),
            verdicts=self._verdicts(self.robots),
            verdicts_of_toys=TEXT["toys"].format(table=self._verdicts(toys)) if toys else "",
            figure_4="\n\n".join(self._figure_4()),
            origins="\n\n".join(self._origins()),
            controls=self._controls() if self.controls else "",
            claims="\n\n".join(map(self._claim, CLAIMS)),
            figure_3="\n\n".join(self._figure_3()),
            statements="\n\n".join(map(self._statements, CLAIMS)),
            studies=self._table(self.studies, settings.PAPER),
            arguments=" ".join(
                [_files(each) for each in self.studies.values()]
                + [f"--control {_files(each)}" for each in self.controls.values()]
            ),
        )
        return sub(r"\n{3,}", "\n\n", text).strip() + "\n"

    @property
    def docs(self) -> str:
        """Return the address of the folder of documents, seen from the page."""
        return self._link(ROOT / "docs" / "_").removesuffix("_")

    @cached_property
    def robots(self) -> dict[str, Study]:
        """Return the studies, without those of the toy if there are others."""
        return {label: each for label, each in self.studies.items() if not each.toy} or dict(self.studies)

    @cached_property
    def beside(self) -> dict[str, tuple[str, list[Row]]]:
        """Return the study beside each control, and the differences from it."""
        found = {label: controls.compared_with(control, self.studies) for label, control in self.controls.items()}
        return {
            label: (beside, list(controls.rows(self.controls[label], self.studies[beside])))
            for label, beside in found.items()
        }

    def _link(self, path: Path) -> str:
        return Path(os.path.relpath(path, self.folder)).as_posix()

    def _short(self) -> Iterator[str]:
        """Yield the verdicts of each whole figure of a robot, and of other studies that decide a claim."""
        told = {
            label: each
            for label, each in self.robots.items()
            if each.whole or any(judge(claim, each).verdict.decided for claim in CLAIMS)
        }
        for label, study in (told or self.robots).items():
            yield f"**In short**, {label} ({settings.in_words(study)}):"
            if study.spec.reality.engine and study.reality != study.spec.engine.name:
                yield TEXT["extension"]
            if label in self.controls and not study.whole:
                yield f"*A control of {self.beside[label][0]}*: it was chosen after results of that study were read."
            yield _in_short(study)
            if lead := results.lead(study):
                yield f"{lead} [Why](#where-the-recorded-fitness-comes-from)."
            changed = [
                f"- [{control}](#{control}-beside-{label}): {shown}"
                for control, (beside, rows) in self.beside.items()
                if beside == label and (shown := controls.shown(rows))
            ]
            if changed:
                yield "\n\n".join([TEXT["changed"], "\n".join(changed)])

    def _verdicts(self, studies: Mapping[str, Study]) -> str:
        found = {claim: [judge(claim, study).verdict for study in studies.values()] for claim in CLAIMS}
        rows = ((f"{claim.key}: {_formatted(claim, claim.says)}", *each) for claim, each in found.items())
        return table(("claim", *studies), rows)

    def _figure_4(self) -> Iterator[str]:
        for label, study in self.studies.items():
            yield f"### {label}\n\n{results.direct_in_words(study)}"
            if picture := self.pictures.get((label, 4)):
                yield f"![Recorded fitness of {label} against the number of real-world evaluations]({picture})"
            if len(study.direct) and study.present:
                yield results.figure_4(study)

    def _figure_3(self) -> Iterator[str]:
        toys = {label: each for label, each in self.studies.items() if each.toy}
        if not toys:
            yield "None of the archives is a study of the toy function."
        for label, study in toys.items():
            yield f"### Fig. 3: {label}"
            if picture := self.pictures.get((label, 3)):
                yield f"![Function, simulators, samples and transfer in one repetition of {label}]({picture})"
            ratios, distances = results.figure_3(study)
            yield f"Fitness of transferred controllers over direct:\n\n{ratios}"
            yield f"#### Distance: {label}\n\n{TEXT['distance']}\n\n{distances}"

    def _origins(self) -> Iterator[str]:
        for label, study in self.robots.items():
            if len(study.direct) and study.present:
                yield f"### Origins: {label}\n\n{results.lead(study)}\n\n{results.origins(study)}"

    def _controls(self) -> str:
        each = []
        for label, (beside, rows) in self.beside.items():
            changed = controls.change(self.controls[label], self.studies[beside]) or "nothing"
            found = table(controls.HEAD, (row.cells() for row in rows))
            each.append(
                f"### {label}, beside {beside}\n\nWhat differs: {changed}. Shown after Holm's correction over the "
                f"table: {controls.shown(rows) or 'no difference'}.\n\n{found}"
            )
        text = TEXT["controls"]
        return text.format(docs=self.docs, table=self._table(self.controls), each="\n\n".join(each))

    def _claim(self, claim: Claim) -> str:
        rows = (
            (label, found.verdict, found.examined.here, found.examined.paper_test, found.careful, found.why)
            for label, found in ((label, judge(claim, study)) for label, study in self.studies.items())
        )
        says, rule = _formatted(claim, claim.says), _formatted(claim, claim.rule)
        return f"### {claim.key}\n\n{says}\n\nThe rule: {rule}\n\n{table(CLAIM, rows)}"

    def _statements(self, claim: Claim) -> str:
        rows = (
            (label, each.statement, each.tested.estimate, worded(each.tested.shows), worded(each.tested.refutes))
            for label, study in self.studies.items()
            for each in judge(claim, study).examined.evidence
        )
        return f"### {claim.key}, by statement\n\n{table(STATEMENT, rows)}"

    def _table(self, studies: Mapping[str, Study], *first: tuple[str, ...]) -> str:
        rows = [
            settings.row(study, [f"[{each.stem}]({self._link(each)})" for each in study.archives])
            for study in studies.values()
        ]
        return table(settings.HEAD, [*first, *rows])


def _in_short(study: Study) -> str:
    """Return the claims of each verdict in a study, as a list in Markdown; undecided ones are keys alone."""
    found = {verdict: [claim for claim in CLAIMS if judge(claim, study).verdict is verdict] for verdict in Verdict}
    return "\n".join(
        f"- {verdict}: {'; '.join(_named(claim, study) for claim in claims)}."
        for verdict, claims in found.items()
        if claims
    )


def _named(claim: Claim, study: Study) -> str:
    """Return a claim in a few words, with its statements if some are refuted; the key alone of an undecided one."""
    found = judge(claim, study)
    if not found.verdict.decided:
        return claim.key
    sides = {"shown": found.shown, "refuted": found.refuted} if found.refuted else {}
    told = [f"; {side}: {', '.join(each.lower() for each in names)}" for side, names in sides.items() if names]
    return f"{claim.title} ({claim.key}{''.join(told)})"


def _formatted(claim: Claim, text: str) -> str:
    pairs = {"fit": paper.FIT[:2], "mixed": (paper.FIT[0], paper.WEAK[0]), "weak": paper.WEAK[:2]}
    return text.format(**NUMBERS, **{f"least_{name}": claim.least(*pair) for name, pair in pairs.items()})


def _files(study: Study) -> str:
    """Return the archives of a study as the command takes them."""
    return ",".join(os.path.relpath(each, ROOT) for each in study.archives)
