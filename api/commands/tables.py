"""Tables and sentences for what the service answers."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from gaplab.api.clients.progress import Record, colored, left, percent, standing
from gaplab.api.commands.completion import KINDS
from gaplab.schemas.curves import Curve, CurvePoint, from_before
from gaplab.schemas.lifecycle import State
from gaplab.schemas.plugin import Catalogue, PluginRead
from gaplab.schemas.records import ExperimentRead, RepetitionRead, StudyRead
from gaplab.services.figures.words import titled
from gaplab.services.findings.tables import Grid


def overview(records: Iterable[Record]) -> Table:
    """Return a table of studies and experiments."""
    return table(("id", "name", "state", "fitness", "progress", "left", "created"), map(_record, records))


def repetitions(found: Iterable[RepetitionRead], experiment: ExperimentRead) -> Table:
    """Return a table of the repetitions of an experiment."""
    iterations = 0 if experiment.level else int(experiment.spec["iterations"])
    columns = ("repetition", "state", "iterations", "rollouts", "attempts", "reason of failure")
    return table(columns, (_repetition(repetition, iterations) for repetition in found))


def curves(found: Sequence[Curve]) -> Table:
    """Return a table of recorded fitness, mean±SD: a row per number of real-world evaluations, a column per curve.

    Seven curves fit into 80 columns: headings break between words, numbers never.
    """
    lines = [curve for curve in found if not curve.level]
    points = {(curve.experiment, point.evaluations): point for curve in lines for point in curve.points}
    rows = [
        (f"{count}", *(_mean(points.get((curve.experiment, count))) for curve in lines))
        for count in sorted({count for _, count in points})
    ]
    after = f"after{from_before(*(curve.known for curve in lines))}"
    made = table((after, *(escape(titled(curve.name, curve.strategy)) for curve in lines)), rows)
    made.collapse_padding, made.show_edge = True, False
    return made


def baselines(found: Sequence[Curve]) -> list[str]:
    """Return a sentence for each experiment without samples, like the direct baseline."""
    return [
        f"{escape(curve.name)} ({'evolved in reality itself' if curve.direct else 'without samples'}): "
        f"{_mean(point)} {curve.unit}, n = {point.n}"
        for curve in found
        if curve.level
        for point in curve.points[:1]
    ]


def catalogue(plugins: Catalogue) -> list[Table]:
    """Return a table for each kind of plug-in."""
    return [table((kind, "summary", "options"), map(_plugin, getattr(plugins, kind))) for kind in KINDS]


def ignored(plugins: Catalogue) -> list[str]:
    """Return a line for each file in a plug-in folder that is not a plug-in."""
    return [f"{escape(each.file)} is not used: {escape(each.why)}\n" for each in plugins.ignored]


def plugin(found: PluginRead) -> list[Table | str]:
    """Return all that is known of a plug-in: summary, source, details and options."""
    lines = [f"[bold]{escape(found.name)}[/]", escape(found.summary), f"source: {escape(found.source)}"]
    lines += [escape(found.note)] if found.note else []
    lines += [f"{name}: {escape(_in_words(value))}" for name, value in found.details.items()]
    lines += [f"preset {name}: {escape(_in_words(value))}" for name, value in found.presets.items()]
    options = [
        (name, escape(str(schema.get("default", "-"))), escape(schema.get("description", "")))
        for name, schema in found.options.get("properties", {}).items()
    ]
    return [*lines, table(("option", "default", "meaning"), options) if options else "no options"]


def shown(grid: Grid) -> tuple[Text, Table]:
    """Return a table of findings for a terminal, below its caption."""
    return Text(grid.caption), table(map(escape, grid.head), (map(escape, row) for row in grid.rows))


def table(columns: Iterable[str], rows: Iterable[Iterable[str]]) -> Table:
    """Return a table whose long cells are folded."""
    made = Table(box=SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        made.add_column(column, overflow="fold")
    for row in rows:
        made.add_row(*row)
    return made


def minute(moment: datetime | None) -> str:
    """Return a moment in local time, to the minute; nothing for None."""
    return moment.astimezone().strftime("%Y-%m-%d %H:%M") if moment else ""


def best(study: StudyRead) -> list[str]:
    """Return a sentence about the fittest experiment of a study; none without a result."""
    if not (found := study.best):
        return []
    evaluations = f"{found.evaluations} real-world evaluation{'' if found.evaluations == 1 else 's'}"
    what = "mean error on held-out recordings, × untuned," if _is_recorded(study) else "mean"
    mean = f"{what} {_mean_text(study, found.mean)} after {evaluations}{from_before(found.known)}"
    return [escape(f"best: {found.name.replace('_', ' ')}, {mean} (n = {found.n})")]


def _is_recorded(record: Record) -> bool:
    first = record.experiments[0] if isinstance(record, StudyRead) else record
    return bool(first.spec["reality"]["kind"] == "recorded")


def _mean_text(record: Record, mean: float) -> str:
    """Return a mean fitness; of recordings, the error that it is minus of."""
    return f"{-mean if _is_recorded(record) else mean:.3f}"


def _fitness(record: Record) -> str:
    """Return the fitness of an experiment, or of a study's best, with its number of evaluations: "0.585 at 10"."""
    found = record.best if isinstance(record, StudyRead) else record.fitness
    return f"{_mean_text(record, found.mean)} at {found.evaluations}{from_before(found.known)}" if found else "-"


def _record(record: Record) -> tuple[str, ...]:
    many = f" ({len(record.experiments)})" if isinstance(record, StudyRead) and len(record.experiments) > 1 else ""
    progress = (_fitness(record), percent(record.progress), left(record))
    tags = f" [dim]{escape(' '.join(record.tags))}[/]" if isinstance(record, StudyRead) and record.tags else ""
    return record.id, escape(record.name) + many + tags, standing(record), *progress, minute(record.created_at)


def _repetition(found: RepetitionRead, iterations: int) -> tuple[str, ...]:
    done = max(0, found.iterations_done - 1)
    early = found.state is State.COMPLETED and done < iterations
    state = f"[yellow]{found.state}, stopped early[/]" if early else colored(found.state)
    counts = (f"{done} of {iterations}" if iterations else "-", f"{found.rollouts_done:,}", f"{found.attempts}")
    return f"{found.number}", state, *counts, escape(found.error or "")


def _plugin(found: PluginRead) -> tuple[str, ...]:
    name = found.name if found.available else f"{found.name} (not available)"
    return escape(name), escape(found.summary or found.note or ""), ", ".join(found.options.get("properties", {}))


def _in_words(value: Any) -> str:  # noqa: ANN401 - JSON
    """Return a detail of a plug-in without the signs of JSON: its name alone, other fields with their names."""
    if isinstance(value, dict):
        return ", ".join(each if name == "name" else f"{name} {each}" for name, each in _parts(value))
    if isinstance(value, list):
        return ("; " if any(isinstance(each, dict) for each in value) else ", ").join(map(_in_words, value)) or "none"
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    return f"{value:g}" if isinstance(value, float) else str(value)


def _parts(fields: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield names and values in words; those of an inner object are in parentheses, and an empty one is left out."""
    for name, value in fields.items():
        if value != {}:
            yield name, f"({_in_words(value)})" if isinstance(value, dict) else _in_words(value)


def _mean(point: CurvePoint | None) -> str:
    if point is None or point.mean is None:
        return "-"
    return f"{point.mean:.2f}±{point.sd:.2f}" if point.sd is not None else f"{point.mean:.2f}"
