"""Commands that change the state or the size of studies, or of one experiment of them."""

from typing import Annotated

import typer

from gaplab.api.clients.progress import state_text
from gaplab.api.commands.app import LIFE, AsJson, Id, Url, app, connect
from gaplab.api.commands.json_output import print_result
from gaplab.schemas.records import StudyRead

Total = typer.Option(min=1, help="new total; left out: unchanged", show_default=False)


_VERBS = {
    "pause": "Pause a study once its current steps end, and free its cores.",
    "resume": "Continue a paused study.",
    "stop": "Complete a study with its results so far, once its current steps end.",
    "cancel": "Cancel the experiments of a study that have not ended; stored results are kept.",
    "retry": "Queue the FAILED repetitions of a study once more; they go on from their stored steps.",
}


def _add(verb: str, told: str) -> None:
    @app.command(verb, help=told, rich_help_panel=LIFE)
    def ask(id: Id, as_json: AsJson = False, url: Url = None) -> None:
        with connect(url) as client:
            _print_state(getattr(client, verb)(id), as_json=as_json)


for _verb, _told in _VERBS.items():
    _add(_verb, _told)


@app.command(rich_help_panel=LIFE)
def extend(
    id: Id,
    iterations: Annotated[int | None, Total] = None,
    repetitions: Annotated[int | None, Total] = None,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="extend it whatever it costs")] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Add iterations or repetitions to the completed experiments of a study; results are kept."""
    with connect(url) as client:
        _print_state(client.extend(id, iterations=iterations, repetitions=repetitions, yes=yes), as_json=as_json)


@app.command("accept-versions", rich_help_panel=LIFE)
def accept_versions(id: Id, as_json: AsJson = False, url: Url = None) -> None:
    """Let a study continue under other versions of engines or plug-ins than it started with."""
    with connect(url) as client:
        study = client.accept_versions(id)
    print_result(study, f"{study.id} continues under the versions of the next supervisor.", as_json=as_json)


def _print_state(study: StudyRead, *, as_json: bool) -> None:
    print_result(study, f"{study.name} is {state_text(study)}.", as_json=as_json)
