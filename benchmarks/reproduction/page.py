"""The page, as Markdown, from studies: `page.toml` has its text."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from re import sub
from typing import Any

from benchmarks.reproduction import answer, controls, paper, results
from benchmarks.reproduction.claims import CLAIMS, DATA, Claim, judge, worded
from benchmarks.reproduction.controls import Row
from benchmarks.reproduction.results import table
from benchmarks.reproduction.studies import Study
from gaplab.services.findings.judged import FEWEST_REPETITIONS
from gaplab.services.findings.statistics import SIGNIFICANT

ROOT = Path(__file__).parents[2]
TEXT: dict[str, str] = DATA["text"]
NUMBERS: dict[str, Any] = {name: value for name, value in vars(paper).items() if name.isupper()} | {
    "PAPER_POWER": paper.POWER,
    "SIGNIFICANT": SIGNIFICANT,
    "FEWEST_REPETITIONS": FEWEST_REPETITIONS,
    "deviation_fit": paper.deviation(paper.FIT[0]),
    "deviation_weak": paper.deviation(paper.WEAK[0]),
}
CLAIMS_PAGE = "claims.md"
"""File of the second page, beside the first."""
LATE = "†"
"""Mark of a claim whose rule was completed after results were read."""
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

    def first(self) -> str:
        """Return the first page, or nothing without a whole figure of a robot."""
        if not self.whole:
            return ""
        others = [each for each in self.robots.values() if each not in self.whole and each.arm(answer.BEST)]
        label = next(label for label, each in self.studies.items() if each is self.whole[0])
        return (
            TEXT["first"]
            .format(
                **answer.numbers(self.whole, others),
                docs=self.docs,
                title=answer.title(self.whole),
                picture=self.pictures.get((label, 4), ""),
                rows=answer.rows(self.whole),
                claims=CLAIMS_PAGE,
            )
            .lstrip()
        )

    def text(self) -> str:
        """Return the page of the claims."""
        toys = {label: study for label, study in self.studies.items() if label not in self.robots}
        text = TEXT["page"].format(
            **NUMBERS,
            docs=self.docs,
            verdicts=self._verdicts(self.robots),
            verdicts_of_toys=TEXT["toys"].format(table=self._verdicts(toys)) if toys else "",
            figure_4="\n\n".join(self._figure_4()),
            origins="\n\n".join(self._origins()),
            controls=self._controls() if self.controls else "",
            claims="\n\n".join(map(self._claim, CLAIMS)),
            figure_3="\n\n".join(self._figure_3()),
            statements="\n\n".join(map(self._statements, CLAIMS)),
            studies=self._table(self.studies, results.THE_PAPER),
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
    def judged(self) -> dict[str, tuple[Study, ...]]:
        """Return the studies by their labels, and the whole figures of a robot together if there are several."""
        together = {answer.ALL: self.whole} if len(self.whole) > 1 else {}
        return {label: (each,) for label, each in self.studies.items()} | together

    @cached_property
    def beside(self) -> dict[str, tuple[str, list[Row]]]:
        """Return the study beside each control, and the differences from it."""
        found = {label: controls.compared_with(control, self.studies) for label, control in self.controls.items()}
        return {
            label: (beside, list(controls.rows(self.controls[label], self.studies[beside])))
            for label, beside in found.items()
        }

    @cached_property
    def whole(self) -> tuple[Study, ...]:
        """Return the whole figures of a robot."""
        return tuple(each for each in self.robots.values() if each.whole)

    def _link(self, path: Path) -> str:
        return Path(os.path.relpath(path, self.folder)).as_posix()

    def _verdicts(self, studies: Mapping[str, Study]) -> str:
        judged = {label: each for label, each in self.judged.items() if set(each) <= set(studies.values())}
        rows = (
            (
                f"{claim.key}{LATE if claim.late else ''}: {_formatted(claim, claim.says)}",
                *(judge(claim, *each).verdict for each in judged.values()),
            )
            for claim in CLAIMS
        )
        return table(("claim", *judged), rows)

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
                yield f"### Origins: {label}\n\n{results.leads(study)}\n\n{results.origins(study)}"

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
            for label, found in ((label, judge(claim, *each)) for label, each in self.judged.items())
        )
        says, rule = _formatted(claim, claim.says), _formatted(claim, claim.rule)
        return f"### {claim.key}\n\n{says}\n\nThe rule: {rule}\n\n{table(CLAIM, rows)}"

    def _statements(self, claim: Claim) -> str:
        rows = (
            (label, each.statement, each.tested.estimate, worded(each.tested.shows), worded(each.tested.refutes))
            for label, studies in self.judged.items()
            for each in judge(claim, *studies).examined.evidence
        )
        return f"### {claim.key}, by statement\n\n{table(STATEMENT, rows)}"

    def _table(self, studies: Mapping[str, Study], *first: tuple[str, ...]) -> str:
        rows = [
            results.study_row(study, [f"[{each.stem}]({self._link(each)})" for each in study.archives])
            for study in studies.values()
        ]
        return table(results.STUDY_HEAD, [*first, *rows])


def _formatted(claim: Claim, text: str) -> str:
    pairs = {"fit": paper.FIT[:2], "mixed": (paper.FIT[0], paper.WEAK[0]), "weak": paper.WEAK[:2]}
    return text.format(**NUMBERS, **{f"least_{name}": claim.least(*pair) for name, pair in pairs.items()})


def _files(study: Study) -> str:
    """Return the archives of a study as the command takes them."""
    return ",".join(os.path.relpath(each, ROOT) for each in study.archives)
