"""Connections to Postgres that die silently, behind a proxy that accepts bytes and forwards none."""

import socket
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from sqlalchemy import make_url, text

from gaplab.services.store import engine as connections
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.engine import open_engine
from gaplab.services.store.session import Store
from tests.conftest import Postgres
from tests.postgres import PORT
from tests.proxy import Proxy

ANSWER_S = 0.5


@pytest.fixture
def proxied(postgres: Postgres) -> Iterator[tuple[Proxy, str]]:
    """A proxy, and the URL of a database at head behind it."""
    with postgres.database("template") as url:
        parsed = make_url(url)
        proxy = Proxy(f"{parsed.query['host']}/.s.PGSQL.{PORT}")
        yield proxy, f"postgresql://postgres@127.0.0.1:{proxy.port}/{parsed.database}"
        proxy.close()


def execute_twice(store: Store, statement: Any, between: Callable[[], None]) -> None:
    """Execute a statement twice in one transaction."""
    with store.transaction() as session:
        session.execute(statement)
        between()
        session.execute(statement)


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "CONNECT_S", 2)


def test_a_connection_that_says_nothing_is_given_up_and_the_next_use_has_a_new_one(proxied: tuple[Proxy, str]) -> None:
    proxy, url = proxied
    store = Store(url, answer_s=ANSWER_S)
    with pytest.raises(StoreUnavailable, match="did not answer"):
        execute_twice(store, text("SELECT 1"), proxy.hang)

    store.check()
    store.dispose()


def test_an_idle_connection_that_died_is_replaced_without_an_error(proxied: tuple[Proxy, str]) -> None:
    proxy, url = proxied
    store = Store(url, answer_s=ANSWER_S)
    store.check()

    proxy.hang()
    store.check()

    assert store.errors == 0
    store.dispose()


def test_a_statement_that_takes_too_long_is_ended_by_the_server(postgres_store: Store, postgres: Postgres) -> None:
    with postgres.database("template") as url:
        store = Store(url, answer_s=ANSWER_S)
        with pytest.raises(StoreUnavailable, match="statement timeout"), store.reading() as session:
            session.execute(text("SELECT pg_sleep(60)"))
        store.check()
        store.dispose()


def test_a_wait_for_a_lock_ends_too(postgres: Postgres) -> None:
    with postgres.database("template") as url:
        holder, waiter = Store(url), Store(url, answer_s=ANSWER_S)
        lock = text("LOCK TABLE supervisor IN ACCESS EXCLUSIVE MODE")
        with holder.transaction() as session:
            session.execute(lock)
            with pytest.raises(StoreUnavailable, match="statement timeout"), waiter.transaction() as other:
                other.execute(lock)
        with waiter.transaction() as other:
            other.execute(lock)
        holder.dispose()
        waiter.dispose()


def test_a_migration_may_take_longer_than_any_statement_of_the_service(postgres: Postgres) -> None:
    with postgres.database() as url:
        engine = open_engine(url, enforce_foreign_keys=False)
        with engine.connect() as connection:
            limit = connection.execute(text("SHOW statement_timeout")).scalar_one()
            kept_alive = connection.execute(text("SHOW tcp_keepalives_idle")).scalar_one()
        engine.dispose()

    assert limit == "0"
    assert kept_alive is not None


def test_every_connection_asks_the_kernel_to_look_for_a_dead_peer(proxied: tuple[Proxy, str]) -> None:
    _, url = proxied
    store = Store(url)
    with store.reading() as session:
        driver: Any = session.connection().connection.driver_connection
        of_kernel = socket.socket(fileno=driver.fileno())
        try:
            found = [
                of_kernel.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE),
                of_kernel.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE),
                of_kernel.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT),
            ]
        finally:
            of_kernel.detach()
    store.dispose()

    assert found == [1, 10, 20_000]


def test_a_transaction_whose_client_stands_still_is_ended_and_its_locks_are_free(
    postgres: Postgres, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "SILENT_TRANSACTION_S", 1)
    with postgres.database("template") as url:
        silent, other = Store(url), Store(url)
        lock = text("LOCK TABLE supervisor IN ACCESS EXCLUSIVE MODE")

        def wait_for_it() -> None:
            other.write(lambda session: session.execute(lock))
            time.sleep(0.1)

        with pytest.raises(StoreUnavailable, match="idle-in-transaction"):
            execute_twice(silent, lock, wait_for_it)
        silent.dispose()
        other.dispose()
