"""The document, as Markdown, from studies."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from benchmarks.reproduction import claim_tables, controls, evidence, origins, rankings, tables
from benchmarks.reproduction.claims import CLAIMS
from benchmarks.reproduction.controls import Row
from benchmarks.reproduction.costs import costs
from benchmarks.reproduction.limits import limits
from benchmarks.reproduction.opening import EXTENSION, OPENING, WORDS
from benchmarks.reproduction.paper import LEARNED_SD
from benchmarks.reproduction.studies import Study
from gaplab.services.store.session import Store

ROOT = Path(__file__).parents[2]
OTHER_WAY = f"*{evidence.OTHER_WAY.capitalize()}*: the estimate points away from what the p would show."


@dataclass(frozen=True, eq=False)
class Document:
    """What a document is made of.

    Attributes:
        store: database with the studies.
        studies: the studies, by their labels.
        folder: folder of the document, from which its links begin.
        pictures: address of each picture, by the label of its study and the number of its figure.
        controls: studies with one changed setting, by their labels; no claim is judged by them.
    """

    store: Store
    studies: dict[str, Study]
    folder: Path
    pictures: dict[tuple[str, int], str]
    controls: dict[str, Study]

    def text(self) -> str:
        """Return the document."""
        sections = [
            OPENING,
            WORDS,
            *self._short(),
            *self._verdicts(),
            *self._figure_4(),
            *self._rankings(),
            *self._origins(),
            *self._controls(),
            *self._claims(),
            self._differences(),
            *self._figure_3(),
            "\n".join(["## What the reconstruction cannot know", "", *(f"- {one}" for one in limits(self._link))]),
            "\n".join(["## How a verdict is reached", "", *(f"- {rule}" for rule in evidence.RULES)]),
            *self._statements(),
            self._studies(),
            self._costs(),
        ]
        return "\n\n".join(sections) + "\n"

    def _link(self, path: str | Path) -> str:
        """Return the address of a file, seen from the document."""
        return Path(os.path.relpath(ROOT / path, self.folder)).as_posix()

    def _short(self) -> Iterator[str]:
        """Yield the verdicts of each whole figure of a robot, and of other studies that decide a claim."""
        robots = dict(self._of_robots())
        told = {label: each for label, each in robots.items() if each.whole or claim_tables.decides(each)}
        for label, study in (told or robots).items():
            yield f"**In short**, {label} ({tables.in_words(study)}):"
            if len(study.arms[0].engines) > 1:
                yield EXTENSION
            if label in self.controls and not study.whole:
                yield f"*A control of {self._beside[label][0]}*: it was chosen after results of that study were read."
            yield claim_tables.in_short(study)
            if lead := origins.lead(study):
                yield f"{lead} [Why](#where-the-recorded-fitness-comes-from)."
            changed = [
                f"\n- [{control}](#{control}-beside-{label}): {shown}"
                for control, (beside, rows) in self._beside.items()
                if beside == label and (shown := controls.shown(rows))
            ]
            if changed:
                yield (
                    "Controls that differ from it, after Holm's correction, with the strategies and their numbers of "
                    f"samples:\n{''.join(changed)}"
                )

    @cached_property
    def _beside(self) -> dict[str, tuple[str, list[Row]]]:
        """Return the study beside each control, and the differences from it."""
        found = {label: controls.compared_with(control, self.studies) for label, control in self.controls.items()}
        return {
            label: (beside, list(controls.rows(self.controls[label], self.studies[beside])))
            for label, beside in found.items()
        }

    def _differences(self) -> str:
        columns = dict(self._of_robots())
        rows = tables.paper_rows([*columns.values()])
        return f"## What differs from the paper\n\n{tables.table(('', 'the paper', *columns), rows)}"

    def _control_options(self) -> str:
        return "".join(f" --control {_files(each)}" for each in self.controls.values())

    def _studies(self) -> str:
        archives = " ".join(_files(study) for study in self.studies.values())
        return (
            f"## The studies\n\n{self._study_table(self.studies)}\n\n"
            "This command wrote the page from these archives; run it again instead of editing the page:\n\n"
            f"```sh\npython -m benchmarks.reproduction {archives}{self._control_options()} -o docs/reproduction.md\n```"
        )

    def _study_table(self, studies: Mapping[str, Study]) -> str:
        rows = [
            tables.study_row(study, [f"[{each.stem}]({self._link(each)})" for each in study.archives])
            for study in studies.values()
        ]
        return tables.table(tables.STUDY_HEAD, rows)

    def _rankings(self) -> Iterator[str]:
        yield (
            "## Which strategies differ\n\nMean recorded fitness over direct. Strategies with a letter in common are "
            "not told apart by Welch's t after Holm's correction over the pairs of a column. Each repetition is one "
            "value. Before any sample all strategies do the same, so differences there are chance. The p of a claim "
            "are [not corrected](#how-a-verdict-is-reached), so it may tell strategies with a common letter apart."
        )
        for label, study in self._of_robots():
            if len(study.present) > 1 and len(study.direct):
                told = tables.table(rankings.head(study), rankings.rows(study))
                unfair = study.unequal(study.present)
                warning = [f"The letters compare unfairly: {unfair}."] if unfair else []
                yield "\n\n".join([f"**{label}**, {tables.in_words(study)}", told, *warning])

    def _of_robots(self) -> Iterator[tuple[str, Study]]:
        """Yield the studies, without those of the toy if there are others."""
        toys = {label for label, each in self.studies.items() if tables.is_toy(each)}
        yield from (each for each in self.studies.items() if each[0] not in toys or len(toys) == len(self.studies))

    def _verdicts(self) -> Iterator[str]:
        robots = dict(self._of_robots())
        yield (
            f"## The verdicts\n\n{claim_tables.verdicts(robots)}\n\n"
            "Each verdict has its reason [below](#the-claims), and follows from [rules](#how-a-verdict-is-reached)."
        )
        toys = {label: each for label, each in self.studies.items() if label not in robots}
        if toys:
            yield (
                "### On the toy function\n\nThe same rules on a function of one number; its verdicts say nothing of a "
                "robot. Direct search finds the maximum. No strategy can pass it (C2a), and most reach it, so they end "
                f"alike (C5 to C7).\n\n{claim_tables.verdicts(toys)}"
            )

    def _figure_4(self) -> Iterator[str]:
        yield (
            "## Fig. 4\n\nRecorded fitness over direct, mean ± standard deviation over repetitions (their number is in "
            "brackets), by number of real-world evaluations. A dash in the paper's rows is a number that its text does "
            "not have. The text has a range of standard deviations, without a number of samples: "
            f"{LEARNED_SD[0]:.2f} to {LEARNED_SD[1]:.2f} with simulated fit, and about three times as much for the "
            "others. *The best of samples + 1* is the mean fitness of the best of n + 1 direct searches, if there are "
            "20 or more: recorded fitness after n samples is also the best of n + 1, the samples and the transferred "
            "controller."
        )
        for label, study in self.studies.items():
            yield f"### {label}\n\n{tables.direct_in_words(study)}"
            if picture := self.pictures.get((label, 4)):
                yield f"![Recorded fitness of {label} against the number of real-world evaluations]({picture})"
            if len(study.direct) and study.present:
                yield tables.figure_4(study)

    def _figure_3(self) -> Iterator[str]:
        yield (
            "## Fig. 3\n\nThe paper shows one run on a toy function without numbers, and says that with more samples "
            "the simulations become more accurate, and the fitness of the transferred individual increases until it is "
            "near the maximum."
        )
        toys = {label: each for label, each in self.studies.items() if tables.is_toy(each)}
        if not toys:
            yield "None of the archives is a study of the toy function."
        for label, study in toys.items():
            yield f"### Fig. 3: {label}"
            if picture := self.pictures.get((label, 3)):
                yield f"![Function, simulators, samples and transfer in one repetition of {label}]({picture})"
            distances, ratios = tables.figure_3(self.store, study)
            yield f"Fitness of transferred controllers over direct:\n\n{ratios}"
            yield (
                f"#### Distance: {label}\n\nMedian distance of the best simulators from the truth, with the bounds of "
                f"each tunable scaled to 1:\n\n{distances}"
            )

    def _origins(self) -> Iterator[str]:
        yield origins.WORDS
        for label, study in self._of_robots():
            if len(study.direct) and study.present:
                told = tables.table(origins.HEAD, origins.rows(self.store, study))
                yield "\n\n".join(filter(None, (f"### Origins: {label}", origins.lead(study), told)))

    def _claims(self) -> Iterator[str]:
        yield f"## The claims\n\n{OTHER_WAY}"
        for claim in CLAIMS:
            told = claim_tables.reasons(claim, self.studies)
            yield f"### {claim.key}\n\n{claim.says}\n\nThe rule: {claim.rule}\n\n{told}"

    def _statements(self) -> Iterator[str]:
        yield (
            "## The statements\n\nDifferences and gains are divided by the mean of direct, which is taken as exact. "
            "Ratios to direct have its error too. Brackets have 95 % "
            f"intervals. Each p is as it is before any correction. {OTHER_WAY}"
        )
        for claim in CLAIMS:
            yield f"### {claim.key}, by statement\n\n{claim_tables.statements(claim, self.studies)}"

    def _controls(self) -> Iterator[str]:
        if not self.controls:
            return
        yield (
            "## Controls\n\nEach control repeats strategies of a study with one change, or with another preset. "
            "Fitness is over the direct baseline of its own study, and over the other's if the control has none; rows "
            "of direct itself are in the unit of fitness. Means are over the repetitions that both have. These share "
            "their random numbers, so they are paired; where there are two baselines, the difference has the errors of "
            "both (Welch and Satterthwaite). Brackets have 95 % intervals. Each p is uncorrected. A row that the "
            "change leaves the same in every repetition is left out. Repetitions that were computed on "
            f"[another kind of processor]({self._link('docs/keeping.md')}#numbers-and-processors) differ also where "
            "the change cannot act, as before any sample."
        )
        yield f"### The controls\n\n{self._study_table(self.controls)}"
        for label, control in self.controls.items():
            beside, rows = self._beside[label]
            told = f"What differs: {controls.change(control, self.studies[beside]) or 'nothing'}."
            found = f"Shown after Holm's correction over the table: {controls.shown(rows) or 'no difference'}."
            table = tables.table(controls.HEAD, (row.cells() for row in rows))
            yield f"### {label}, beside {beside}\n\n{told} {found}\n\n{table}"

    def _costs(self) -> str:
        return (
            "## What it took\n\nStored steps have the time of their computation. Attempts also have work that was "
            "lost, and waiting for a core; early archives lack them. A core-hour is an hour of one thread of the "
            "engine, on the machines of the archives' provenance, some of which had other work at the time.\n\n"
            f"{costs(self.studies | self.controls)}"
        )


def _files(study: Study) -> str:
    """Return the archives of a study as the command takes them."""
    return ",".join(os.path.relpath(each, ROOT) for each in study.archives)
