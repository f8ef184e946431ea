"""Two studies on small budgets, through the real service: `gaplab demo` and `make demo`.

The demo starts the service on a free port of this machine, with a database in a folder. It submits a study of the toy
function over HTTP, then one of the walking quadruped. If it is killed, a second run in the same folder continues. After
a complete run, the next one submits both studies again and keeps the old results.
"""

import json
import os
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from shlex import quote
from typing import Any

from rich.console import Console
from rich.markup import escape

from gaplab.api.clients.client import Client
from gaplab.api.clients.errors import ExperimentFailed, ServiceError
from gaplab.api.commands import tables
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.process.local_service import start_service
from gaplab.schemas.estimates import EstimateRead
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import StudyRead
from gaplab.services.store.sqlite_file import url_of

SPECS = Path(__file__).parents[4] / "examples"
STUDIES = ("toy", "quadruped")
SIZED = "quadruped"
"""The study with physics, whose size is what this machine computes while a person waits."""

SECONDS = 100.0
"""Time for the study."""

CHECK_ROLLOUTS = 800
"""Rollouts of the sensitivity check, which an estimate does not count."""

SIZES = (
    (3, 3, 1.0),
    (3, 3, 0.8),
    (3, 3, 0.6),
    (2, 3, 0.8),
    (2, 3, 0.6),
    (2, 3, 0.4),
    (2, 2, 0.6),
    (2, 2, 0.4),
    (2, 2, 0.2),
)
"""Repetitions, iterations and the fraction of each search's evaluations, from large to small."""

POPULATION = 20
"""Evaluations of the population that a search starts with."""

SEARCHES = ("controller_evaluations", "selection_evaluations", "simulator_evaluations")

Spec = Mapping[str, Any]


def run(folder: Path, console: Console, specs_from: Path = SPECS) -> None:
    """Run both studies; the folder, created if absent, receives the database, the figures and the service's log.

    Raises:
        CommandError: the service does not start, or Ctrl-C interrupts.
        ExperimentFailed: a study did not complete.
    """
    specs = {name: _spec(specs_from / f"{name}.json") for name in STUDIES}
    folder.mkdir(parents=True, exist_ok=True)
    started_at = time.monotonic()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends the demo in order, like Ctrl-C
    database, log = url_of(folder / "gaplab.db"), folder / "service.log"
    try:
        with start_service(database, log) as client:
            _print(f"Service: {client.url}, database {database}, log {log}", console)
            for name, spec in specs.items():
                _run_study(name, spec, client, folder, console)
    except KeyboardInterrupt:
        msg = f"interrupted; all results are kept, and `{command_here()} demo --folder {quote(str(folder))}` continues"
        raise CommandError(msg, Exit.INTERRUPTED) from None
    (folder / "demo.json").unlink()
    minutes, seconds = divmod(round(time.monotonic() - started_at), 60)
    _print(f"\nDone in {minutes} min {seconds} s; the service has ended. Results are in {folder}/:", console)
    _print("\n".join(f"  {folder / name}.html" for name in STUDIES), console, style="bold")
    _print("To explore them, start the service on the same database:", console)
    gaplab = command_here()
    serve = f"  GAPLAB_DATABASE_URL={quote(database)} {gaplab} serve"
    _print(f"{serve}\n  {gaplab} list; {gaplab} curve ID; http://127.0.0.1:8000/", console, style="bold")


def command_here(python: Path | None = None, path: str | None = None) -> str:
    """Return the command that runs this `gaplab` from this folder: its name if it is on the path, else its place.

    Args:
        python: that runs it; left out: this one.
        path: folders of commands; left out: PATH.
    """
    beside, found = (python or Path(sys.executable)).with_name("gaplab"), shutil.which("gaplab", path=path)
    if not beside.exists() or (found is not None and beside.samefile(found)):
        return "gaplab"
    return quote(os.path.relpath(beside) if beside.is_relative_to(Path.cwd()) else str(beside))


