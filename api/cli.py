"""The `gaplab` command: it runs the service, and talks to one that runs."""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from api import display
from api.client import Client, ServiceError, ServiceUnreachable
from api.exits import EXPLAINED, CommandError, Exit, code_of
from api.files import read_spec
from api.watch import follow
from schemas.lifecycle import State
from schemas.misfit import MisfitRead
from schemas.records import ExperimentRead, StudyRead
from services.core.errors import GaplabError
from services.settings import Settings

app = typer.Typer(
    help="Closes the reality gap: tunes a robot simulator from a handful of real-world evaluations.",
    epilog=EXPLAINED,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Id = Annotated[str, typer.Argument(metavar="ID", help="of a study or an experiment")]
Url = Annotated[
    str | None,
    typer.Option("--url", help="where the service is; left out: GAPLAB_URL, or this machine", show_default=False),
]


def main() -> None:
    """Run the command; what goes wrong is a sentence and an exit code, never a traceback."""
    try:
        app()
    except ServiceError as error:
        _leave(display.problem(error.problem), code_of(error))
    except (ServiceUnreachable, CommandError) as error:
        _leave([str(error)], code_of(error))
    except (GaplabError, ValueError) as error:
        _leave([str(error)], Exit.FAILED)
    except OSError as error:
        _leave([str(error)], Exit.FILE)


@app.command()
def serve(
    port: Annotated[int | None, typer.Option(help="left out: GAPLAB_PORT, or 8000", show_default=False)] = None,
    host: Annotated[str | None, typer.Option(help="left out: GAPLAB_HOST, or loopback", show_default=False)] = None,
    workers: Annotated[bool, typer.Option("--workers/--no-workers", help="run experiments, or only answer")] = True,
) -> None:
    """Run the service: migrate the database, answer over HTTP, and run what is queued. Ctrl-C ends it."""
    from api.service import serve as run

    run(_settings(host, port), workers=workers)


@app.command()
def submit(
    spec: Annotated[str, typer.Argument(metavar="SPEC", help="a JSON file, or - to read standard input")],
    watch: Annotated[bool, typer.Option("--watch", help="stay, and show the progress")] = False,
    url: Url = None,
) -> None:
    """Submit an experiment, or a study if the spec names several strategies or none."""
    with _client(url) as client:
        submitted = client.submit(read_spec(spec))
        console = display.console()
        console.print(submitted.id, markup=False)
        if watch:
            _finish(_watched(client, submitted.id))


@app.command("list")
def list_(
    experiments: Annotated[bool, typer.Option("--experiments", help="experiments in place of studies")] = False,
    limit: Annotated[int, typer.Option(min=1, max=500)] = 20,
    url: Url = None,
) -> None:
    """List the newest studies, and the experiments that belong to none."""
    with _client(url) as client:
        found: list[ExperimentRead | StudyRead] = list(client.experiments(limit=limit).items)
        if not experiments:
            alone = [each for each in found if isinstance(each, ExperimentRead) and each.study is None]
            found = [*client.studies(limit=limit).items, *alone]
    newest = sorted(found, key=lambda each: each.created_at, reverse=True)[:limit]
    display.console().print(display.overview(newest) if newest else "Nothing yet; `gaplab submit` starts something.")


@app.command()
def show(id: Id, url: Url = None) -> None:  # noqa: A002 - as the API says
    """Show a study's experiments, or an experiment's repetitions."""
    console = display.console()
    with _client(url) as client:
        found = client.find(id)
        console.print(display.overview([found]))
        console.print(display.numbers(found.progress))
        if isinstance(found, StudyRead):
            console.print(display.overview(found.experiments))
        else:
            console.print(display.repetitions(client.repetitions(id)))
            _print_misfit(client.misfit(id), console)
            console.print_json(data=found.spec)
        _print_warnings(_experiments(found))


@app.command()
def sensitivity(
    spec: Annotated[str, typer.Argument(metavar="SPEC", help="a JSON file, or - to read standard input")],
    url: Url = None,
) -> None:
    """Check what the tunables of a spec do: whether they change fitness, how much, and how smoothly."""
    with _client(url) as client:
        found = client.check(read_spec(spec))
    if found.state is not State.COMPLETED:
        msg = f"the check {found.id} ended as {found.state}: {found.reason}"
        raise CommandError(msg, Exit.FAILED)
    console = display.console()
    console.print(display.sensitivity(found))
    for each in found.warnings:
        console.print(each, markup=False)


@app.command()
def curve(
    ids: Annotated[list[str], typer.Argument(metavar="ID...", help="of studies or experiments")],
    csv: Annotated[bool, typer.Option("--csv", help="print comma-separated values")] = False,
    svg: Annotated[Path | None, typer.Option(help="draw into this file")] = None,
    html: Annotated[Path | None, typer.Option(help="draw into this file")] = None,
    url: Url = None,
) -> None:
    """Print curves: recorded fitness, mean ± SD, by number of real-world evaluations; or draw them."""
    with _client(url) as client:
        if csv:
            typer.echo(client.curves_csv(ids), nl=False)
        if svg:
            _write(svg, client.figure(ids, "svg"))
        if html:
            _write(html, client.figure(ids, "html"))
        if not (csv or svg or html):
            found = client.curves(ids)
            display.console().print(display.curves(found), *display.baselines(found))


@app.command()
def cancel(id: Id, url: Url = None) -> None:  # noqa: A002 - as the API says
    """Call an experiment off, or all of a study that has not ended; what is stored stays."""
    with _client(url) as client:
        found = client.find(id)
        running = [each for each in _experiments(found) if not each.state.ended]
        for each in running or _experiments(found)[:1]:
            client.cancel(each.id)
        typer.echo(f"Cancelled {found.name}.")


@app.command()
def catalogue(url: Url = None) -> None:
    """List the strategies, robots, engines, tunables and optimizers, and their options."""
    with _client(url) as client:
        display.console().print(*display.catalogue(client.catalogue()))


@app.command()
def demo(
    folder: Annotated[Path, typer.Option(help="for its database, figures and log")] = Path("results/demo"),
) -> None:
    """Run the main job on small budgets: six strategies and the direct baseline, on a toy, then on a quadruped."""
    from api.demo import run

    run(folder, display.console())


def _watched(client: Client, id: str) -> ExperimentRead | StudyRead:  # noqa: A002 - as the API says
    try:
        return follow(client.watch(id), display.console())
    except KeyboardInterrupt:
        msg = f"it goes on without you; `gaplab show {id}` says how far it is"
        raise CommandError(msg, Exit.INTERRUPTED) from None


def _leave(lines: list[str], code: Exit) -> None:
    for line in lines:
        printable = line.encode("utf-8", "backslashreplace").decode()  # names of files need not be Unicode
        typer.echo(f"gaplab: {printable}", err=True)
    sys.exit(code)


def _client(url: str | None) -> Client:
    return Client(url or Settings.from_environment().url)


def _settings(host: str | None, port: int | None) -> Settings:
    from dataclasses import replace

    given: dict[str, Any] = {name: value for name, value in {"host": host, "port": port}.items() if value is not None}
    return replace(Settings.from_environment(), **given)


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")
    typer.echo(f"Wrote {path}.")


def _experiments(found: ExperimentRead | StudyRead) -> tuple[ExperimentRead, ...]:
    return found.experiments if isinstance(found, StudyRead) else (found,)


def _print_misfit(found: MisfitRead, console: Console) -> None:
    if found.remarks:
        console.print(display.tuned(found), *found.remarks, sep="\n", markup=False)


def _print_warnings(found: Iterable[ExperimentRead]) -> None:
    for warning in sorted({warning for each in found for warning in each.warnings}):
        typer.echo(f"warning: {warning}", err=True)


def _finish(ended: ExperimentRead | StudyRead) -> None:
    """Say how it ended; a failure is one for the shell as well."""
    typer.echo(f"{ended.name}: {ended.state}; {display.numbers(ended.progress)}.")
    reasons = {reason for each in _experiments(ended) for reason in each.reasons}
    for reason in sorted(reasons):
        typer.echo(f"  {reason}", err=True)
    _print_warnings(_experiments(ended))
    if ended.state is not State.COMPLETED:
        raise typer.Exit(Exit.FAILED)


if __name__ == "__main__":
    main()
