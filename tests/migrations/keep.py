"""Keeps a database of the present revision: `python -m tests.migrations.keep`, whenever a revision is released.

The file holds what a user of this revision may have: an experiment that is complete, and one half-way whose supervisor
is gone, in the middle of an iteration. `test_kept.py` upgrades every kept file to head and goes on computing.
"""

import lzma
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from gaplab import migrations
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import submission
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.store.models import REVISION
from gaplab.services.store.session import Store

FOLDER = Path(__file__).parent / "kept"

SPECS = {
    name: ExperimentSpec.model_validate(
        {
            "name": name,
            "strategy": "simulated_fit_and_informative",
            "robot": "toy_function",
            "iterations": 2,
            "repetitions": 2,
            "tunables": ["static_friction", "dynamic_friction"],
            "budget": "smoke",
            "seed": seed,
        }
    )
    for seed, name in enumerate(("complete", "half-way"))
}

STEPS_HALF_WAY = {0: 4, 1: 0}
"""Of each repetition: the first has selected and measured in iteration 1, the second was claimed and has nothing."""


def keep(file: Path) -> None:
    """Make the database of the present revision and compress it into the file.

    Raises:
        FileExistsError: this revision is kept; a kept file is never made anew by later code.
    """
    with TemporaryDirectory() as folder:
        database = Path(folder) / "kept.db"
        _fill(f"sqlite:///{database}")
        file.parent.mkdir(exist_ok=True)
        with file.open("xb") as kept:
            kept.write(lzma.compress(database.read_bytes(), preset=9 | lzma.PRESET_EXTREME))


def _fill(url: str) -> None:
    migrations.upgrade(url)
    store = Store(url)
    for name, spec in SPECS.items():
        submission.submit_experiment(store, spec)
        for claim in execution.claim(store, "the supervisor that is gone", 2):
            steps = list(repetition(setting(claim.spec, claim.number)))
            wanted = len(steps) if name == "complete" else STEPS_HALF_WAY[claim.number]
            for step in steps[:wanted]:
                execution.record(store, claim, step, seconds=0.25)
            if name == "complete":
                execution.complete(store, claim)
    store.dispose()


if __name__ == "__main__":
    keep(FOLDER / f"{REVISION}.db.xz")
    sys.stdout.write(f"kept revision {REVISION} in {FOLDER}\n")
