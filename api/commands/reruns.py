"""The command that computes an archive again."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Annotated

import typer
from rich.markup import escape

from gaplab.api.clients.progress.text import console
from gaplab.api.commands.app import KEEPING, AsJson, Url, app, connect
from gaplab.api.commands.exit_codes import Exit
from gaplab.api.commands.json_output import print_json, print_result
from gaplab.api.commands.submission import submit_confirmed
from gaplab.schemas.archives import RepetitionRerun, RerunRead
from gaplab.services.core.errors import InvalidArchive

COLORS = {"same": "green", "different": "bold red", "not computed": "yellow"}


@app.command(rich_help_panel=KEEPING)
def rerun(  # noqa: PLR0913, PLR0917 - each is an option of the command
    file: Annotated[Path, typer.Argument(metavar="ARCHIVE", help="an archive of `gaplab export`")],
    verify: Annotated[
        bool, typer.Option("--verify", help="compute it on this machine, without a service, and compare every bit")
    ] = False,
    repetitions: Annotated[
        int | None, typer.Option(min=1, help="of each experiment to verify; left out: all", show_default=False)
    ] = None,
    experiment: Annotated[
        str | None, typer.Option(help="name or id of the only experiment to verify", show_default=False)
    ] = None,
    repetition: Annotated[
        int | None, typer.Option(min=0, help="number of the only repetition to verify, from 0", show_default=False)
    ] = None,
    minutes: Annotated[
        float | None, typer.Option(min=0.01, help="verify the first steps, until this time is over", show_default=False)
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="do not ask, whatever it costs")] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Submit the spec of an archive again, or verify its results on this machine."""
    from gaplab.services.plugins import folders

    parts = {"--repetitions": repetitions, "--experiment": experiment, "--repetition": repetition, "--minutes": minutes}
    if not verify and (given := [name for name, value in parts.items() if value is not None]):
        raise typer.BadParameter("it limits what --verify computes; add --verify", param_hint=given[0])
    folders.load()
    if verify:
        _verify(file, (repetitions, experiment, repetition, minutes), as_json=as_json)
        return
    from gaplab.services.archives.rerunning import submitted_spec

    with _opened(file) as source:
        spec = submitted_spec(source)
    with connect(url) as client:
        record = submit_confirmed(client, spec, yes=yes)
    print_result(record, record.id, as_json=as_json)


def _verify(file: Path, part: tuple[int | None, str | None, int | None, float | None], *, as_json: bool) -> None:
    from gaplab.services.archives.rerunning import Part  # pulls in the physics
    from gaplab.services.archives.rerunning import verify as recompute

    screen = console(stderr=as_json)

    def show(result: RepetitionRerun) -> None:
        screen.print(_line(result), soft_wrap=True)

    with _opened(file) as source:
        found = recompute(source, Part(*part), computed=show)
    if as_json:
        print_json(found)
    else:
        screen.print(*_summary(found), sep="\n", soft_wrap=True, markup=False)
    if found.different or not found.same:
        raise typer.Exit(Exit.FAILED)


@contextmanager
def _opened(file: Path) -> Iterator[IO[bytes]]:
    """Yield an open archive; an error that it is none names the file."""
    with file.open("rb") as source:
        try:
            yield source
        except InvalidArchive as error:
            raise InvalidArchive(f"{file} is not an archive of gaplab: {error}") from error


def _line(result: RepetitionRerun) -> str:
    outcome = f"[{COLORS[result.outcome]}]{result.outcome}[/]"
    reason = f": {escape(result.reason)}" if result.reason else ""
    steps = f"{result.steps} of {result.stored_steps} steps"
    return f"{escape(result.name)} {result.repetition}: {outcome}, {steps}{reason}"


def _summary(found: RerunRead) -> list[str]:
    total = len(found.repetitions)
    lines = [f"{found.same} of {total} repetitions have the same bits."]
    lines += [f"{found.different} differ."] if found.different else []
    lines += [f"{found.not_computed} could not be computed."] if found.not_computed else []
    return [*lines, *(f"Other versions: {text}" for text in found.other_versions)]