def _run_study(name: str, spec: dict[str, Any], client: Client, folder: Path, console: Console) -> None:
    study = _resumed(name, spec, client, folder)
    if study:
        console.print(f"\n[bold]{name}[/]: continuing study {study.id} of an earlier run")
    else:
        study = _submitted(name, spec, client, console)
        notes = _notes(folder) | {name: {"study": study.id, "spec": spec}}
        (folder / "demo.json").write_text(json.dumps(notes), "utf-8")
        console.print(f"\n[bold]{name}[/]: POST /studies → 202, study {study.id}")
    study = client.show(study.id, console, every_s=0.5)
    if study.state is not State.COMPLETED:
        raise ExperimentFailed(study)
    console.print(f"{name}: {study.progress.text}")
    _show(name, study, client, folder, console)


def _submitted(name: str, spec: dict[str, Any], client: Client, console: Console) -> StudyRead:
    if name == SIZED:
        client.wait(client.submit(trial(spec), yes=True).id, progress=False)
        spec, reason = sized(spec, client.estimate)
        console.print(f"\n[bold]{name}[/]: {reason}; the study is sized for this machine")
    return client.submit(spec, yes=True)


def _show(name: str, study: StudyRead, client: Client, folder: Path, console: Console) -> None:
    curves = client.curves([study.id])
    console.print(f"\nFitness in reality ({curves[0].unit}), mean±SD, by number of real-world evaluations")
    console.print(tables.curves(curves), *tables.baselines(curves))
    for sentence in client.verdict(study.id).sentences:
        console.print(escape(sentence))
    for suffix in ("html", "svg"):
        client.figure(study.id).save(folder / f"{name}.{suffix}")
    _print(f"Figure: {folder / name}.html and .svg", console)


def _print(line: str, console: Console, style: str = "none") -> None:
    """Print a line without markup or line breaks, so that paths in it can be copied."""
    console.print(line, style=style, markup=False, emoji=False, highlight=False, soft_wrap=True)


def _spec(path: Path) -> dict[str, Any]:
    if not path.is_file():
        raise CommandError(f"{path} does not exist; run the demo from a clone of the repository", Exit.FILE)
    return dict(json.loads(path.read_text("utf-8")))


def _notes(folder: Path) -> dict[str, dict[str, Any]]:
    """Return the studies that earlier runs in this folder submitted, by name."""
    try:
        return dict(json.loads((folder / "demo.json").read_text("utf-8")))
    except (OSError, ValueError):
        return {}


def _resumed(name: str, spec: dict[str, Any], client: Client, folder: Path) -> StudyRead | None:
    """Return the study that an earlier run submitted with the same spec, unless it failed or is gone."""
    note = _notes(folder).get(name, {})
    if note.get("spec") != spec:
        return None
    try:
        study = client.study(note["study"])
    except ServiceError:
        return None
    return study if study.state not in {State.FAILED, State.CANCELLED} else None


def trial(spec: Spec) -> dict[str, Any]:
    """Return the spec of a small experiment, from which the service learns the duration of a rollout."""
    same = {name: spec[name] for name in ("robot", "engine", "reality", "seed") if name in spec}
    size = {"strategy": "direct", "repetitions": 2, "budget": {"preset": "smoke", "controller_evaluations": 100}}
    return same | size | {"name": "how long a rollout takes here"}


def sized(spec: Spec, estimate: Callable[[Spec], EstimateRead]) -> tuple[dict[str, Any], str]:
    """Return the largest version of the study that is estimated to fit into the time, or the smallest version.

    It has every number, so it gives the same curves on any machine. The text has the machine's pace, and the duration.
    """
    for smaller in _versions(spec):
        found = estimate(smaller)
        rollout_s = max(cost.seconds_per_rollout for cost in found.engines)
        expected_s = found.seconds + CHECK_ROLLOUTS * rollout_s / found.cores
        if expected_s <= SECONDS:
            break
    pace = f"{rollout_s * 1000:.0f} ms a rollout"
    named = smaller | {"name": f"{spec['name']}, sized for {pace}"}
    return named, f"{pace} on {found.cores} cores: about {expected_s:.0f} s"


def _versions(spec: Spec) -> Iterator[dict[str, Any]]:
    for repetitions, iterations, part in SIZES:
        budget = {name: _part(number, part) if name in SEARCHES else number for name, number in spec["budget"].items()}
        counts = {"repetitions": repetitions, "direct_repetitions": 2 * repetitions, "iterations": iterations}
        yield dict(spec) | counts | {"budget": budget}


def _part(evaluations: int, part: float) -> int:
    return max(POPULATION, round(part * evaluations))
