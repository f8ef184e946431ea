"""Duration of reading the stored curves of the paper's Fig. 4 over HTTP."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter, sleep

import httpx2
import uvicorn

from benchmarks.measure import Row
from gaplab import migrations
from gaplab.api.app import create_app
from gaplab.schemas.spec import StudySpec
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import submission
from gaplab.services.running import execution
from gaplab.services.running.execution import TimedStep
from gaplab.services.specs.assembly import setting
from gaplab.services.store.session import Store

CALLS = 200
SPEC = StudySpec.model_validate(
    {
        "robot": "toy_function",
        "iterations": 10,
        "repetitions": 40,
        "budget": {"controller_evaluations": 20, "selection_evaluations": 20, "simulator_evaluations": 20},
    }
)
"""A study with as many rows as the paper's, at the smallest budgets."""


def fill(store: Store) -> str:
    """Store a finished study of seven experiments × 40 repetitions × 10 iterations; return its id."""
    study = submission.submit_study(store, SPEC).id
    while claims := execution.claim(store, "benchmark", 40):
        for claim in claims:
            steps = [TimedStep(step, 0.0) for step in repetition(setting(claim.spec, claim.number))]
            execution.record_all(store, [(claim, steps)])
            execution.complete(store, claim)
    return study


@contextmanager
def served(store: Store) -> Iterator[str]:
    """Serve the API on a free port of loopback; yield its address."""
    server = uvicorn.Server(uvicorn.Config(create_app(store), port=0, log_level="error"))
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        sleep(0.05)
    port = server.servers[0].sockets[0].getsockname()[1]
    yield f"http://127.0.0.1:{port}"
    server.should_exit = True
    thread.join()


def rows() -> list[Row]:
    """Measure the median and the longest duration of many calls."""
    with TemporaryDirectory() as folder:
        url = f"sqlite:///{Path(folder) / 'bench.db'}"
        migrations.upgrade(url)
        store = Store(url)
        study = fill(store)
        seconds = []
        with served(store) as address, httpx2.Client(base_url=address) as client:
            for _ in range(CALLS):
                begun = perf_counter()
                client.get(f"/studies/{study}/curves").raise_for_status()
                seconds.append(perf_counter() - begun)
        store.dispose()
    value = f"median {1e3 * median(seconds):.1f} ms, longest {1e3 * max(seconds):.1f} ms"
    return [Row(f"GET /studies/{{id}}/curves, 7 × 40 × 10 stored, {CALLS} calls", value)]
