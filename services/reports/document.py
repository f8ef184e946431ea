"""The arrangement of a report: which facts stand in which section, and how to compute them again."""

import json
from collections.abc import Iterator, Sequence
from typing import Any

from gaplab.schemas.comparisons import Comparison
from gaplab.schemas.curves import from_before
from gaplab.services.figures.kinds.curves import curves_figure
from gaplab.services.figures.kinds.squared_error import squared_error_figure
from gaplab.services.figures.words import number, number_of, spoken, titled
from gaplab.services.findings import tables as findings
from gaplab.services.findings.sentences import POOLED
from gaplab.services.findings.simulator_sentences import noise
from gaplab.services.reports import tables
from gaplab.services.reports.blocks import Block, Bullets, Code, Drawing, Paragraph, Report, Section
from gaplab.services.reports.content import Facts, Outcome
from gaplab.services.results.tuned_simulators import simulator_coordinates
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.world.robot_library import label_of


def report_of(facts: Facts) -> Report:
    """Return the report with these facts on a study."""
    outcome = facts.outcome
    sections = [
        Section("Verdict", _verdict(facts)),
        Section("Curves", (Drawing(curves_figure(facts.curves, beside=facts.transferred)), tables.at_last(facts))),
        *([Section("Which differ", _differences(facts))] if len(facts.experiments) > 1 else []),
        *([Section("The best measured controller", _controller(facts, outcome))] if outcome and outcome.best else []),
        *([Section("The tuned simulator", _tuned(facts, outcome))] if outcome and outcome.simulators else []),
        *([Section("Simulators", _simulators(facts))] if facts.leading else []),
        *([Section("Sensitivity of fitness to the tunables", _sensitivity(facts))] if facts.checks else []),
        *([Section("Measurements", _measurements(facts, outcome))] if outcome and outcome.measured else []),
        Section("Cost", (tables.cost(facts),)),
        Section("Settings", _settings(facts)),
        Section("Provenance", tables.provenance(facts) or (Paragraph(NO_VERSIONS),)),
        Section("How to reproduce it", tuple(reproduction(facts))),
    ]
    return Report(
        id=facts.id,
        title=titled(facts.name, facts.experiments[0].strategy, 200) if outcome else facts.name,
        subtitle=_subtitle(facts, outcome),
        headline=facts.verdict.headline,
        sections=tuple(sections),
    )


def said(facts: Facts) -> tuple[str, ...]:
    """Return the sentences of the verdict; of a single experiment, also what its samples say about the tunables."""
    found = [*facts.verdict.sentences]
    for misfit in facts.misfits.values() if facts.outcome else ():
        found += [f"{remark[0].upper()}{remark[1:]}." for remark in misfit.remarks]
        found += [verdict.sentence for verdict in misfit.verdicts]
        found += [] if misfit.noise is None else [noise(misfit.noise, misfit.unit)]
    return tuple(found) or ("There are too few results for a verdict.",)


def _subtitle(facts: Facts, outcome: Outcome | None) -> str:
    parts = [number_of("experiment", len(facts.experiments))]
    if outcome:
        spec = spec_of(facts.experiments[0].spec)
        measured = f"{number_of('measurement', len(outcome.measured))}{from_before(len(spec.reality.samples))}"
        parts = [spoken(label_of(spec.robot)), f"simulated in {spoken(spec.engine.name)}", measured]
    completed = sum(experiment.progress.completed for experiment in facts.experiments)
    parts.append(number_of("completed repetition", completed))
    return f"{'Experiment' if outcome else 'Study'} {facts.id}: {', '.join(parts)}"


def _verdict(facts: Facts) -> tuple[Block, ...]:
    rules = [Paragraph(f"Rule {number}. {rule}", note=True) for number, rule in enumerate(facts.verdict.rules, 1)]
    return (Bullets(said(facts)), *rules)


