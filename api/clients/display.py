"""How the command shows what the service says: tables and sentences, for a terminal and for a log file."""

import math
from collections.abc import Iterable, Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from gaplab.schemas.curves import Curve, CurvePoint
from gaplab.schemas.lifecycle import State
from gaplab.schemas.misfit import MisfitRead, TunableDistribution
from gaplab.schemas.plugin import Catalogue, PluginRead
from gaplab.schemas.problems import Problem
from gaplab.schemas.records import ExperimentRead, Progress, RepetitionRead, StudyRead
from gaplab.schemas.sensitivity import SensitivityRead

COLORS = {
    State.QUEUED: "dim",
    State.RUNNING: "cyan",
    State.PAUSING: "magenta",
    State.PAUSED: "magenta",
    State.STOPPING: "cyan",
    State.COMPLETED: "green",
    State.FAILED: "bold red",
    State.CANCELLED: "yellow",
}


def console(*, stderr: bool = False) -> Console:
    """A console; where there is no terminal it is wide, so that a log's lines are not cut at 80 characters."""
    terminal = Console(stderr=stderr, highlight=False, soft_wrap=False)
    return terminal if terminal.is_terminal else Console(stderr=stderr, highlight=False, width=160)


def overview(found: Iterable[ExperimentRead | StudyRead]) -> Table:
    """Studies and experiments, a line each."""
    table = _table("id", "name", "state", "progress", "left", "created")
    for each in found:
        many = f" ({len(each.experiments)})" if isinstance(each, StudyRead) else ""
        created = each.created_at.astimezone().strftime("%Y-%m-%d %H:%M")
        table.add_row(
            each.id, escape(each.name) + many, state(each.state), percent(each.progress), left(each.progress), created
        )
    return table


def repetitions(found: Iterable[RepetitionRead]) -> Table:
    """The repetitions of an experiment, a line each."""
    table = _table("repetition", "state", "iterations", "rollouts", "attempts", "why it failed")
    for each in found:
        numbers = (f"{each.iterations_done}", f"{each.rollouts_done:,}", f"{each.attempts}")
        table.add_row(f"{each.number}", state(each.state), *numbers, escape(each.error or ""))
    return table


def numbers(progress: Progress) -> str:
    """What has been done, in a sentence."""
    failed = f", {progress.failed} failed" if progress.failed else ""
    physics = f", {progress.rollouts_failed:,} of them nan" if progress.rollouts_failed else ""
    return (
        f"{progress.completed} of {progress.repetitions} repetitions{failed}; "
        f"{progress.rollouts_done:,} rollouts{physics}, {progress.rollouts_saved:,} saved, of {progress.rollouts:,}"
    )


def curves(found: Sequence[Curve]) -> Table:
    """Mean±SD of the recorded fitness, a line for each number of real-world evaluations, a column for each curve.

    Seven curves fit into 80 columns: headings break between words, numbers never.
    """
    lines = [each for each in found if not each.direct]
    table = _table("after", *(escape(each.name.replace("_", " ")) for each in lines))
    table.collapse_padding, table.show_edge = True, False
    by_count = [{point.evaluations: point for point in each.points} for each in lines]
    for count in sorted({count for points in by_count for count in points}):
        table.add_row(f"{count}", *(_cell(points.get(count)) for points in by_count))
    return table


def baselines(found: Sequence[Curve]) -> list[str]:
    """The direct baselines, a sentence each."""
    return [
        f"{escape(each.name)} (evolved in reality itself): {_cell(point)} {each.unit}, n = {point.n}"
        for each in found
        if each.direct
        for point in each.points[:1]
    ]


def catalogue(plugins: Catalogue) -> list[Table]:
    """Every kind of plug-in as a table."""
    return [_plugins(kind, getattr(plugins, kind)) for kind in type(plugins).model_fields if kind != "budgets"]


def plugin(found: PluginRead) -> list[Table | str]:
    """All about a plug-in: what it is, where it comes from, its options."""
    about = [f"[bold]{found.name}[/]", escape(found.summary), f"source: {escape(found.source)}"]
    about += [escape(found.note)] if found.note else []
    about += [f"{name}: {escape(str(value))}" for name, value in found.details.items()]
    options = _table("option", "default", "meaning")
    for name, schema in found.options.get("properties", {}).items():
        options.add_row(name, escape(str(schema.get("default", "-"))), escape(schema.get("description", "")))
    return [*about, options if options.row_count else "no options"]


def sensitivity(found: SensitivityRead) -> Table:
    """What each tunable does to fitness, a line each."""
    table = _table("tunable", "over", f"effect, {found.unit}", "of the spread", "roughness", "nan", "verdict")
    for each in found.tunables:
        over = f"{each.values[0]:g} to {each.values[-1]:g}"
        numbers = (_number(each.effect), _number(each.relative_effect), _number(each.roughness), f"{each.failures}")
        table.add_row(each.name, over, *numbers, each.verdict)
    return table


def tuned(found: MisfitRead) -> Table:
    """The tunables of the best simulators at the latest iteration, over repetitions, a line each."""
    last = found.points[-1]
    table = _table(f"tuned at {last.iteration}", "mean±SD", "least", "greatest", "at a bound")
    for each in last.tunables:
        spread = f"{_number(each.mean)}±{_number(each.sd)}"
        table.add_row(each.name, spread, _number(each.least), _number(each.greatest), _at_bounds(each))
    return table


def problem(found: Problem) -> list[str]:
    """A problem in words: its sentence, or a line for each thing that is wrong."""
    if not found.errors:
        return [found.detail]
    return [f"{each.pointer or '(the whole)'}: {each.message}" for each in found.errors]


def state(of: State) -> str:
    """A state in its colour."""
    return f"[{COLORS[of]}]{of}[/]"


def fraction(progress: Progress) -> float:
    """Between 0 and 1; of rollouts, which is where the time goes."""
    behind = progress.rollouts_done + progress.rollouts_saved
    return min(1.0, behind / progress.rollouts) if progress.rollouts else 0.0


def percent(progress: Progress) -> str:
    """How much is done; 100 % only when all is."""
    return f"{math.floor(100 * fraction(progress))} %"


def left(progress: Progress) -> str:
    """The time left, as people say it; a dash while unknown."""
    if progress.seconds_left is None:
        return "-"
    minutes, seconds = divmod(round(progress.seconds_left), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes}:{seconds:02}"


def _table(*columns: str) -> Table:
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        table.add_column(column, overflow="fold")
    return table


def _at_bounds(found: TunableDistribution) -> str:
    sides = ((found.lower, found.at_lower), (found.upper, found.at_upper))
    return ", ".join(f"{100 * share:.0f} % at {bound:g}" for bound, share in sides if share) or "-"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _cell(point: CurvePoint | None) -> str:
    if point is None or point.mean is None:
        return "-"
    return f"{point.mean:.2f}±{point.sd:.2f}" if point.sd is not None else f"{point.mean:.2f}"


def _plugins(kind: str, found: Iterable[PluginRead]) -> Table:
    table = _table(kind, "what it is", "options")
    for each in found:
        name = each.name if each.available else f"{each.name} (not installed)"
        table.add_row(name, escape(each.summary), ", ".join(each.options.get("properties", {})))
    return table
