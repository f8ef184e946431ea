"""`python -m tests.mutated_specs`: specs with random mistakes; each is taken or refused, and each within a second.

A mutation puts a value where it does not belong, removes one, or adds one; among the values are the names of files,
classes and addresses. Exits with 1 if one was answered otherwise, or too late.
"""

import argparse
import copy
import json
import random
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fastapi.testclient import TestClient

from gaplab import migrations
from gaplab.api.app import create_app
from gaplab.services.settings import Limits
from gaplab.services.store.session import Store

WITHIN_S = 1.0

OUTSIDE = (
    "/etc/passwd",
    "../../../etc/passwd",
    "file:///etc/passwd",
    "http://127.0.0.1:9/plugin.py",
    "gaplab.services.engines.pybullet.engine:PyBullet",
    "gaplab.services.store.session.Store",
    "os.system",
    "__import__('os').system('id')",
    "services/engines/analytic.py",
    "${HOME}",
    "{{7*7}}",
    "'; DROP TABLE experiment; --",
)
"""What a spec cannot name: files, addresses, classes, code."""

VALUES: tuple[Any, ...] = (
    *OUTSIDE,
    *(
        None,
        True,
        False,
        0,
        -1,
        1,
        2,
        7,
        10**6,
        10**9,
        2**63,
        2**64,
        10**400,
        0.5,
        -0.0,
        1e308,
        float("nan"),
        float("inf"),
    ),
    *("", " ", "\0", "é" * 300, "x" * 100_000, "\ud800", "pybullet", "quadruped", "direct", "random", "paper"),
    *([], {}, [[]], ["random"] * 101, {"name": "random"}, {"name": {"name": "random"}}, [None], {"options": {}}),
)

EXPERIMENT: dict[str, Any] = {
    "name": "whole",
    "strategy": {"name": "simulated_fit_and_informative", "options": {"simulators": 5, "fit_weight": 1.0}},
    "iterations": 2,
    "repetitions": 2,
    "robot": {"name": "toy_function", "options": {}},
    "engine": {"name": "analytic", "options": {}},
    "optimizer": {"name": "steady_state", "options": {"population": 10, "mutation_scale": 0.3}},
    "tunables": ["restitution", {"name": "static_friction", "lower": 0.0, "upper": 1.5}],
    "reality": {"engine": "analytic", "parameters": {"static_friction": 1.0}},
    "budget": {"preset": "smoke", "controller_evaluations": 60},
    "seed": 3,
}
STUDY = {name: value for name, value in EXPERIMENT.items() if name != "strategy"} | {
    "strategies": ["random", EXPERIMENT["strategy"], "direct"],
    "direct_repetitions": 3,
}
SENSITIVITY = {name: value for name, value in EXPERIMENT.items() if name not in {"name", "strategy"}} | {"points": 9}
WHOLE = {"/experiments": EXPERIMENT, "/studies": STUDY, "/sensitivity": SENSITIVITY}


@dataclass
class Found:
    """How the specs were answered.

    Attributes:
        statuses: how often each.
        wrong: what was answered otherwise than it must be.
        slowest_s: the longest answer.
        late: answers that took more than a second.
        seconds: of all answers.
    """

    statuses: Counter[int] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    slowest_s: float = 0.0
    late: int = 0
    seconds: float = 0.0


def places(value: object) -> Iterator[tuple[Any, Any]]:
    """Every place inside the spec: what holds it, and its key there."""
    if isinstance(value, dict | list):
        for key in list(value) if isinstance(value, dict) else range(len(value)):
            yield value, key
            yield from places(value[key])


def mutated(spec: dict[str, Any], rng: random.Random) -> dict[str, Any]:
    """The spec with one to three mutations."""
    found = copy.deepcopy(spec)
    for _ in range(rng.randint(1, 3)):
        if not (found_places := list(places(found))):
            break
        parent, key = rng.choice(found_places)
        match rng.choice(("replace", "replace", "remove", "add", "swap")):
            case "replace":
                parent[key] = copy.deepcopy(rng.choice(VALUES))
            case "remove":
                del parent[key]
            case "add" if isinstance(parent, dict):
                parent[rng.choice(("options", "path", "class", "url", "name", "é", "__class__", "x" * 50))] = (
                    rng.choice(OUTSIDE)
                )
            case _:
                other, place = rng.choice(found_places)
                parent[key] = copy.deepcopy(other[place])
    return found


def measure(count: int, seed: int, api: TestClient) -> Found:
    """Send so many mutated specs, in turn to each endpoint that takes one."""
    rng, found = random.Random(seed), Found()
    for number in range(count):
        path = list(WHOLE)[number % len(WHOLE)]
        body = json.dumps(mutated(WHOLE[path], rng))
        began = time.perf_counter()
        answer = api.post(path, content=body, headers={"content-type": "application/json"})
        took = time.perf_counter() - began
        found.statuses[answer.status_code] += 1
        found.seconds += took
        found.late += took > WITHIN_S
        found.slowest_s = max(found.slowest_s, took)
        refused = 400 <= answer.status_code < 500 and answer.headers["content-type"] == "application/problem+json"
        if answer.status_code != 202 and not refused:
            found.wrong.append(f"{answer.status_code} to {body[:500]}")
    return found


@contextmanager
def service(database_url: str | None) -> Iterator[TestClient]:
    """The API over a database, by default a SQLite file that goes away; room for all that is accepted."""
    room = replace(Limits(), experiments=10**9, experiments_per_token=10**9, rollouts=10**18, rollouts_per_token=10**18)  # type: ignore[type-var]
    with TemporaryDirectory() as folder:
        url = database_url or f"sqlite:///{Path(folder) / 'mutated.db'}"
        migrations.upgrade(url)
        store = Store(url)
        yield TestClient(create_app(store, limits=room), raise_server_exceptions=False)
        store.dispose()


def main() -> int:
    """Print the figure; 1 if it is not as it must be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--database", help="URL of an empty database; left out: SQLite in a temporary folder")
    given = parser.parse_args()
    with service(given.database) as api:
        found = measure(given.count, given.seed, api)
    statuses = ", ".join(f"{number:,} × {status}" for status, number in sorted(found.statuses.items()))
    print(
        f"{given.count:,} mutated specs: {statuses}; otherwise: {len(found.wrong)}; "
        f"later than {WITHIN_S:g} s: {found.late}; "
        f"slowest {found.slowest_s:.2f} s, mean {1000 * found.seconds / given.count:.1f} ms"
    )
    print(*found.wrong[:10], sep="\n")
    return int(bool(found.wrong or found.late))


if __name__ == "__main__":
    sys.exit(main())
