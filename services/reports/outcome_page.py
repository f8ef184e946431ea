"""The page of an outcome: what a person prints and pins beside the robot."""

from gaplab.schemas.curves import from_before
from gaplab.services.core.tunables.labels import unit_of
from gaplab.services.figures.kinds.curves import curves_figure
from gaplab.services.figures.words import number, number_of, spoken, titled, with_unit
from gaplab.services.findings.wording import MISSING
from gaplab.services.reports import tables
from gaplab.services.reports.blocks import Block, Bullets, Code, Drawing, Grid, Paragraph, Report, Section
from gaplab.services.reports.outcome import ExperimentOutcome
from gaplab.services.reports.reproduction import reproduction

MOST_SHOWN = 60
"""Most measurements on the page; the files have all."""


def outcome_report(outcome: ExperimentOutcome) -> Report:
    """Return the outcome of an experiment as a short report."""
    experiment = outcome.experiment
    sections = [
        *([Section("The best measured controller", _controller(outcome))] if outcome.best else []),
        *([Section("The tuned simulator", _simulator(outcome))] if outcome.simulators else []),
        Section("Verdict", (Bullets(verdict_sentences(outcome)),)),
        Section("Curve", (Drawing(curves_figure(outcome.facts.curves, beside=outcome.facts.transferred)),)),
        *([Section("Measurements", _measurements(outcome))] if outcome.measured else []),
        Section("Provenance", tables.provenance(outcome.facts) or (Paragraph("Its versions are not stored."),)),
        Section("How to compute it again", tuple(reproduction(outcome.facts))),
    ]
    robot = spoken(outcome.robot.label)
    return Report(
        id=experiment.id,
        title=titled(experiment.name, experiment.strategy, 200),
        subtitle=f"Experiment {experiment.id}: {robot}, simulated in {spoken(outcome.spec.engine.name)}, "
        f"{number_of('measurement', len(outcome.measured))}{from_before(len(outcome.spec.reality.samples))}",
        headline=outcome.facts.verdict.headline,
        sections=tuple(sections),
    )


def verdict_sentences(outcome: ExperimentOutcome) -> tuple[str, ...]:
    """Return what the experiment found, and what its samples say about the tunables, in sentences."""
    misfit = outcome.misfit
    found = [*outcome.facts.verdict.sentences]
    if misfit is not None:
        found += [f"{remark}." for remark in misfit.remarks]
        found += [verdict.sentence for verdict in misfit.verdicts]
        if misfit.noise is not None:
            unit = f" {misfit.unit}" if misfit.unit else ""
            found.append(f"Repeats of one measurement differ by {misfit.noise:.3g}{unit} (standard deviation, pooled).")
    return tuple(found) or ("There are too few results for a verdict.",)


def _controller(outcome: ExperimentOutcome) -> tuple[Block, ...]:
    best, unit = outcome.best, outcome.robot.unit
    assert best is not None
    error = "" if best.standard_error is None else f" ± {best.standard_error:.3g} (standard error)"
    repeats = f", the mean of {len(best.repeats)} repeats" if best.repeats else ""
    when = f"{best.kind.value} of iteration {best.iteration} in repetition {best.repetition}, by {best.measured_by}"
    lucky = "The best of many measurements is partly luck. Measure it again before you rely on its number."
    return (
        Paragraph(f"Fitness {number(best.fitness)}{error} {unit}{repeats}: the {when}."),
        Paragraph(lucky, note=True),
        Code(", ".join(f"{gene:.6g}" for gene in best.genome)),
    )


def _simulator(outcome: ExperimentOutcome) -> tuple[Block, ...]:
    simulator, misfit = outcome.simulators[0], outcome.misfit
    rows = tuple(
        (
            with_unit(spoken(ref.name), [unit_of(ref.name)]),
            f"{simulator.parameters[ref.name]:.6g}",
            _interval((simulator.intervals or {}).get(ref.name)),
            f"{ref.lower:g} to {ref.upper:g}",
            outcome.identified[ref.name].verdict.value if ref.name in outcome.identified else MISSING,
        )
        for ref in outcome.spec.tunables
    )
    caption = (
        f"Best simulator of iteration {simulator.iteration} in repetition {simulator.repetition}, tuned on "
        f"{number_of('sample', outcome.samples)}"
    )
    unit = f" {misfit.error_unit}" if misfit and misfit.error_unit else ""
    left = [] if simulator.error is None else [Paragraph(f"Error per sample: {simulator.error:.3g}{unit}.")]
    return (Grid(caption, ("Tunable", "Value", "95 % interval", "Bounds", "Verdict"), rows, words=True), *left)


def _measurements(outcome: ExperimentOutcome) -> tuple[Block, ...]:
    shown = outcome.measured[:MOST_SHOWN]
    rows = tuple(
        (
            f"{each.repetition}, {each.iteration}",
            each.kind.value,
            number(each.fitness) or MISSING,
            number(each.standard_error, 2) or MISSING,
            each.measured_by,
            f"{each.measured_at:%Y-%m-%d %H:%M}",
        )
        for each in shown
    )
    head = ("Repetition, iteration", "Kind", f"Fitness ({outcome.robot.unit})", "Standard error", "Measured by", "At")
    more = len(outcome.measured) - len(shown)
    rest = [Paragraph(f"{number_of('more measurement', more)} are in samples.csv.", note=True)] if more else []
    return (Grid("Measurements that succeeded", head, rows, words=True), *rest)


def _interval(ends: tuple[float, float] | None) -> str:
    return MISSING if ends is None else f"{ends[0]:.4g} to {ends[1]:.4g}"
