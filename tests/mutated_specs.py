"""`python -m tests.mutated_specs`: specs with random errors, each accepted or refused within a second.

A mutation replaces, removes or adds a value. Some values are names of files, classes and addresses. The command exits
with 1 if any other answer came, or if an answer took too long.
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
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fastapi.testclient import TestClient

from gaplab import migrations
from gaplab.api.app import create_app
from gaplab.services.settings import Limits
from gaplab.services.store.session import Store

WITHIN_S = 1.0

FORBIDDEN_NAMES = (
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
"""Names of files, addresses, classes and code, which no spec may use."""

VALUES: tuple[Any, ...] = (
    *FORBIDDEN_NAMES,
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
VALID_SPECS = {"/experiments": EXPERIMENT, "/studies": STUDY, "/sensitivity": SENSITIVITY}


@dataclass
class Tally:
    """Answers to the mutated specs.

    Attributes:
        statuses: number of answers by HTTP status.
        wrong: answers that neither accept nor refuse.
        slowest_s: duration of the slowest answer.
        late: number of answers that took more than a second.
        seconds: total duration of all answers.
    """

    statuses: Counter[int] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    slowest_s: float = 0.0
    late: int = 0
    seconds: float = 0.0


def places(value: object) -> Iterator[tuple[Any, Any]]:
    """Yield every place inside the spec, as its container and key."""
    if isinstance(value, dict | list):
        for key in list(value) if isinstance(value, dict) else range(len(value)):
            yield value, key
            yield from places(value[key])


def mutated(spec: dict[str, Any], rng: random.Random) -> dict[str, Any]:
    """Return a copy of the spec with one to three mutations."""
    mutant = copy.deepcopy(spec)
    for _ in range(rng.randint(1, 3)):
        if not (all_places := list(places(mutant))):
            break
        parent, key = rng.choice(all_places)
        match rng.choice(("replace", "replace", "remove", "add", "swap")):
            case "replace":
                parent[key] = copy.deepcopy(rng.choice(VALUES))
            case "remove":
                del parent[key]
            case "add" if isinstance(parent, dict):
                parent[rng.choice(("options", "path", "class", "url", "name", "é", "__class__", "x" * 50))] = (
                    rng.choice(FORBIDDEN_NAMES)
                )
            case _:
                other, place = rng.choice(all_places)
                parent[key] = copy.deepcopy(other[place])
    return mutant


def measure(count: int, seed: int, api: TestClient) -> Tally:
    """Send mutated specs, in turn to each endpoint that takes one."""
    rng, tally = random.Random(seed), Tally()
    for number in range(count):
        path = list(VALID_SPECS)[number % len(VALID_SPECS)]
        body = json.dumps(mutated(VALID_SPECS[path], rng))
        began = time.perf_counter()
        answer = api.post(path, content=body, headers={"content-type": "application/json"})
        took = time.perf_counter() - began
        tally.statuses[answer.status_code] += 1
        tally.seconds += took
        tally.late += took > WITHIN_S
        tally.slowest_s = max(tally.slowest_s, took)
        refused = 400 <= answer.status_code < 500 and answer.headers["content-type"] == "application/problem+json"
        if answer.status_code != 202 and not refused:
            tally.wrong.append(f"{answer.status_code} to {body[:500]}")
    return tally


@contextmanager
def service(database_url: str | None) -> Iterator[TestClient]:
    """Serve the API on a database, by default a temporary SQLite file, with limits that no run reaches."""
    many, more = 10**9, 10**18
    limits = Limits(experiments=many, experiments_per_token=many, rollouts=more, rollouts_per_token=more)
    with TemporaryDirectory() as folder:
        url = database_url or f"sqlite:///{Path(folder) / 'mutated.db'}"
        migrations.upgrade(url)
        store = Store(url)
        yield TestClient(create_app(store, limits=limits), raise_server_exceptions=False)
        store.dispose()


def main() -> int:
    """Print the tally; return 1 if an answer was wrong or late."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--database", help="URL of an empty database; default: SQLite in a temporary folder")
    given = parser.parse_args()
    with service(given.database) as api:
        tally = measure(given.count, given.seed, api)
    statuses = ", ".join(f"{number:,} × {status}" for status, number in sorted(tally.statuses.items()))
    print(
        f"{given.count:,} mutated specs: {statuses}; wrong: {len(tally.wrong)}; "
        f"later than {WITHIN_S:g} s: {tally.late}; "
        f"slowest {tally.slowest_s:.2f} s, mean {1000 * tally.seconds / given.count:.1f} ms"
    )
    print(*tally.wrong[:10], sep="\n")
    return int(bool(tally.wrong or tally.late))


if __name__ == "__main__":
    sys.exit(main())
