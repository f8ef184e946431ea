"""The arrangement of a report: which facts stand in which section."""

from collections.abc import Sequence

from gaplab.schemas.comparisons import Comparison
from gaplab.schemas.records import StudyRead
from gaplab.schemas.reports import VerdictRead
from gaplab.services.core.robot_library import label_of
from gaplab.services.figures.kinds.curves import curves_figure
from gaplab.services.figures.kinds.squared_error import squared_error_figure
from gaplab.services.figures.words import number_of, titled
from gaplab.services.findings import tables as findings
from gaplab.services.findings.sentences import POOLED
from gaplab.services.reports import tables
from gaplab.services.reports.blocks import Block, Bullets, Drawing, Paragraph, Report, Section
from gaplab.services.reports.content import Facts, facts_of
from gaplab.services.reports.reproduction import reproduction
from gaplab.services.results.comparisons import Margin
from gaplab.services.results.coordinates import simulator_coordinates
from gaplab.services.store.session import Store


def report_on(store: Store, subject: StudyRead, margin: Margin | None = None) -> Report:
    """Return the report on a study."""
    facts = facts_of(store, subject, margin)
    several = len(facts.experiments) > 1
    sections = [
        Section("Verdict", _verdict(facts.verdict)),
        Section("Curves", (Drawing(curves_figure(facts.curves, beside=facts.transferred)), tables.at_last(facts))),
        *([Section("Which differ", _differences(facts))] if several else []),
        *([Section("Simulators", _simulators(store, facts))] if facts.leading else []),
        *([Section("Sensitivity of fitness to the tunables", _sensitivity(facts))] if facts.checks else []),
        Section("Cost", (tables.cost(facts),)),
        Section("Settings", _settings(facts)),
        Section("Provenance", _provenance(facts)),
        Section("How to reproduce it", tuple(reproduction(facts))),
    ]
    repetitions = sum(experiment.progress.completed for experiment in facts.experiments)
    return Report(
        id=facts.id,
        title=facts.name if several else titled(facts.name, facts.experiments[0].strategy, 200),
        subtitle=f"Study {facts.id}: {number_of('experiment', len(facts.experiments))}, "
        f"{number_of('completed repetition', repetitions)}",
        headline=facts.verdict.headline,
        sections=tuple(sections),
    )


def _verdict(verdict: VerdictRead) -> tuple[Block, ...]:
    rules = [Paragraph(f"Rule {number}. {rule}", note=True) for number, rule in enumerate(verdict.rules, 1)]
    return (Bullets(verdict.sentences), *rules)


def _differences(facts: Facts) -> tuple[Block, ...]:
    if not facts.at_last:
        return (Paragraph("There is nothing to compare yet."),)
    last = facts.at_last[0].where
    cautions = tuple(dict.fromkeys(pair.caution for pair in facts.at_last if pair.caution))
    return (
        findings.experiments(facts.names, facts.at_last, f"Fitness {last}"),
        findings.differences(facts.names, facts.at_last, f"All pairs {last}"),
        findings.verdicts(facts.names, facts.at_last, f"All pairs {last}, by the tests that the verdict uses"),
        *(grid for each in facts.beside for grid in _beside(facts, each, last)),
        findings.tests(facts.names, facts.at_last, f"All pairs {last}, by each test"),
        *(Paragraph(f"Shared random streams: {caution}.", note=True) for caution in cautions),
        *(_over_all(facts) if facts.over_all else ()),
    )


def _beside(facts: Facts, pairs: Sequence[Comparison], last: str) -> tuple[Block, ...]:
    what = f"{pairs[0].fitness.words}, {last}"
    return findings.differences(facts.names, pairs, what), findings.verdicts(facts.names, pairs, what)


def _over_all(facts: Facts) -> tuple[Block, ...]:
    return (
        findings.tests(facts.names, facts.over_all, f"The {facts.over_all[0].where}"),
        findings.pooled(facts.names, facts.over_all, "The paper's test: the same pairs, pooled over these numbers"),
        Paragraph(f"The last table is {POOLED}. The verdict does not use it.", note=True),
    )


def _simulators(store: Store, facts: Facts) -> tuple[Block, ...]:
    assert facts.leading is not None
    leading, tuned = facts.leading
    remarks = tuple(
        f"{one.name}: {remark}."
        for one in facts.judged
        if one.curve.experiment in facts.misfits
        for remark in facts.misfits[one.curve.experiment].remarks
    )
    error = squared_error_figure(tuned.errors, tuned.error, samples=tuned.samples, title=leading.name)
    return (
        *tables.misfit(facts),
        *tables.identified(facts),
        *([Bullets(remarks)] if remarks else []),
        Drawing(error),
        Drawing(simulator_coordinates(store, leading.curve.experiment, title=leading.name)),
    )


def _sensitivity(facts: Facts) -> tuple[Block, ...]:
    checks = (findings.sensitivity(each, label_of(each.spec.robot)) for each in facts.checks)
    warnings = tuple(dict.fromkeys(warning for check in facts.checks for warning in check.warnings))
    return (*checks, *([Bullets(warnings)] if warnings else []))


def _settings(facts: Facts) -> tuple[Block, ...]:
    notes = [Paragraph(f"Notes: {facts.notes}")] if facts.notes else []
    return (*notes, *tables.differing(facts), tables.settings(facts))


def _provenance(facts: Facts) -> tuple[Block, ...]:
    found = tables.provenance(facts)
    return found or (Paragraph("The versions of what computed it are not stored."),)
