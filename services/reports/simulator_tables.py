"""The tables of a report about tuned simulators."""

from collections.abc import Iterator

from gaplab.schemas.misfit import TunableDistribution
from gaplab.services.figures.words import spoken
from gaplab.services.reports.blocks import Grid
from gaplab.services.reports.content import Facts
from gaplab.services.reports.numbers import MISSING
from gaplab.services.reports.tables import spread


def misfit(facts: Facts) -> Iterator[Grid]:
    """Yield the misfit of the latest simulators, and their tunables."""
    names = {one.curve.experiment: one.name for one in facts.judged}
    found = [(names[id_], read) for id_, read in facts.misfits.items() if read.points]
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
            *(spread(each) for each in (point.error, point.held_out_error, point.gap)),
        )
        for name, point in last
    )
    yield Grid("Misfit of the best simulators after the last iteration: mean ± SD over repetitions", head, rows)
    columns = ("Experiment", "Tunable", "Tuned", "Bounds", "At a bound")
    tuned = tuple((name, *_tuned(tunable)) for name, point in last for tunable in point.tunables)
    yield Grid("Tuned values after the last iteration: mean ± SD over repetitions", columns, tuned)


def identified(facts: Facts) -> Iterator[Grid]:
    """Yield which tunables are identified, and what would help."""
    names = {one.curve.experiment: one.name for one in facts.judged}
    rows = tuple(
        (
            names[id_],
            spoken(each.name),
            each.verdict.value,
            MISSING if each.remaining is None else f"{each.remaining:.0%}",
            "; ".join(each.helps) or MISSING,
        )
        for id_, read in facts.misfits.items()
        for each in read.verdicts
    )
    if rows:
        head = ("Experiment", "Tunable", "Verdict", "Uncertainty left", "What would help")
        yield Grid("Which tunables are identified; 100 % is as uncertain as before any sample", head, rows)


def _tuned(found: TunableDistribution) -> tuple[str, ...]:
    at_bound = (found.at_lower or 0.0) + (found.at_upper or 0.0)
    bounds = f"{found.lower:g} to {found.upper:g}"
    return spoken(found.name), spread(found), bounds, f"{at_bound:.0%}"
