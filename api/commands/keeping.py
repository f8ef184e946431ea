"""Keep what there is: archives of experiments, copies of the database."""

from pathlib import Path
from typing import Annotated

import typer

from api.commands.base import app
from services.settings import Settings
from services.store.backup import backup as copy


@app.command()
def backup(file: Annotated[Path, typer.Argument(help="for the copy; must not be there yet")]) -> None:
    """Copy the SQLite database of GAPLAB_DATABASE_URL, though the service writes to it, into a file to start from."""
    size = copy(Settings.from_environment().database_url, file)
    typer.echo(f"Wrote {file}: {size:,} bytes, checked.")
