"""The tables of a report."""

from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime

from gaplab.schemas.provenance import Provenance
from gaplab.services.figures.words import number_of, spoken, with_unit
from gaplab.services.findings import tables as findings
from gaplab.services.findings.judged import Judged
from gaplab.services.findings.wording import MISSING, bracketed, number, share
from gaplab.services.reports.blocks import Grid
from gaplab.services.reports.content import Facts, Outcome
from gaplab.services.specs.differences import SpecColumn, all_settings
from gaplab.services.store.queries.costs import Work
from gaplab.services.world.tunables.labels import unit_of

MOST_SHOWN = 60
"""Most measurements in a report."""


def at_last(facts: Facts) -> Grid:
    """Return the fitness of each experiment after the last common evaluation."""
    baseline = next((one.mean for one in facts.judged if one.curve.direct and one.mean > 0), None)
    head = ("Experiment", "n", f"Mean ({facts.unit})", "SD", "95 % interval", "Share of direct", "End of the curve")
    caption = "Recorded fitness at the last number of real-world evaluations that the experiments share"
    return Grid(caption, head, tuple(_at_last(one, baseline) for one in facts.judged))


def _at_last(one: Judged, baseline: float | None) -> tuple[str, ...]:
    if one.point is None:
        return (one.name, "0", *[MISSING] * 5)
    of_direct = share(one.mean / baseline) if baseline else MISSING
    end = one.end.trend.value.replace("_", " ") if one.end else MISSING
    since = f" since {one.end.since}" if one.end and end == "flat" else ""
    ends = bracketed(one.point.lower, one.point.upper).strip() or MISSING
    return (one.name, str(one.point.n), number(one.mean), number(one.point.sd), ends, of_direct, end + since)


def best_simulator(facts: Facts, outcome: Outcome) -> Grid:
    """Return the values of the best tuned simulator."""
    simulator, (experiment,) = outcome.simulators[0], facts.experiments
    misfit = facts.misfits.get(experiment.id)
    verdicts = {each.name: each.verdict.value for each in misfit.verdicts} if misfit else {}
    rows = tuple(
        (
            with_unit(spoken(name), [unit_of(name)]),
            f"{simulator.parameters[name]:.6g}",
            _ends((simulator.intervals or {}).get(name)),
            f"{tunable['lower']:g} to {tunable['upper']:g}",
            verdicts.get(name, MISSING),
        )
        for tunable in experiment.spec["tunables"]
        for name in [tunable["name"]]
    )
    caption = (
        f"Best simulator of iteration {simulator.iteration} in repetition {simulator.repetition}, tuned on "
        f"{number_of('sample', outcome.samples)}"
    )
    return Grid(caption, ("Tunable", "Value", "95 % interval", "Bounds", "Verdict"), rows, words=True)


def _ends(found: tuple[float, float] | None) -> str:
    return MISSING if found is None else f"{found[0]:.4g} to {found[1]:.4g}"


def measurements(facts: Facts, outcome: Outcome) -> Grid:
    """Return the first measurements that succeeded."""
    rows = tuple(
        (
            f"{each.repetition}, {each.iteration}",
            each.kind.value,
            number(each.fitness),
            number(each.standard_error, 2),
            each.measured_by,
            f"{each.measured_at:%Y-%m-%d %H:%M}",
        )
        for each in outcome.measured[:MOST_SHOWN]
    )
    head = ("Repetition, iteration", "Kind", f"Fitness ({facts.unit})", "Standard error", "Measured by", "At")
    return Grid("Measurements that succeeded", head, rows, words=True)


def cost(facts: Facts) -> Grid:
    """Return what each experiment has cost so far."""
    head = (
        "Experiment",
        "State",
        "Completed",
        "Samples",
        "Probes",
        "Rollouts",
        "Not needed",
        "Failed",
        "Time of work",
        "Duration",
    )
    rows = []
    for experiment in facts.experiments:
        progress, work = experiment.progress, facts.work.get(experiment.id, Work())
        counts = (work.samples, work.probes, progress.rollouts_done, progress.rollouts_saved, progress.rollouts_failed)
        rows.append(
            (
                facts.names[experiment.id],
                experiment.state.value.lower(),
                f"{progress.completed} of {progress.repetitions}",
                *(f"{count:,}" for count in counts),
                _duration(work.seconds),
                _elapsed(experiment.started_at, experiment.ended_at),
            )
        )
    caption = (
        "Real-world evaluations (samples are learned from, probes only recorded), rollouts in simulation, and time"
    )
    return Grid(caption, head, tuple(rows))


