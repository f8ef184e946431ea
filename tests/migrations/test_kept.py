"""A database that any released revision left behind upgrades to head and goes on computing, to the same numbers."""

import lzma
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from alembic.script import ScriptDirectory

from gaplab import migrations
from gaplab.schemas.lifecycle import State
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import listing, reading, submission
from gaplab.services.results import curves
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.store.session import Store
from tests.migrations.keep import FOLDER, SPECS, keep
from tests.numbers.kept_numbers import other_machine

KEPT = sorted(FOLDER.glob("*.db.xz"))


@pytest.fixture(params=KEPT, ids=lambda file: file.name)
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Any]:
    """What the revision left behind, upgraded."""
    file = tmp_path / "kept.db"
    file.write_bytes(lzma.decompress(request.param.read_bytes()))
    migrations.upgrade(f"sqlite:///{file}")
    store = Store(f"sqlite:///{file}")
    yield store
    store.dispose()


def compute(store: Store) -> None:
    """What a supervisor does, until nothing is queued."""
    while claims := execution.claim(store, "me", 4):
        for claim in claims:
            for step in repetition(setting(claim.spec, claim.number), claim.log):
                assert execution.record(store, claim, step, seconds=0.25)
            assert execution.complete(store, claim)


def numbers(store: Store, experiment: Any) -> Any:
    """Every number that the experiment found, but for when and by whom it was found."""
    samples = reading.list_samples(store, experiment).items
    return (
        [each.model_dump(exclude={"measured_at"}) for each in samples],
        reading.list_simulators(store, experiment).items,
        curves.curve(store, experiment).points,
        [each.rollouts_done for each in reading.list_repetitions(store, experiment)],
    )


def test_it_goes_on_to_the_same_end_as_a_run_that_never_stopped(store: Store) -> None:
    kept = {each.name: each for each in listing.list_experiments(store).items}
    before = numbers(store, kept["complete"].id)
    assert kept["complete"].state is State.COMPLETED
    assert kept["half-way"].state is State.RUNNING
    assert set(kept) == set(SPECS)

    assert execution.requeue_lost(store, stale_after_s=-1) == 2
    fresh = {name: submission.submit_experiment(store, stored(store, each.id)).id for name, each in kept.items()}
    compute(store)

    assert numbers(store, kept["complete"].id) == before
    if numbers(store, fresh["complete"]) != before and (other := other_machine()):
        pytest.skip(f"the numbers differ, and so does the machine: {other}")
    for name, again in fresh.items():
        assert reading.read_experiment(store, kept[name].id).state is State.COMPLETED
        assert numbers(store, kept[name].id) == numbers(store, again)


def stored(store: Store, experiment: Any) -> Any:
    """The spec with nothing hidden, as the repetitions of the experiment have it."""
    spec = reading.read_experiment(store, experiment).spec
    truth = {"static_friction": 1.0, "dynamic_friction": 0.8}
    return ExperimentSpec.model_validate(spec | {"reality": spec["reality"] | {"parameters": truth}})


def test_a_kept_file_is_of_a_revision_that_there_is_and_small() -> None:
    revisions = {each.revision for each in ScriptDirectory.from_config(migrations.configuration()).walk_revisions()}

    assert {"0001", "0002"} <= {file.name.removesuffix(".db.xz") for file in KEPT} <= revisions
    assert all(file.stat().st_size < 100_000 for file in KEPT)


def test_a_revision_is_kept_once(tmp_path: Path) -> None:
    keep(tmp_path / "head.db.xz")

    with pytest.raises(FileExistsError):
        keep(tmp_path / "head.db.xz")
