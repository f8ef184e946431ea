"""Commands that read results: settings, curves, figures, comparisons, reports and replays."""

from collections.abc import Callable
from math import inf, nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from pydantic import ValidationError
from rich.console import RenderableType
from rich.markup import escape

from gaplab.api.clients.client import Client
from gaplab.api.clients.errors import format_of
from gaplab.api.clients.figures import FORMATS
from gaplab.api.clients.results import Comparisons
from gaplab.api.clients.screen import console
from gaplab.api.commands import completion, tables
from gaplab.api.commands.app import BENCH, RESULTS, Answer, AsJson, ExperimentId, Id, Ids, command
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import echo, print_json, print_result
from gaplab.api.commands.submission import read_spec
from gaplab.schemas.curves import Fitness
from gaplab.schemas.differences import SpecDiff
from gaplab.schemas.mistakes import pointer_to, sentence
from gaplab.schemas.replays import ReplayWorld
from gaplab.schemas.spec import ExperimentSpec, StudySpec, kind_of
from gaplab.services.core.errors import InvalidArchive, InvalidSpec
from gaplab.services.findings.tables import comparison, differing

if TYPE_CHECKING:
    from gaplab.services.specs.differences import SpecColumn

FILES = {".zip", ".json"}
_BROKEN_SPECS = (ValueError, KeyError, TypeError, AttributeError, RecursionError)

Compared = Annotated[
    list[str],
    typer.Argument(
        metavar="ID|FILE",
        help="studies, experiments, archives (.zip) or specs (.json); a single study is compared within",
        autocompletion=completion.ids,
    ),
]


@command(RESULTS)
def diff(client: Client, of: Compared) -> Answer:
    """Show the settings in which studies, experiments, archives or specs differ."""
    found = _with_files(of, client) if any(Path(name).suffix in FILES for name in of) else client.diff(*of)
    grid = differing(found, [column.name for column in found.columns])
    shown: tuple[RenderableType, ...] = tables.shown(grid) if found.settings else ("No setting differs.",)
    return Answer(found, *(f"! {warning}" for warning in found.warnings), *shown, found.note)


def _with_files(names: list[str], client: Client) -> SpecDiff:
    """Compare what files and the service have; without ids, no service is needed."""
    from gaplab.services.specs.differences import SpecColumn, differences

    def column(name: str) -> SpecColumn:
        if Path(name).suffix in FILES:
            return column_of(Path(name))
        study = client.study(name)
        return SpecColumn(study.id, study.name, tuple(experiment.spec for experiment in study.experiments))

    columns = list(map(column, names))
    if len(columns) == 1:
        columns = [SpecColumn(f"{at}", spec["name"], (spec,)) for at, spec in enumerate(columns[0].specs)]
    return differences(columns)


def column_of(file: Path) -> "SpecColumn":
    """Return the specs of an archive, or the completed specs of a JSON file, for which no service is needed.

    Raises:
        CommandError: the file cannot be read, is damaged, or has an invalid spec.
    """
    from gaplab.services.specs.differences import SpecColumn

    try:
        if file.suffix == ".zip":
            return SpecColumn(file.name, file.stem, _archived(file))
        spec = read_spec(str(file))
        return SpecColumn(file.name, spec.get("name") or file.stem, _completed(spec))
    except OSError as error:
        raise CommandError(f"{file}: {error.strerror or error}", Exit.FILE) from error
    except ValidationError as error:
        mistakes = (f"{pointer_to(wrong['loc']) or '/'}: {sentence(dict(wrong))}" for wrong in error.errors())
        raise CommandError(f"{file} is not a valid spec: {'; '.join(mistakes)}", Exit.INVALID) from error
    except InvalidSpec as error:
        raise CommandError(f"{file} is not a valid spec: {error}", Exit.INVALID) from error
    except InvalidArchive as error:
        raise CommandError(f"{file} is not an archive of gaplab: {error}", Exit.INVALID) from error


