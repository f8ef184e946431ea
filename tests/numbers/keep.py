"""Writes the kept archives again: `python -m tests.numbers.keep`.

Do this only in a change whose CHANGELOG entry announces that the same spec and seed give other numbers from then on,
for instance with a corrected formula or another version of an engine. If a test in this folder fails and no such entry
is meant, the code is wrong, and not the archives. Run it on a clean checkout: archives name their commit.
"""

import json
import lzma
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from gaplab import migrations
from gaplab.services.archives import export
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import submission
from gaplab.services.results import curves
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.store.lease import Checkpoint, Pulse, TimedStep
from gaplab.services.store.session import Store
from gaplab.workers.checkpoints import recorded
from tests.experiments import submit_one
from tests.numbers.kept_numbers import CURVES, FOLDER, HALF_WAY, MACHINE, machine
from tests.numbers.specs import HALF_WAY as HALF_WAY_SPEC
from tests.numbers.specs import STUDIES

OWNER = "kept"
STEPS, CHECKPOINTS = 6, 3
"""The kept database has these many steps of repetition 0, and these many checkpoints of the step after them."""


def keep(folder: Path) -> None:
    """Compute all studies and write their archives and curves, a database that is half-way, and the machine."""
    folder.mkdir(exist_ok=True)
    shown = {}
    for name, spec in STUDIES.items():
        with TemporaryDirectory() as place:
            data, shown[name] = computed(new_store(Path(place) / "kept.db"), spec)
            (folder / f"{name}.zip").write_bytes(data)
    (folder / CURVES.name).write_text(json.dumps(shown) + "\n")
    with TemporaryDirectory() as place:
        database = Path(place) / "kept.db"
        interrupt(new_store(database))
        (folder / HALF_WAY.name).write_bytes(lzma.compress(database.read_bytes(), preset=9 | lzma.PRESET_EXTREME))
    (folder / MACHINE.name).write_text(json.dumps(machine(), indent=2) + "\n")


def new_store(file: Any) -> Any:
    """An empty database at head."""
    migrations.upgrade(f"sqlite:///{file}")
    return Store(f"sqlite:///{file}")


def computed(store: Store, spec: Any) -> Any:
    """The archive of a study, computed by the pure loop, and its curves."""
    study = submission.submit(store, spec).id
    while claims := execution.claim(store, OWNER, 100):
        for claim in claims:
            for step in repetition(setting(claim.spec, claim.number)):
                assert execution.record(store, claim, step)
            assert execution.complete(store, claim)
    with export(store, study).file as file:
        data = file.read()
    shown = [each.model_dump(mode="json") for each in curves.curves(store, [study])]
    store.dispose()
    return data, shown


def interrupt(store: Store) -> None:
    """Leave `HALF_WAY_SPEC` as a supervisor leaves it that is killed in the middle of a step."""
    submit_one(store, HALF_WAY_SPEC)
    claim, *_ = execution.claim(store, OWNER, 2)
    delivered, steps, checkpoints = recorded(setting(claim.spec, claim.number), (), (), 0.02), 0, 0
    for item in delivered:
        if isinstance(item, Pulse):
            continue
        steps += isinstance(item, TimedStep)
        checkpoints += isinstance(item, Checkpoint) and item.step == STEPS
        assert steps <= STEPS, "the step ended before its checkpoints"
        assert execution.record_all(store, [(claim, (item,))])
        if checkpoints == CHECKPOINTS:
            break
    delivered.close()  # type: ignore[attr-defined]
    store.dispose()


if __name__ == "__main__":
    keep(FOLDER)
    sys.stdout.write(f"kept {len(STUDIES)} archives in {FOLDER}\n")
