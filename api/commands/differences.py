"""The command that compares settings."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import RenderableType

from gaplab.api.clients.client import Client
from gaplab.api.commands import completion, tables
from gaplab.api.commands.app import RESULTS, AsJson, Url, app, connect
from gaplab.api.commands.json_output import print_result
from gaplab.schemas.differences import SpecDiff
from gaplab.services.findings.tables import differing

if TYPE_CHECKING:
    from gaplab.services.specs.differences import SpecColumn

FILES = {".zip", ".json"}

Compared = Annotated[
    list[str],
    typer.Argument(
        metavar="ID|FILE",
        help="studies, experiments, archives (.zip) or specs (.json); a single study is compared within",
        autocompletion=completion.ids,
    ),
]


@app.command(rich_help_panel=RESULTS)
def diff(of: Compared, as_json: AsJson = False, url: Url = None) -> None:
    """Show the settings in which studies, experiments, archives or specs differ."""
    if any(Path(name).suffix in FILES for name in of):
        found = _with_files(of, url)
    else:
        with connect(url) as client:
            found = client.diff(*of)
    grid = differing(found, [column.name for column in found.columns])
    shown: tuple[RenderableType, ...] = tables.shown(grid) if found.settings else ("No setting differs.",)
    print_result(found, *(f"! {warning}" for warning in found.warnings), *shown, found.note, as_json=as_json)


def _with_files(names: list[str], url: str | None) -> SpecDiff:
    """Compare what files and the service have; without ids, no service is needed."""
    from gaplab.api.commands.spec_columns import column_of
    from gaplab.services.specs.differences import SpecColumn, differences

    files = {name: column_of(Path(name)) for name in names if Path(name).suffix in FILES}
    if len(files) == len(names):
        columns = [files[name] for name in names]
    else:
        with connect(url) as client:
            columns = [files.get(name) or _stored(client, name) for name in names]
    if len(columns) == 1:
        columns = [SpecColumn(f"{at}", spec["name"], (spec,)) for at, spec in enumerate(columns[0].specs)]
    return differences(columns)


def _stored(client: Client, id: str) -> "SpecColumn":
    from gaplab.services.specs.differences import SpecColumn

    study = client.study(id)
    return SpecColumn(study.id, study.name, tuple(experiment.spec for experiment in study.experiments))