def _archived(file: Path) -> tuple[dict[str, Any], ...]:
    from gaplab.services.archives.reading import archived_specs
    from gaplab.services.specs.stored_specs import spec_of

    with file.open("rb") as source:
        specs = archived_specs(source)
    try:
        for spec in specs:
            spec_of(spec)
    except _BROKEN_SPECS as error:
        raise InvalidArchive("a spec in it is damaged") from error
    return specs


def _completed(spec: dict[str, Any]) -> tuple[dict[str, Any], ...]:
    from gaplab.services.plugins import folders
    from gaplab.services.specs.resolution import resolve

    folders.load()
    kind = ExperimentSpec if kind_of(spec) == "experiment" else StudySpec
    return tuple(each.model_dump(mode="json") for each in resolve(kind.model_validate(spec)))


@command(RESULTS)
def curve(
    client: Client,
    ids: Ids,
    csv: Annotated[bool, typer.Option("--csv", help="print comma-separated values")] = False,
    as_json: AsJson = False,
) -> None:
    """Print curves: recorded fitness, mean ± SD, by real-world evaluations. `gaplab figure curves ID` draws them."""
    if csv and as_json:
        raise typer.BadParameter("only one of --csv and --json can be printed", param_hint="--csv")
    if csv:
        echo(client.curves_csv(ids), nl=False)
        return
    curves = client.curves(ids)
    if as_json:
        print_json(curves)
    else:
        console().print(tables.curves(curves), *tables.baselines(curves))


@command(RESULTS)
def figure(
    client: Client,
    kind: Annotated[str, typer.Argument(metavar="KIND", help="kind, like curves", autocompletion=completion.figures)],
    ids: Ids,
    out: Annotated[
        list[Path],
        typer.Option("--out", "-o", help=f"file; its suffix is the format: {', '.join(FORMATS)}; repeatable"),
    ],
    options: Annotated[
        list[str] | None,
        typer.Option("--set", "-s", metavar="NAME=VALUE", help="option of the kind, like band=sd; repeatable"),
    ] = None,
) -> Answer:
    """Draw a figure of studies or experiments into files; /docs of the service lists the kinds and their options."""
    formats = [format_of(file, FORMATS) for file in out]
    drawn = client.figure(*ids, of=kind, **dict(map(_named_option, options or [])))
    for each in formats:
        drawn.content(each)
    found = [(drawn.save(file), each) for file, each in zip(out, formats, strict=True)]
    sizes = [{"file": str(file), "format": each, "bytes": file.stat().st_size} for file, each in found]
    return Answer(sizes, "\n".join(f"Wrote {file}." for file in out))


def _named_option(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name.isidentifier() or name in {"of", "format", "study", "experiment"}:
        msg = f"{text!r} sets no option; write NAME=VALUE, like band=sd"
        raise typer.BadParameter(msg, param_hint="--set")
    return name, value


MarginOption = Annotated[
    str | None,
    typer.Option(
        metavar="NUMBER|SHARE%",
        help="test whether pairs differ by less than this: in the unit of fitness, or in % of the direct baseline",
    ),
]


@command(RESULTS)
def compare(  # noqa: PLR0913, PLR0917 - each is an option of the command
    client: Client,
    ids: Ids,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="N|FROM-TO",
            help="number of real-world evaluations, or a range, over which each repetition is its mean; left out: the "
            "last number of all",
        ),
    ] = None,
    margin: MarginOption = None,
    fitness: Annotated[
        Fitness, typer.Option(help="recorded as in the paper, transferred controllers alone, or the best of these")
    ] = Fitness.RECORDED,
    options: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            "-s",
            metavar="NAME=VALUE",
            help="compare at equal cost: x=rollouts, time or cost, then its model, like cost_s=90; repeatable",
        ),
    ] = None,
    format: Annotated[  # noqa: A002 - as the API says
        Literal["table", "csv", "json", "latex"], typer.Option(help="format of the output")
    ] = "table",
    as_json: AsJson = False,
) -> None:
    """Compare every pair of experiments: tests of means, ranks and spreads, intervals, and equivalence.

    Each p is shown before and after Holm's correction over all pairs.
    """
    first, last = _range(at)
    width, share = _margins(margin)
    costs: dict[str, Any] = dict(map(_named_option, options or []))
    pairs = client.compare(ids, first, last, margin=width, margin_of_direct=share, fitness=fitness, **costs)
    _PRINTERS["json" if as_json else format](pairs)


