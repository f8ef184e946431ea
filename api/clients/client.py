"""A client of the service in Python; the `gaplab` command is made of it.

with Client("http://127.0.0.1:8000") as client:
    study = client.submit({"robot": "toy_function", "budget": "smoke"})
    study.wait()
    curves = study.curves()

Programs import it from `gaplab`.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Self

import httpx2

from gaplab.api.clients.bench import Bench, Requests
from gaplab.api.clients.connection import PAUSES_S, Connection, segment
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable
from gaplab.api.clients.events import EventLog
from gaplab.api.clients.figures import Figures
from gaplab.api.clients.files import Files
from gaplab.api.clients.watcher import Watcher
from gaplab.schemas.plugin import Catalogue
from gaplab.schemas.robots import PoolRead, RobotRead


class Client(Watcher, Requests, Figures, Files, EventLog):
    """A client of the service.

    A study or an experiment may be given in place of its id, and those that the client returns have the same methods.
    `client.bench` has what concerns a robot on a bench. Every method that sends a request raises ServiceError with the
    service's problem, or ServiceUnreachable.

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
        self._connection = Connection(url, token=token, timeout_s=timeout_s, transport=transport, pauses_s=pauses_s)
        self._connection.owner, self.url = self, self._connection.url

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        """Leave what it returned without a client in another process."""
        return type(None), ()

    def __repr__(self) -> str:
        return f"<client of {self.url}>"

    @property
    def bench(self) -> Bench:
        """What is to be measured of a robot on a bench, and what was."""
        return Bench(self._connection)

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

    def add_pool(self, file: str | Path) -> PoolRead:
        """Store a pool, which `gaplab pool import` writes; specs name it by its name from then on."""
        return self._connection.upload(PoolRead, "/pools", [Path(file).read_bytes()], "application/json")

    def pools(self) -> tuple[PoolRead, ...]:
        """Return the pools, by name, the newest of a name first."""
        return self._connection.get(tuple[PoolRead, ...], "/pools")

    def catalogue(self) -> Catalogue:
        """Return the plug-ins of the service."""
        return self._connection.get(Catalogue, "/catalogue")
