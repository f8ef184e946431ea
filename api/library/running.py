"""`gaplab.run`: a study in this process and processes of this machine, with the numbers of the service."""

import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from functools import cached_property
from pathlib import Path
from shutil import copyfileobj, rmtree
from time import monotonic
from typing import TYPE_CHECKING, Any
from weakref import finalize

from pydantic import TypeAdapter, ValidationError

from gaplab.api.clients.progress import RecordProgress, Snapshot, follow
from gaplab.api.library.robots import with_files
from gaplab.schemas.lifecycle import State, Verb
from gaplab.schemas.records import StudyRead
from gaplab.schemas.spec import AnySpec, ExperimentSpec, StudySpec
from gaplab.services.archives.reading import import_archive
from gaplab.services.archives.writing import export
from gaplab.services.core.errors import GaplabError, InvalidSpec, Violation
from gaplab.services.experiments import lifecycle, reading
from gaplab.services.experiments.listing import list_studies
from gaplab.services.experiments.submission import submit
from gaplab.services.plugins import folders
from gaplab.services.store.session import Store, new_database
from gaplab.services.store.sqlite_file import in_use, url_of
from gaplab.workers.process_tasks import ProcessTasks
from gaplab.workers.supervisor import Supervisor

if TYPE_CHECKING:
    import pandas

    from gaplab.api.clients.client import Client
    from gaplab.api.clients.figures import Figure
    from gaplab.api.clients.objects import Study
    from gaplab.schemas.reports import VerdictRead

Spec = Mapping[str, Any] | ExperimentSpec | StudySpec | str | Path

ZIP, SQLITE = b"PK", b"SQLite format 3"
"""How an archive and a database begin."""

EVERY_S = 0.5
"""Time between two views of the progress."""

RESTS = (State.PAUSED, State.WAITING)
"""States in which nothing is computed, though the study has not ended."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended `gaplab.run`; the message says how to go on with what is complete, which is in `result`."""

    def __init__(self, result: "Result") -> None:
        self.result = result
        kept = str(result.path)
        super().__init__(f"what is complete is in {kept}, and gaplab.run({kept!r}) goes on")


def run(
    spec: Spec, *, path: str | Path | None = None, workers: int | None = None, progress: bool | None = None
) -> "Result":
    """Compute a study here, and return its results; the numbers are those of the service.

    Args:
        spec: what a service takes as `POST /studies` or `POST /experiments`; or a JSON file with it. A file of
            `Result.save`, or a database of an earlier run, goes on with what has not ended in it.
        path: an SQLite database that keeps everything while it runs, created if absent; a service opens it too. Left
            out: a temporary one, which ends with the result.
        workers: processes, each for one repetition at a time; left out: one for each core.
        progress: show progress on standard error or in the notebook; left out: only in a terminal or a notebook.

    Raises:
        ServiceError: the spec is refused; the message has each value, its place and what is permitted.
        InvalidSpec: its reality is physical, so that nothing can be computed: `gaplab.Tuning` asks and is told.
        InvalidArchive: the file is damaged or not an archive.
        Interrupted: Ctrl-C; what is complete is kept.
        OSError: the file cannot be read, or the database not be written.
    """
    if workers is not None and workers < 1:
        raise ValueError(f"workers: at least 1, not {workers}")
    folders.load()
    given = _read(spec) if isinstance(spec, str | Path) else spec
    if isinstance(given, Path) and begins(given, SQLITE):
        path = given
    file = database(path)
    with ExitStack() as refused:
        if path is None:
            refused.callback(rmtree, file.parent, ignore_errors=True)
        store = refused.enter_context(Store(url_of(file)))
        result = Result(store, file, study_of(store, file, given))
        refused.pop_all()
    try:
        with in_use(store.file):
            _compute(result, workers, progress=progress)
    except KeyboardInterrupt:
        raise Interrupted(result) from None
    if path is None:
        finalize(result, rmtree, file.parent, ignore_errors=True)
    return result


def database(path: str | Path | None) -> Path:
    """Return the file of a database, which is made if it is absent; without a path, in a new folder."""
    file = Path(tempfile.mkdtemp(prefix="gaplab-run-")) / "study.db" if path is None else Path(path).absolute()
    if file.is_dir():
        raise IsADirectoryError(f"path: a database, not the folder {file}")
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        new_database(file)
    return file


