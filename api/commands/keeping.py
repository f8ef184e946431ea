"""Keep what there is: archives of experiments, copies of the database."""

from pathlib import Path
from typing import Annotated

import typer

from gaplab.api.commands.base import AsJson, Id, Url, app, connect
from gaplab.api.commands.json_output import document
from gaplab.services.settings import Settings
from gaplab.services.store.atomic_files import appearing
from gaplab.services.store.backup import backup as copy


@app.command()
def export(
    id: Id,
    to: Annotated[
        Path | None, typer.Option(help="file that must not be there yet; left out: gaplab-ID.zip", show_default=False)
    ] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Write everything of a study or an experiment into one archive of JSON and Parquet."""
    with connect(url) as client:
        file = to or Path(f"gaplab-{client.find(id).id}.zip")  # an id that there is: not any path that was typed
        with appearing(file) as part, part.open("wb") as target:
            client.export(id, target)
    if as_json:
        document({"file": str(file), "bytes": file.stat().st_size})
        return
    typer.echo(f"Wrote {file}.")


@app.command("import")
def import_(file: Annotated[Path, typer.Argument(help="an archive")], as_json: AsJson = False, url: Url = None) -> None:
    """Store what is in an archive; nothing of it is run."""
    with connect(url) as client, file.open("rb") as source:
        stored = client.import_(source)
    if as_json:
        document(stored)
        return
    typer.echo(stored.study or stored.experiments[0])
    for old, new in stored.renamed.items():
        typer.echo(f"{old} was taken here: it is {new} now", err=True)
    for each in stored.called_off:
        typer.echo(f"{each} had not ended: it is called off here", err=True)


@app.command()
def backup(
    file: Annotated[Path, typer.Argument(help="for the copy; must not be there yet")], as_json: AsJson = False
) -> None:
    """Copy the SQLite database of GAPLAB_DATABASE_URL, though the service writes to it, into a file to start from."""
    size = copy(Settings.from_environment().database_url, file)
    if as_json:
        document({"file": str(file), "bytes": size})
        return
    typer.echo(f"Wrote {file}: {size:,} bytes, checked.")