def _controller(facts: Facts, outcome: Outcome) -> tuple[Block, ...]:
    best = outcome.best
    assert best is not None
    error = "" if best.standard_error is None else f" ± {best.standard_error:.3g} (standard error)"
    repeats = f", the mean of {len(best.repeats)} repeats" if best.repeats else ""
    when = f"{best.kind.value} of iteration {best.iteration} in repetition {best.repetition}, by {best.measured_by}"
    lucky = "The best of many measurements is partly luck. Measure it again before you rely on its number."
    return (
        Paragraph(f"Fitness {number(best.fitness)}{error} {facts.unit}{repeats}: the {when}."),
        Paragraph(lucky, note=True),
        Code(", ".join(f"{gene:.6g}" for gene in best.genome)),
    )


def _tuned(facts: Facts, outcome: Outcome) -> tuple[Block, ...]:
    error, misfit = outcome.simulators[0].error, facts.misfits.get(facts.experiments[0].id)
    unit = f" {misfit.error_unit}" if misfit and misfit.error_unit else ""
    left = [] if error is None else [Paragraph(f"Error per sample: {error:.3g}{unit}.")]
    return (tables.best_simulator(facts, outcome), *left)


def _measurements(facts: Facts, outcome: Outcome) -> tuple[Block, ...]:
    more = len(outcome.measured) - tables.MOST_SHOWN
    where = f"are in the archive that gaplab export {facts.experiments[0].id} writes"
    rest = [Paragraph(f"{number_of('more measurement', more)} {where}.", note=True)] if more > 0 else []
    return (tables.measurements(facts, outcome), *rest)


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


def _simulators(facts: Facts) -> tuple[Block, ...]:
    assert facts.leading is not None
    leading, tuned = facts.leading
    remarks = tuple(
        f"{one.name}: {remark}."
        for one in facts.judged
        if not facts.outcome and one.curve.experiment in facts.misfits
        for remark in facts.misfits[one.curve.experiment].remarks
    )
    error = squared_error_figure(tuned.errors, tuned.error, samples=tuned.samples, title=leading.name)
    return (
        *tables.misfit(facts),
        *tables.identified(facts),
        *([Bullets(remarks)] if remarks else []),
        Drawing(error),
        Drawing(simulator_coordinates(tuned, title=leading.name)),
    )


def _sensitivity(facts: Facts) -> tuple[Block, ...]:
    checks = (findings.sensitivity(each, label_of(each.spec.robot)) for each in facts.checks)
    warnings = tuple(dict.fromkeys(warning for check in facts.checks for warning in check.warnings))
    return (*checks, *([Bullets(warnings)] if warnings else []))


def _settings(facts: Facts) -> tuple[Block, ...]:
    notes = [Paragraph(f"Notes: {facts.notes}")] if facts.notes else []
    return (*notes, *tables.differing(facts), tables.settings(facts))


NO_VERSIONS = "The versions of what computed it are not stored."

ONE = "Save the spec below as spec.json and submit it: gaplab submit spec.json --watch"
EACH = "Save each spec below as a file and submit it: gaplab submit spec.json --watch"


def reproduction(facts: Facts) -> Iterator[Block]:
    """Yield what to do, in sentences, and the spec to submit; that of each experiment if no single spec gives all."""
    whole, *each = facts.again
    yield Paragraph(EACH if each else ONE)
    yield Paragraph(
        "The same spec and seed give the same numbers, to the last bit, with the engines of the provenance above."
    )
    yield Paragraph(f"Every number is in the archive that gaplab export {facts.id} writes.")
    for remark in whole.remarks:
        yield Paragraph(f"{remark[0].upper()}{remark[1:]}.", note=True)
    for one, found in zip(facts.judged, each, strict=bool(each)):
        yield Paragraph(f"{one.name}:")
        yield Code(spec_text(found.spec))
    if not each:
        yield Code(spec_text(whole.spec))


def spec_text(spec: dict[str, Any] | None) -> str:
    """Return a spec as JSON to read."""
    return json.dumps(spec, indent=2, ensure_ascii=False)
