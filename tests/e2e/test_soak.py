"""A small soak: random faults on the real service, on SQLite and on Postgres; `make soak` runs a thousand."""

from pathlib import Path
from typing import Any

import pytest

from tests.soak.databases import Postgres, Sqlite
from tests.soak.soak import soak


@pytest.mark.parametrize(("kind", "number"), [(Sqlite, 12), (Postgres, 13)], ids=["sqlite", "postgres"])
def test_under_random_faults_it_keeps_its_word(tmp_path: Path, kind: Any, number: Any) -> None:
    said: list[Any] = []

    outcome = soak(tmp_path, kind, number, seed=1, at_once=8, say=said.append)

    assert outcome.violations == [], "\n".join(said)
    assert outcome.faults == number
    assert outcome.acknowledged > 0
