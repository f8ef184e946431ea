"""The main job on small budgets, through the real service: what `gaplab demo` and `make demo` run.

It starts the service on a free port of this machine, with a database in a folder, and submits two studies over HTTP:
the toy function, then the walking quadruped. Killed and run again in the same folder, it goes
on where it was; run again after it has finished, it starts anew beside the old results.
"""

import json
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shlex import quote

from rich.console import Console
from rich.markup import escape

from gaplab.api.clients import display
from gaplab.api.clients.client import Client, ServiceError
from gaplab.api.clients.findings import findings
from gaplab.api.clients.watch import follow
from gaplab.api.commands import demo_size
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.process.local_service import start_service
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import ExperimentRead, StudyRead

SPECS = Path(__file__).parents[3] / "examples"
STUDIES = ("toy", "quadruped")
SIZED = "quadruped"
"""The study that is made as large as this machine computes in time."""


def run(folder: Path, console: Console, specs_from: Path = SPECS) -> None:
    """Run both studies, and say where everything is.

    Args:
        folder: gets the database, the figures and the service's log; made if it is not there.
        console: to show progress and results on.
        specs_from: the folder that has the specs of the studies.

    Raises:
        CommandError: the service does not start, a study fails, or a person interrupts.
    """
    specs = {name: _spec(specs_from / f"{name}.json") for name in STUDIES}
    folder.mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    try:
        database, log = _database(folder), folder / "service.log"
        with _interruptible(), start_service(database, log) as client:
            _say(f"Service: {client.url}, database {database}, log {log}", console)
            for name, spec in specs.items():
                _run_study(name, spec, client, folder, console)
    except KeyboardInterrupt:
        again = f"gaplab demo --folder {quote(str(folder))}"
        msg = f"interrupted; all that was measured is kept, and `{again}` goes on with it"
        raise CommandError(msg, Exit.INTERRUPTED) from None
    (folder / "demo.json").unlink()
    _say_where(folder, console, time.monotonic() - began)


def _run_study(name: str, spec: dict[str, object], client: Client, folder: Path, console: Console) -> None:
    study = _resumed(name, spec, client, folder)
    if study:
        console.print(f"\n[bold]{name}[/]: going on with study {study.id} of an earlier run")
    else:
        fitting = _sized(name, spec, client, console) if name == SIZED else spec
        study = _study(client.submit(fitting))
        _remember(folder, name, spec, study.id)
        console.print(f"\n[bold]{name}[/]: POST /studies → 202, study {study.id}")
    ended = follow(client.watch(study.id, every_s=0.5), console)
    if ended.state is not State.COMPLETED:
        reasons = {reason for each in _study(ended).experiments for reason in each.reasons}
        msg = f"the study {name} ended as {ended.state}: {'; '.join(sorted(reasons)) or 'called off'}"
        raise CommandError(msg, Exit.FAILED)
    console.print(f"{name}: {display.numbers(ended.progress)}")
    _show(name, _study(ended), client, folder, console)


def _sized(name: str, spec: dict[str, object], client: Client, console: Console) -> dict[str, object]:
    """Time a few rollouts on this machine, and return the version of the study that suits it."""
    client.wait(client.submit(demo_size.trial(spec)).id, progress=False)
    found = demo_size.sized(spec, client)
    console.print(f"\n[bold]{name}[/]: {found.reason}; the study is sized for this machine")
    return found.spec


def _study(found: ExperimentRead | StudyRead) -> StudyRead:
    """What was submitted without a `strategy` is a study."""
    assert isinstance(found, StudyRead)
    return found


def _show(name: str, study: StudyRead, client: Client, folder: Path, console: Console) -> None:
    curves = client.curves([study.id])
    console.print(
        f"\nFitness in reality ({curves[0].unit}) after so many real-world evaluations, mean±SD over repetitions"
    )
    console.print(display.curves(curves), *display.baselines(curves))
    for line in findings(client, curves):
        console.print(escape(line))
    for kind in ("html", "svg"):
        client.figure(study.id).save(folder / f"{name}.{kind}")
    _say(f"Figure: {folder / name}.html and .svg", console)


def _say_where(folder: Path, console: Console, seconds: float) -> None:
    minutes, rest = divmod(round(seconds), 60)
    _say(f"\nDone in {minutes} min {rest} s; the service has ended. Everything is in {folder}/: look at", console)
    for name in STUDIES:
        _say(f"  {folder / name}.html", console, style="bold")
    _say("Start the service on the same database, and ask it anything:", console)
    _say(f"  GAPLAB_DATABASE_URL={quote(_database(folder))} gaplab serve", console, style="bold")
    _say("  gaplab list; gaplab curve ID; http://127.0.0.1:8000/docs", console, style="bold")


def _say(line: str, console: Console, style: str = "none") -> None:
    """A line as it is, to be copied: names of folders may look like markup, and are not broken."""
    console.print(line, style=style, markup=False, emoji=False, highlight=False, soft_wrap=True)


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let SIGTERM end the demo as Ctrl-C does: in order."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _spec(path: Path) -> dict[str, object]:
    if not path.is_file():
        msg = f"{path} is not there; the demo runs from a clone of the repository"
        raise CommandError(msg, Exit.FILE)
    spec: dict[str, object] = json.loads(path.read_text("utf-8"))
    return spec


def _remembered(folder: Path) -> dict[str, dict[str, object]]:
    notes = folder / "demo.json"
    try:
        found: dict[str, dict[str, object]] = json.loads(notes.read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return found


def _remember(folder: Path, name: str, spec: dict[str, object], id: str) -> None:
    notes = _remembered(folder) | {name: {"study": id, "spec": spec}}
    (folder / "demo.json").write_text(json.dumps(notes), "utf-8")


def _resumed(name: str, spec: dict[str, object], client: Client, folder: Path) -> StudyRead | None:
    """The study that an earlier run in this folder submitted with the same spec, unless it failed or is gone."""
    note = _remembered(folder).get(name, {})
    if note.get("spec") != spec:
        return None
    try:
        study = client.study(str(note["study"]))
    except ServiceError:
        return None
    return study if study.state not in {State.FAILED, State.CANCELLED} else None


def _database(folder: Path) -> str:
    return f"sqlite:///{folder / 'gaplab.db'}"