def differing(facts: Facts) -> Iterator[Grid]:
    """Yield the settings that differ between the experiments."""
    if facts.differing and facts.differing.settings:
        yield findings.differing(facts.differing, [facts.names[column.id] for column in facts.differing.columns])


def settings(facts: Facts) -> Grid:
    """Return the settings that all experiments share; hidden parameters of reality are called so."""
    differs = {each.pointer for each in facts.differing.settings} if facts.differing else set()
    columns = SpecColumn(facts.id, facts.name, tuple(experiment.spec for experiment in facts.experiments))
    rows = tuple((words, pointer, text) for pointer, words, text in all_settings(columns) if pointer not in differs)
    shared = "Settings of all experiments" if len(facts.experiments) > 1 else "Settings"
    return Grid(shared, ("Setting", "Pointer", "Value"), rows, words=True)


def provenance(facts: Facts) -> tuple[Grid, ...]:
    """Return the versions of everything that computed the experiments, each once."""
    found: dict[str, Provenance] = {}
    repetitions: dict[str, int] = {}
    for read in facts.provenance.values():
        for use in read.uses:
            found[use.id] = use.provenance
            repetitions[use.id] = repetitions.get(use.id, 0) + use.repetitions
    return tuple(
        Grid(_of_software(repetitions[id_]), ("Part", "Version"), _versions(each), words=True)
        for id_, each in found.items()
    )


def _of_software(repetitions: int) -> str:
    last = f"the last to compute {number_of('repetition', repetitions)}" if repetitions else "of earlier steps"
    return f"Software and machine, {last}"


def _versions(found: Provenance) -> tuple[tuple[str, str], ...]:
    commit = f"{found.commit}{' with changes' if found.dirty else ''}" if found.commit else MISSING
    rows = [
        ("gaplab", found.gaplab),
        ("commit", commit),
        ("code (hash)", found.code),
        ("Python", found.python),
        ("processor", f"{found.processor} ({found.architecture})"),
        ("system", found.system),
        ("spec version", str(found.spec_version)),
        *_pairs("engine", found.engines),
        *_pairs("library", found.libraries),
        *_pairs("external plug-in", found.outside),
    ]
    return tuple(rows)


def _pairs(what: str, versions: Mapping[str, str]) -> Iterable[tuple[str, str]]:
    return ((f"{what} {name}", version) for name, version in versions.items())


def _elapsed(start: datetime | None, end: datetime | None) -> str:
    return MISSING if start is None or end is None else _duration((end - start).total_seconds())


def _duration(seconds: float) -> str:
    for unit, size in (("d", 86_400), ("h", 3_600), ("min", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.1f} s"


def misfit(facts: Facts) -> Iterator[Grid]:
    """Yield the misfit of the latest simulators, and their tunables."""
    found = [(facts.names[id_], read) for id_, read in facts.misfits.items() if read.points]
    if not found:
        return
    last = [(name, read.points[-1]) for name, read in found]
    unit, units = found[0][1].unit, " or ".join(sorted({read.error_unit for _, read in found}))
    errors = (f"Error per sample ({units})", f"On held-out samples ({units})")
    head = ("Experiment", "Iteration", "n", *errors, f"Gap in reality ({unit})")
    rows = tuple(
        (
            name,
            str(point.iteration),
            str(point.error.n),
            *(each.text for each in (point.error, point.held_out_error, point.gap)),
        )
        for name, point in last
    )
    yield Grid("Misfit of the best simulators after the last iteration: mean ± SD over repetitions", head, rows)
    yield findings.tuned(last)


def identified(facts: Facts) -> Iterator[Grid]:
    """Yield which tunables are identified, and what would help."""
    rows = tuple(
        (
            facts.names[id_],
            spoken(each.name),
            each.verdict.value,
            share(each.remaining),
            "; ".join(each.helps) or MISSING,
        )
        for id_, read in facts.misfits.items()
        for each in read.verdicts
    )
    if rows:
        head = ("Experiment", "Tunable", "Verdict", "Uncertainty left", "What would help")
        yield Grid("Which tunables are identified; 100 % is as uncertain as before any sample", head, rows)
