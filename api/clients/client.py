"""A client of the service in Python; the `gaplab` command is made of it.

with Client("http://127.0.0.1:8000") as client:
    study = client.submit({"robot": "toy_function", "budget": "smoke"})
    client.wait(study)
    curves = client.curves(study)

Programs import it from `gaplab`.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Self

import httpx2

from gaplab.api.clients.archives import Archives
from gaplab.api.clients.bench import Bench
from gaplab.api.clients.connection import PAUSES_S, Connection, segment
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable
from gaplab.api.clients.events import EventLog
from gaplab.api.clients.figures import Figures
from gaplab.api.clients.keeping import Keeping
from gaplab.api.clients.records import Records
from gaplab.api.clients.replays import Replays
from gaplab.api.clients.reports import Reports
from gaplab.api.clients.results import Results
from gaplab.api.clients.submission import Submission
from gaplab.api.clients.tables import Tables
from gaplab.api.clients.watcher import Watcher
from gaplab.schemas.plugin import Catalogue
from gaplab.schemas.robots import RobotRead


class Client:
    """A client of the service.

    Its methods belong to its parts, which share one connection: `client.figure` is short for `client.figures.draw`,
    `client.samples` for `client.tables.samples`. A study or an experiment may be given in place of its id. Every method
    that sends a request raises ServiceError with the service's problem, or ServiceUnreachable.

    Args:
        url: address of the service; left out: GAPLAB_URL, or this machine.
        token: token to send; left out: GAPLAB_TOKEN, or none; "" for none.
        timeout_s: longest wait for an answer.
        transport: replaces the network, for tests.
        pauses_s: pauses before each repetition of a request that is safe to repeat.
    """

    def __init__(
        self,
        url: str | None = None,
        *,
        token: str | None = None,
        timeout_s: float = 60.0,
        transport: httpx2.BaseTransport | None = None,
        pauses_s: Sequence[float] = PAUSES_S,
    ) -> None:
        connection = Connection(url, token=token, timeout_s=timeout_s, transport=transport, pauses_s=pauses_s)
        self.url, self._connection = connection.url, connection
        self.submission = submission = Submission(connection)
        self.records = records = Records(connection)
        self.keeping = keeping = Keeping(connection, records)
        self.results = results = Results(connection)
        self.tables = tables = Tables(connection, results)
        self.figures, self.archives = figures, archives = Figures(connection), Archives(connection)
        self.reports, self.replays = reports, replays = Reports(connection), Replays(connection)
        self.event_log, self.watcher = event_log, watcher = EventLog(connection), Watcher(records, results)
        self.bench = bench = Bench(connection, records)

        self.submit, self.estimate, self.check = submission.submit, submission.estimate, submission.check
        self.study, self.experiment, self.studies = records.study, records.experiment, records.studies
        self.edit, self.spec, self.repetitions = records.edit, records.spec, records.repetitions
        self.attempts, self.provenance, self.retry = records.attempts, records.provenance, records.retry
        self.pause, self.resume, self.stop = records.pause, records.resume, records.stop
        self.cancel, self.extend, self.schedule = records.cancel, records.extend, records.schedule
        self.accept_versions, self.notify = records.accept_versions, keeping.notify
        self.tag, self.untag = keeping.tag, keeping.untag
        self.archive, self.unarchive, self.delete = keeping.archive, keeping.unarchive, keeping.delete
        self.views, self.save_view, self.delete_view = keeping.views, keeping.save_view, keeping.delete_view
        self.curves, self.curves_csv = results.curves, results.curves_csv
        self.compare, self.diff, self.curve, self.samples = results.compare, results.diff, tables.curve, tables.samples
        self.misfit, self.misfit_csv, self.figure_kinds = results.misfit, results.misfit_csv, figures.kinds
        self.simulators, self.predictions, self.readings = tables.simulators, tables.predictions, tables.readings
        self.figure, self.verdict, self.events = figures.draw, reports.verdict, event_log.events
        self.report, self.take_home, self.replay = reports.save, reports.take_home, replays.replay
        self.export, self.import_, self.requests = archives.export, archives.import_, bench.requests
        self.watch, self.wait = watcher.watch, watcher.wait

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()

    def ready(self) -> bool:
        """Return whether the service answers and can use its database."""
        try:
            with self._connection.stream("GET", "/readyz"):
                return True
        except (ServiceError, ServiceUnreachable):
            return False

    def add_robot(self, file: str | Path) -> RobotRead:
        """Store a robot file, which `gaplab robot import` writes; specs name the robot by its name from then on."""
        return self._connection.upload(RobotRead, "/robots", [Path(file).read_bytes()], "application/json")

    def robot_file(self, robot: str) -> bytes:
        """Return the robot file with this hash, or the newest one with this name."""
        return self._connection.get_bytes(f"/robots/{segment(robot)}")

    def robots(self) -> tuple[RobotRead, ...]:
        """Return the robots from files, by name, the newest of a name first."""
        return self._connection.get(tuple[RobotRead, ...], "/robots")

    def catalogue(self) -> Catalogue:
        """Return the plug-ins of the service."""
        return self._connection.get(Catalogue, "/catalogue")