class Result:
    """A study that was computed here.

    Attributes:
        path: its database; a temporary one ends with this object.
        id: of the study.
    """

    def __init__(self, store: Store, path: Path, id: str) -> None:
        self.path, self.id = path, id
        self._store, self._open = store, ExitStack()
        self._open.callback(store.dispose)
        finalize(self, self._open.close)

    def __repr__(self) -> str:
        return f"<result of {self.study!r}>"

    def _repr_html_(self) -> str:
        return self.study._repr_html_()

    @cached_property
    def client(self) -> "Client":
        """A client of a service in this process, which has all that is known about the study."""
        from gaplab.api.library.here import client_of  # takes a second, and runs need no API

        return self._open.enter_context(client_of(self._store, url_of(self.path)))

    @property
    def study(self) -> "Study":
        """The study, with its states, its warnings and its experiments."""
        return self.client.study(self.id)

    @property
    def curve(self) -> "pandas.DataFrame":
        """The curves: a row for each experiment and number of real-world evaluations; see `Client.curve`."""
        return self.client.curve(self.id)

    @property
    def samples(self) -> "pandas.DataFrame":
        """The real-world evaluations of all experiments; see `Client.samples`."""
        return self._each(self.client.samples)

    @property
    def simulators(self) -> "pandas.DataFrame":
        """The tuned simulators of all experiments; see `Client.simulators`."""
        return self._each(self.client.simulators)

    @property
    def verdict(self) -> "VerdictRead":
        """What the curves and tests say, in words."""
        return self.client.verdict(self.id)

    def figure(self, *, of: str = "curves", **options: Any) -> "Figure":  # noqa: ANN401 - those of the kind
        """Return a figure of the study; see `Client.figure`."""
        return self.client.figure(self.id, of=of, **options)

    def save(self, file: str | Path) -> Path:
        """Write everything into a new archive, which a service imports, and with which `gaplab.run` goes on.

        It has the parameters of a simulated reality, also where a service would still hide them.

        Raises:
            OSError: the file exists already, or cannot be written.
        """
        path = Path(file)
        path.parent.mkdir(parents=True, exist_ok=True)
        archive = export(self._store, self.id, whole=True)
        with archive.file, path.open("xb") as target:
            copyfileobj(archive.file, target)
        return path

    def _each(self, table: Any) -> "pandas.DataFrame":  # noqa: ANN401 - a method of the client
        """Return the tables of all experiments as one, which names them as curves do."""
        import pandas

        named = ("experiment", "name", "strategy")
        study = self.study
        parts = [(table(each.id), (each.id, each.name, each.strategy)) for each in study.experiments]
        for part, names in parts:
            for place, (column, value) in enumerate(zip(named, names, strict=True)):
                part.insert(place, column, value)
        return pandas.concat([part for part, _ in parts], ignore_index=True)


def _read(spec: str | Path) -> Any:  # noqa: ANN401 - any JSON
    """Return the content of a JSON file, or the path of an archive or a database."""
    path = Path(spec)
    if begins(path, ZIP) or begins(path, SQLITE):
        return path
    try:
        return json.loads(path.read_bytes())
    except ValueError as error:
        raise ValueError(f"{path} is neither an archive, nor a database, nor JSON: {error}") from error


def begins(path: Path, mark: bytes) -> bool:
    """Return whether a file begins with these bytes."""
    with path.open("rb") as file:
        return file.read(len(mark)) == mark


def study_of(store: Store, file: Path, given: Any) -> str:  # noqa: ANN401 - a spec in any form, or a path
    """Return the id of the study to compute: a submitted one, an imported one, or the newest of the database."""
    if isinstance(given, Path) and given.absolute() == file:
        if not (found := list_studies(store, limit=1).items):
            raise FileNotFoundError(f"{given} has no study")
        id_ = found[0].id
    elif isinstance(given, Path):
        with given.open("rb") as archive:
            id_ = import_archive(store, archive).study
    else:
        return _submitted(store, file, given)
    if reading.read(store, id_).state is State.PAUSED:
        lifecycle.ask(store, id_, Verb.RESUME)
    return id_


def _submitted(store: Store, file: Path, given: Any) -> str:  # noqa: ANN401 - a spec in any form
    """Submit a spec, and return the id of its study; one that is refused is refused in the words of the service."""
    with suppress(ValidationError):
        given = given if isinstance(given, ExperimentSpec | StudySpec) else _SPEC.validate_python(given)
        given = with_files(store, given)
    if isinstance(given, ExperimentSpec | StudySpec) and given.reality.kind != "physical":
        with suppress(GaplabError):
            return submit(store, given).id
    elif isinstance(given, ExperimentSpec | StudySpec):
        msg = "nobody is asked for measurements here: gaplab.Tuning asks, and so does the bench of a service"
        raise InvalidSpec([Violation("/reality/kind", "physical", msg, ["simulated", "recorded"])])
    from gaplab.api.library.here import client_of

    with client_of(store, url_of(file)) as client:
        return client.send(given, confirm_cost=True).id


_SPEC: TypeAdapter[ExperimentSpec | StudySpec] = TypeAdapter(AnySpec)


def _compute(result: Result, workers: int | None, *, progress: bool | None) -> None:
    """Compute the study of a result until it has ended, or nothing of it can go on."""
    at_once = workers or os.cpu_count() or 1
    with ProcessTasks() as tasks, _supervised(result._store, at_once, tasks) as supervisor:
        follow(_snapshots(result, supervisor), progress)


@contextmanager
def _supervised(store: Store, at_once: int, tasks: ProcessTasks) -> Iterator[Supervisor]:
    supervisor = Supervisor(store, lambda: at_once, tasks)
    try:
        yield supervisor
    finally:
        supervisor.hand_back()


def _snapshots(result: Result, supervisor: Supervisor) -> Iterator[Snapshot[StudyRead]]:
    """Yield the progress while the supervisor works."""
    while True:
        study = reading.read(result._store, result.id)
        rows = tuple(map(RecordProgress, study.experiments))
        yield Snapshot(study, (*([RecordProgress(study)] if len(rows) > 1 else []), *rows))
        if study.state.ended or (study.state in RESTS and not supervisor.busy):
            return
        supervisor.step()
        until = monotonic() + EVERY_S
        while supervisor.busy and monotonic() < until:
            supervisor.step()
