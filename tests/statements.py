"""Engines that share their compiled statements: each test has a database of its own, and the same statements."""

from typing import Any

from sqlalchemy import Engine
from sqlalchemy.dialects import registry
from sqlalchemy.dialects.postgresql.psycopg import PGDialect_psycopg
from sqlalchemy.dialects.sqlite.pysqlite import SQLiteDialect_pysqlite
from sqlalchemy.util import LRUCache

_COMPILED: Any = LRUCache(2_000)
"""A compiled statement is found by its dialect and its structure."""


class _Alike:
    """Equal to every dialect of its kind: all are of the same library, with the same options."""

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other)

    def __hash__(self) -> int:
        return hash(type(self))

    @classmethod
    def engine_created(cls, engine: Engine) -> None:
        engine._compiled_cache = _COMPILED


class SQLite(_Alike, SQLiteDialect_pysqlite):
    """SQLite in tests."""

    supports_statement_cache = True


class Postgres(_Alike, PGDialect_psycopg):
    """Postgres in tests."""

    supports_statement_cache = True


def share() -> None:
    """Let the engines that this process makes from now on share their statements."""
    registry.register("sqlite", __name__, SQLite.__name__)
    registry.register("postgresql.psycopg", __name__, Postgres.__name__)
