"""A small soak: random faults on the real service, on SQLite and on Postgres; `make soak` runs a thousand.

What its checker finds is tested with every change, in tests/unit/test_soak_checker.py.
"""

from pathlib import Path
from typing import Any

import pytest

from tests.soak.databases import Postgres, Sqlite
from tests.soak.soak import soak

pytestmark = pytest.mark.release

FAULTS = 8


@pytest.mark.parametrize("kind", [Sqlite, Postgres])
def test_under_random_faults_it_keeps_its_word(tmp_path: Path, kind: Any) -> None:
    said: list[Any] = []

    outcome = soak(tmp_path, kind, FAULTS, seed=1, at_once=8, say=said.append)

    assert outcome.violations == [], "\n".join(said)
    assert outcome.faults == FAULTS
    assert outcome.acknowledged > 0
