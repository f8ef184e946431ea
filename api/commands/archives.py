"""Commands that write, read and compute again whole results: archives of experiments, and copies of the database."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Annotated

import typer
from rich.markup import escape

from gaplab.api.clients.client import Client
from gaplab.api.clients.screen import console
from gaplab.api.commands.app import KEEPING, Answer, AsJson, Id, Yes, command
from gaplab.api.commands.exit_codes import Exit
from gaplab.api.commands.json_output import print_json
from gaplab.api.commands.submission import submit_confirmed
from gaplab.schemas.archives import MOST_BYTES_OF_IMPORT, RepetitionRerun, RerunRead
from gaplab.services.core.errors import InvalidArchive
from gaplab.services.settings import Settings
from gaplab.services.store.atomic_files import appearing


@command(KEEPING)
def export(
    client: Client,
    id: Id,
    to: Annotated[Path | None, typer.Option("--to", "-o", help="new file; left out: gaplab-ID.zip")] = None,
) -> Answer:
    """Export a study, perhaps with one of its experiments alone, into one archive: a zipped SQLite database."""
    file = to or Path(f"gaplab-{client.study(id).id}.zip")  # the service's id, never a path that was typed
    with appearing(file) as part, part.open("wb") as target:
        client.export(id, target)
    size = file.stat().st_size
    most = f"{size:,} bytes; gaplab import takes {MOST_BYTES_OF_IMPORT:,}. gaplab backup copies any size"
    notes = [f"{file} has {most}"] if size > MOST_BYTES_OF_IMPORT else []
    return Answer({"file": str(file), "bytes": size}, f"Wrote {file}.", notes=notes)


@command(KEEPING, "import")
def import_(
    client: Client, file: Annotated[Path, typer.Argument(help="an archive")], yes: Yes = False, as_json: AsJson = False
) -> Answer:
    """Store the content of an archive; nothing in it is run."""
    with file.open("rb") as source:
        stored = client.import_(source, yes=yes)
    notes = [f"{old} is taken here; its new id is {new}" for old, new in stored.renamed.items()]
    notes += [f"{cancelled} had not ended; it is cancelled here" for cancelled in stored.called_off]
    return Answer(stored, stored.study, notes=[] if as_json else notes)


@command(KEEPING)
def backup(file: Annotated[Path, typer.Argument(help="new file for the copy")]) -> Answer:
    """Copy the SQLite database of GAPLAB_DATABASE_URL into a file, even while the service writes to it."""
    from gaplab.services.store.backup import backup as copy

    size = copy(Settings.from_environment().database_url, file)
    return Answer({"file": str(file), "bytes": size}, f"Wrote {file}: {size:,} bytes, checked.")


@command(KEEPING)
def restore(file: Annotated[Path, typer.Argument(help="a backup, which stays as it is")]) -> Answer:
    """Put a backup in the place of the SQLite database of GAPLAB_DATABASE_URL, which is kept under another name."""
    from gaplab.services.store.backup import restore as put_back

    done = put_back(Settings.from_environment().database_url, file)
    kept = f" The former database is now {done.kept}." if done.kept else ""
    found = {"file": str(done.file), "kept": str(done.kept) if done.kept else None, "revision": done.revision}
    return Answer(found, f"Restored {file} to {done.file}, checked.{kept}")


COLORS = {"same": "green", "different": "bold red", "not computed": "yellow"}


@command(KEEPING)
def rerun(  # noqa: PLR0913, PLR0917 - each is an option of the command
    client: Client,
    file: Annotated[Path, typer.Argument(metavar="ARCHIVE", help="an archive of `gaplab export`")],
    verify: Annotated[
        bool, typer.Option("--verify", help="compute it on this machine, without a service, and compare every bit")
    ] = False,
    repetitions: Annotated[int | None, typer.Option(min=1, help="of each experiment to verify; left out: all")] = None,
    experiment: Annotated[str | None, typer.Option(help="name or id of the only experiment to verify")] = None,
    repetition: Annotated[
        int | None, typer.Option(min=0, help="number of the only repetition to verify, from 0")
    ] = None,
    minutes: Annotated[
        float | None, typer.Option(min=0.01, help="verify the first steps, until this time is over")
    ] = None,
    yes: Yes = False,
    as_json: AsJson = False,
) -> Answer | None:
    """Submit the spec of an archive again, or verify its results on this machine."""
    from gaplab.services.plugins import folders

    parts = {"--repetitions": repetitions, "--experiment": experiment, "--repetition": repetition, "--minutes": minutes}
    if not verify and (given := [name for name, value in parts.items() if value is not None]):
        raise typer.BadParameter("it limits what --verify computes; add --verify", param_hint=given[0])
    folders.load(warn=True)
    if verify:
        _verify(file, (repetitions, experiment, repetition, minutes), as_json=as_json)
        return None
    from gaplab.services.archives.rerunning import submitted_spec

    with _opened(file) as source:
        spec = submitted_spec(source)
    study = submit_confirmed(client, spec, yes=yes)
    return Answer(study, study.id)


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
    """Yield an open archive; if the file is not one, the error names it."""
    with file.open("rb") as source:
        try:
            yield source
        except InvalidArchive as error:
            raise InvalidArchive(f"{file} is not an archive of gaplab: {error}") from error


def _line(result: RepetitionRerun) -> str:
    outcome = f"[{COLORS[result.outcome]}]{result.outcome}[/]"
    reason = f": {escape(result.reason)}" if result.reason else ""
    steps = f"{result.steps} of {result.stored_steps} steps"
    steps += f" with the code for {result.code}" if result.code else ""
    return f"{escape(result.name)} {result.repetition}: {outcome}, {steps}{reason}"


def _summary(found: RerunRead) -> list[str]:
    total = len(found.repetitions)
    lines = [f"{found.same} of {total} repetitions have the same bits."]
    lines += [f"{found.different} differ."] if found.different else []
    lines += [f"{found.not_computed} could not be computed."] if found.not_computed else []
    return [*lines, *(f"Other versions: {text}" for text in found.other_versions)]
