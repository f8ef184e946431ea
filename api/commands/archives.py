"""Commands that write and read whole results: archives of experiments and copies of the database."""

from pathlib import Path
from typing import Annotated

import typer

from gaplab.api.commands.app import KEEPING, AsJson, Id, Url, app, connect
from gaplab.api.commands.json_output import print_json, print_result
from gaplab.schemas.archives import MOST_BYTES_OF_IMPORT
from gaplab.services.settings import Settings
from gaplab.services.store.atomic_files import PRIVATE, appearing


@app.command(rich_help_panel=KEEPING)
def export(
    id: Id,
    to: Annotated[Path | None, typer.Option(help="new file; left out: gaplab-ID.zip", show_default=False)] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Export a study or an experiment into one archive of JSON and Parquet."""
    with connect(url) as client:
        file = to or Path(f"gaplab-{client.find(id).id}.zip")  # the service's id, never a path that was typed
        with appearing(file, PRIVATE) as part, part.open("wb") as target:
            client.export(id, target)
    size = file.stat().st_size
    print_result({"file": str(file), "bytes": size}, f"Wrote {file}.", as_json=as_json)
    if size > MOST_BYTES_OF_IMPORT:
        most = f"{size:,} bytes; gaplab import takes {MOST_BYTES_OF_IMPORT:,}. gaplab backup copies any size"
        typer.echo(f"{file} has {most}", err=True)


@app.command("import", rich_help_panel=KEEPING)
def import_(file: Annotated[Path, typer.Argument(help="an archive")], as_json: AsJson = False, url: Url = None) -> None:
    """Store the content of an archive; nothing in it is run."""
    with connect(url) as client, file.open("rb") as source:
        stored = client.import_(source)
    if as_json:
        print_json(stored)
        return
    typer.echo(stored.study or stored.experiments[0])
    for old, new in stored.renamed.items():
        typer.echo(f"{old} is taken here; its new id is {new}", err=True)
    for cancelled in stored.called_off:
        typer.echo(f"{cancelled} had not ended; it is cancelled here", err=True)


@app.command(rich_help_panel=KEEPING)
def backup(file: Annotated[Path, typer.Argument(help="new file for the copy")], as_json: AsJson = False) -> None:
    """Copy the SQLite database of GAPLAB_DATABASE_URL into a file, even while the service writes to it."""
    from gaplab.services.store.backup import backup as copy

    size = copy(Settings.from_environment().database_url, file)
    print_result({"file": str(file), "bytes": size}, f"Wrote {file}: {size:,} bytes, checked.", as_json=as_json)


@app.command(rich_help_panel=KEEPING)
def restore(
    file: Annotated[Path, typer.Argument(help="a backup, which stays as it is")], as_json: AsJson = False
) -> None:
    """Put a backup in the place of the SQLite database of GAPLAB_DATABASE_URL, which is kept under another name."""
    from gaplab.services.store.restore import restore as put_back

    done = put_back(Settings.from_environment().database_url, file)
    kept = f" The former database is now {done.kept}." if done.kept else ""
    found = {"file": str(done.file), "kept": str(done.kept) if done.kept else None, "revision": done.revision}
    print_result(found, f"Restored {file} to {done.file}, checked.{kept}", as_json=as_json)