def _range(text: str | None) -> tuple[int | None, int | None]:
    if text is None:
        return None, None
    first, _, last = text.partition("-")
    try:
        return int(first), int(last or first)
    except ValueError:
        msg = f"{text!r} is not a number of real-world evaluations, like 5, and not a range, like 3-10"
        raise typer.BadParameter(msg, param_hint="--at") from None


def _margins(text: str | None) -> tuple[float | None, float | None]:
    """Return a margin like "0.03" in the unit of fitness, or one like "3%" as a share of the direct baseline."""
    if text is None:
        return None, None
    try:
        number = float(text.removesuffix("%"))
    except ValueError:
        number = nan
    if not 0 < number < inf:
        msg = f"{text!r} is not a margin above 0, like 0.03 in the unit of fitness or 3% of the direct baseline"
        raise typer.BadParameter(msg, param_hint="--margin")
    return (None, number / 100) if text.endswith("%") else (number, None)


def _print_tables(pairs: Comparisons) -> None:
    screen = console()
    for warning in dict.fromkeys(warning for pair in pairs for warning in pair.warnings):
        screen.print(f"! {escape(warning)}\n")
    for grid in comparison(pairs):
        screen.print(*tables.shown(grid))
    for pair in pairs:
        if pair.caution:
            screen.print(f"! {escape(f'{pair.first_name} - {pair.second_name}: {pair.caution}')}\n")


_PRINTERS: dict[str, Callable[[Comparisons], None]] = {
    "table": _print_tables,
    "csv": lambda pairs: echo(pairs.csv(), nl=False),
    "json": print_json,
    "latex": lambda pairs: echo(pairs.latex(), nl=False),
}


@command(RESULTS)
def report(
    client: Client,
    id: Id,
    save: Annotated[Path | None, typer.Option("--save", "-o", help="file with the suffix .html")] = None,
    margin: MarginOption = None,
    as_json: AsJson = False,
) -> None:
    """Print the verdict on a study, or save its report: figures, tables, tests, provenance."""
    width, share = _margins(margin)
    verdict = client.verdict(id, margin=width, margin_of_direct=share)
    file = client.report(id, save, margin=width, margin_of_direct=share) if save else None
    sentences = () if file else verdict.sentences
    print_result(verdict, verdict.headline, *(f"- {each}" for each in sentences), as_json=as_json)
    if file:
        echo(f"Wrote {file}.", err=as_json)


@command(BENCH)
def takehome(
    client: Client,
    id: Annotated[str, typer.Argument(metavar="ID", help="an experiment")],
    file: Annotated[
        Path | None, typer.Argument(help="file with the suffix .zip; default: gaplab-ID-takehome.zip")
    ] = None,
) -> Answer:
    """Save what one takes home: the best controller, its motion, the tuned simulator, and the report."""
    written = client.take_home(id, file or Path(f"gaplab-{id}-takehome.zip"))
    return Answer({"file": str(written), "bytes": written.stat().st_size}, f"Wrote {written}.")


@command(RESULTS)
def replay(
    client: Client,
    id: ExperimentId,
    options: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            "-s",
            metavar="NAME=VALUE",
            help="repetition, iteration (left out: the last), kind (transfer or sample), simulator; repeatable",
        ),
    ] = None,
) -> Answer:
    """Replay a controller in its simulator and in reality: print its fitness, or with --json its motion."""
    found = client.replay(id, **dict(map(_named_option, options or [])))
    worlds = (("in its simulator", found.simulation), ("in reality", found.reality))
    return Answer(found, *(f"{name}: {_result_in(world, found.unit)}" for name, world in worlds))


def _result_in(world: ReplayWorld | None, unit: str) -> str:
    if world is None:
        return "not shown"
    return "the physics failed" if world.fitness is None else f"{world.fitness:.3f} {unit}, {world.engine}"
