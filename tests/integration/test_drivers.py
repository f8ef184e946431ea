"""`gaplab drive` with drivers that do what they must not: nothing of it is sent, and the robot is stopped."""

from pathlib import Path

import pytest

from gaplab.services.store.session import Store
from tests.commands import Gaplab
from tests.integration.test_bench import pending
from tests.integration.test_bench_safety import ask, submit


@pytest.mark.parametrize(
    ("run", "said"),
    [
        ("return 'fast'", "it must return the fitness"),
        ("return float('nan')", "raise MeasurementFailed"),
        ("1/0", "ZeroDivisionError"),
        ("self.stopped.wait()", "took more than 0.5 s"),
    ],
)
def test_a_driver_that_answers_nonsense_or_nothing_is_stopped_and_sends_nothing(
    sqlite_store: Store, gaplab: Gaplab, tmp_path: Path, run: str, said: str
) -> None:
    id_ = submit(sqlite_store, "warn")
    ask(sqlite_store)
    driver = tmp_path / "driver.py"
    driver.write_text(
        "import threading\n"
        "class Driver:\n"
        "    stopped = threading.Event()\n"
        "    def connect(self): pass\n"
        f"    def run(self, motion): {run}\n"
        "    def stop(self):\n"
        "        print('stopped', flush=True)\n"
        "        self.stopped.set()\n"
    )

    driven = gaplab("drive", id_, "--driver", str(driver), "--limit-s", "0.5")

    assert driven.code == 1
    assert said in driven.err
    assert "stopped" in driven.out
    (request,) = pending(sqlite_store)
    assert (request.state, request.answers) == ("open", ())
