"""Connections to Postgres that notice when the other end is gone.

A connection can die silently: a firewall forgets it, a cable is cut, a proxy hangs. The kernel notices the first two if
it is told to look. A proxy that hangs still accepts bytes, so only a limit of the client's own ends that wait.
"""

from collections.abc import Generator
from time import monotonic
from typing import Any, TypeVar

import psycopg
from sqlalchemy import URL, Engine, create_engine, event

T = TypeVar("T")

CONNECT_S = 5
"""Longest wait for a server to answer a connection, and grace of a client that waits for a statement's end."""

SILENT_TRANSACTION_S = 60
"""Seconds after which the server ends an idle transaction, as of a stopped process: it may hold locks."""

_NOTICED = {
    "connect_timeout": CONNECT_S,
    "keepalives": 1,
    "keepalives_idle": 10,
    "keepalives_interval": 5,
    "keepalives_count": 3,
    "tcp_user_timeout": 20_000,  # milliseconds
}
"""A dead peer is noticed after 25 s of silence, or 20 s after bytes that it did not acknowledge.

Source: https://www.postgresql.org/docs/current/libpq-connect.html.
"""


def postgres_engine(url: URL, *, answer_s: float | None) -> Engine:
    """Return an engine of a URL with its driver, without connecting; without `answer_s`, statements take any time."""
    engine = create_engine(
        url, pool_pre_ping=True, pool_size=10, max_overflow=20, connect_args=_NOTICED, hide_parameters=True
    )
    if answer_s is not None:
        _limit(engine, answer_s)
    return engine


def _limit(engine: Engine, answer_s: float) -> None:
    """End statements that take longer: the server does it, and the client if the server says nothing."""

    class Punctual(psycopg.Connection[Any]):
        """A connection whose statements end in time."""

        def wait(self, gen: Any, *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401  # psycopg's hook
            return super().wait(_in_time(self, gen, answer_s + CONNECT_S), *args, **kwargs)

    limits = f"SET statement_timeout = {round(answer_s * 1000)}; "
    limits += f"SET idle_in_transaction_session_timeout = {SILENT_TRANSACTION_S * 1000}"

    @event.listens_for(engine, "do_connect")
    def connect(dialect: object, record: object, args: Any, parameters: Any) -> Any:  # noqa: ANN401, ARG001  # SQLAlchemy's hook
        connection = Punctual.connect(*args, **parameters)
        try:
            connection.execute(limits)
            connection.commit()
        except BaseException:
            connection.close()
            raise
        return connection


def _in_time(
    connection: "psycopg.Connection[Any]", answers: Generator[Any, Any, T], limit_s: float
) -> Generator[Any, Any, T]:
    """Return what the server answers, and close the connection if the answer takes longer.

    Raises:
        OperationalError: the server was silent for too long; whether it did what it was asked is unknown.
    """
    until = monotonic() + limit_s
    try:
        wanted = next(answers)
        while True:
            ready = yield wanted
            if not ready and monotonic() > until:
                connection.pgconn.finish()
                msg = f"the server did not answer for {limit_s:g} s"
                raise psycopg.OperationalError(msg)
            wanted = answers.send(ready)
    except StopIteration as end:
        result: T = end.value
        return result
