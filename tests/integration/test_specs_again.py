"""What was submitted can be submitted again: from the service, from an archive, and with the same bits."""

import json
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest
from fastapi.testclient import TestClient
from pydantic import TypeAdapter

from gaplab.api.app import create_app
from gaplab.arithmetic import chosen, has
from gaplab.schemas.archives import RepetitionRerun
from gaplab.schemas.editing import Edit
from gaplab.schemas.spec import AnySpec, ExperimentSpec, StudySpec
from gaplab.services.archives import export, rerunning
from gaplab.services.archives.rerunning import Recorded, difference, rerun, rerun_all, result_of, submitted_spec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import Conflict
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Measured, Probed
from gaplab.services.experiments import editing, submission
from gaplab.services.experiments.reading import read_spec
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve, resolve_experiment
from gaplab.services.specs.submitted import COMPLETE, to_submit_again
from gaplab.services.store.session import Store
from tests.commands import Gaplab
from tests.experiments import run, toy
from tests.numbers.kept_numbers import FOLDER

EXAMPLES = Path(__file__).parents[2] / "examples"
QUITTER = """
from gaplab.services.world.robots.toy_function import ToyFunction


class Quitter(ToyFunction):
    name = "quitter"

    def motion(self, genome):
        raise SystemExit(3)
"""
DIES = """
import os
import signal

from gaplab.services.world.robots.toy_function import ToyFunction


class Dies(ToyFunction):
    name = "dies"

    def motion(self, genome):
        os.kill(os.getpid(), signal.SIGKILL)
"""
LINGERING = """
from multiprocessing import parent_process
from threading import Event, Thread

from gaplab.services.world.robots.toy_function import ToyFunction

if parent_process():
    Thread(target=Event().wait).start()


class Lingering(ToyFunction):
    name = "lingering"
"""
SMALL = {"strategies": ["simulated_fit", "direct"], "robot": "toy_function", "budget": "smoke", "seed": 2**63}
SHARED = ("robot", "budget", "seed")
ANY: TypeAdapter[Any] = TypeAdapter(AnySpec)


def stored(spec: dict[str, object]) -> list[dict[str, object]]:
    return [each.model_dump(mode="json") for each in resolve(StudySpec.model_validate(spec))]


def exported(store: Store, study: str) -> bytes:
    with export(store, study).file as archive:
        return archive.read()


def compute(store: Store) -> None:
    """Compute whatever is queued."""
    while claims := execution.claim(store, "test", limit=10):
        for claim in claims:
            run(store, claim, repetition(setting(claim.spec, claim.number)))


@pytest.mark.parametrize("name", ["figure_4", "quadruped", "smoke", "toy", "tunables", "weights"])
def test_the_spec_of_a_study_is_the_submitted_one_and_gives_the_same(name: str, sqlite_store: Store) -> None:
    given = json.loads((EXAMPLES / f"{name}.json").read_text())
    spec: ExperimentSpec | StudySpec = ANY.validate_python(given)
    study = submission.submit(sqlite_store, spec)

    found = read_spec(sqlite_store, study.id, reveal=True)

    assert found.spec is not None
    assert found.remarks == ()
    assert given.items() <= found.spec.items()
    assert found.spec.keys() - given.keys() <= {"engine", "strategies"}
    assert resolve(ANY.validate_python(found.spec)) == resolve(spec)


def test_a_spec_that_is_not_known_or_gives_something_else_here_has_every_field() -> None:
    wanted = stored(SMALL)

    unusable: list[dict[str, Any] | None] = [None, SMALL | {"seed": 5}, {"strategies": []}]
    for given in unusable:
        found = to_submit_again("study", given, wanted)

        assert found.spec is not None
        assert found.remarks == (COMPLETE,)
        assert stored(found.spec) == wanted


def test_one_of_several_experiments_has_a_spec_of_its_own(sqlite_store: Store) -> None:
    study = submission.submit(sqlite_store, StudySpec.model_validate(SMALL | {"direct_repetitions": 3}))

    fit, direct = (read_spec(sqlite_store, each.id, reveal=True).spec for each in study.experiments)

    assert fit == {"strategy": "simulated_fit", "engine": "analytic"} | {name: SMALL[name] for name in SHARED}
    assert direct == fit | {"strategy": "direct", "repetitions": 3}


def test_the_schedule_and_a_new_name_change_no_spec_but_its_name(sqlite_store: Store) -> None:
    study = submission.submit(sqlite_store, StudySpec.model_validate(SMALL | {"priority": 3}))
    editing.edit(sqlite_store, study.id, Edit(name="again"), starting_from=None)

    found = read_spec(sqlite_store, study.id, reveal=True)

    assert found.spec == SMALL | {"engine": "analytic", "name": "again"}


def test_a_study_whose_experiments_were_extended_has_the_size_that_all_have() -> None:
    experiments = stored(SMALL | {"repetitions": 3})

    one = to_submit_again("study", SMALL, [experiments[0] | {"repetitions": 9}, experiments[1]])
    all_ = to_submit_again("study", SMALL, [each | {"repetitions": 9} for each in experiments])

    assert one.spec == SMALL | {"repetitions": 9, "direct_repetitions": 3}
    assert all_.spec == SMALL | {"repetitions": 9}
    assert (one.remarks, all_.remarks) == ((), ())


def test_experiments_that_differ_in_more_than_strategy_have_no_single_spec() -> None:
    one, other = stored(SMALL)

    found = to_submit_again("mixed", None, [one, other | {"seed": 5}])

    assert found.spec is None
    assert "differ in more than their strategies" in found.remarks[0]


def test_hidden_parameters_are_in_no_spec_until_the_experiment_has_ended(sqlite_store: Store) -> None:
    spec = {**SMALL, "reality": {"parameters": {"static_friction": 0.77}}, "tunables": ["static_friction"]}
    study = submission.submit(sqlite_store, StudySpec.model_validate(spec))

    with TestClient(create_app(sqlite_store), base_url="http://localhost") as api:
        before = api.get(f"/studies/{study.id}/spec")
        archive = BytesIO(exported(sqlite_store, study.id))
        compute(sqlite_store)
        after = api.get(f"/studies/{study.id}/spec").json()
        one = api.get(f"/studies/{study.experiments[0].id}/spec").json()

    assert "0.77" not in before.text
    with ZipFile(archive) as members:
        assert b"0.77" not in members.read("study.sqlite3")
    assert "static_friction are hidden until" in before.json()["remarks"][0]
    assert after["spec"]["reality"] == {"parameters": {"static_friction": 0.77}}
    assert after["remarks"] == []
    assert one["spec"]["strategy"] == "simulated_fit"
    with pytest.raises(Conflict, match="hides parameters of reality"):
        submitted_spec(archive)


@pytest.mark.release
def test_an_archive_has_the_spec_and_is_verified_to_the_last_bit(
    gaplab: Gaplab, sqlite_store: Store, tmp_path: Path
) -> None:
    study = submission.submit(sqlite_store, StudySpec.model_validate(SMALL | {"repetitions": 1}))
    compute(sqlite_store)
    file = tmp_path / "a.zip"
    file.write_bytes(exported(sqlite_store, study.id))

    said, document = gaplab("rerun", str(file), "--verify"), gaplab("rerun", str(file), "--verify", "--json")
    again = gaplab("rerun", str(file))

    assert said.code == document.code == again.code == 0
    assert "2 of 2 repetitions have the same bits." in said.out
    assert json.loads(document.out)["same"] == 2
    spec, before = (json.loads(gaplab("spec", id_).out) for id_ in (again.out.strip(), study.id))
    assert spec == before
    assert stored(spec) == stored(SMALL | {"repetitions": 1})


@pytest.mark.release
@pytest.mark.skipif(not has("avx2"), reason="no code is chosen on such a processor")
def test_code_that_an_archive_does_not_name_is_named(gaplab: Gaplab) -> None:
    said = gaplab("rerun", str(FOLDER / "cma_es.zip"), "--verify", "--repetitions", "1")

    assert said.code == 0
    assert f"OPENBLAS_CORETYPE: none in the archive, {chosen()['OPENBLAS_CORETYPE']} here" in said.out


def test_what_differs_is_tried_again_with_the_code_for_avx512_which_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a processor that has it, as a fake says; the one of two repetitions whose number is odd needs it."""

    def computed(recorded: Sequence[Recorded], _: int | None) -> Iterator[RepetitionRerun]:
        other = os.environ["OPENBLAS_CORETYPE"] == "SkylakeX"
        for each in recorded:
            yield result_of(each, "same" if other == bool(each.number % 2) else "different", 3, None)

    monkeypatch.setattr(rerunning, "has", lambda _: True)
    monkeypatch.setattr(rerunning, "rerun_all", computed)
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Haswell")
    with (FOLDER / "cma_es.zip").open("rb") as file:
        found = rerunning.verify(file)

    assert found.different == 0
    assert {(each.repetition % 2, each.code) for each in found.repetitions} == {(0, None), (1, "AVX-512")}
    assert os.environ["OPENBLAS_CORETYPE"] == "Haswell"


def test_the_first_step_that_differs_is_named() -> None:
    spec = resolve_experiment(toy())
    log = tuple(repetition(setting(spec, 0)))
    place = next(index for index, step in enumerate(log) if isinstance(step, Measured))
    measured = log[place]
    assert isinstance(measured, Measured)
    sample = measured.sample
    changed = Measured(1, replace(sample, fitness=sample.fitness * (1 + 2**-52)))
    recorded = Recorded("x", "x", 0, spec.model_dump(mode="json"), (*log[:place], changed, *log[place + 1 :]))

    same, different = rerun(replace(recorded, log=log)), rerun(recorded)
    longer = rerun(replace(recorded, log=(*log, log[-1])))

    assert (same.outcome, same.steps) == ("same", len(log))
    assert (different.outcome, different.steps) == ("different", place)
    assert different.reason is not None
    assert different.reason.startswith(f"step {place + 1} (measured, iteration 1): sample.fitness is ")
    assert (longer.outcome, longer.reason) == ("different", f"it ends here after {len(log)} steps")


def test_what_cannot_be_computed_says_why() -> None:
    spec = resolve_experiment(toy()).model_dump(mode="json")
    hidden = spec | {"reality": {**spec["reality"], "parameters": {"static_friction": None}}}
    gone = spec | {"engine": {"name": "fluid", "options": {}}}

    reasons = [rerun(Recorded("x", "x", 0, each, ())).reason for each in (hidden, gone)]

    assert reasons == ["the archive hides parameters of reality", "the engine 'fluid' is not installed here"]


@pytest.mark.parametrize(
    ("changes", "error"),
    [({"engine": None}, "ValidationError"), ({"robot": {"name": "quitter", "options": {}}}, "SystemExit")],
)
def test_an_error_of_one_repetition_is_its_reason_and_ends_no_other(
    put: Callable[..., Path], changes: dict[str, object], error: str
) -> None:
    put(quitter=QUITTER)
    spec = resolve_experiment(toy())
    log = tuple(repetition(setting(spec, 0)))

    found = rerun(Recorded("x", "x", 0, spec.model_dump(mode="json") | changes, log))

    assert found.outcome == "not computed"
    assert str(found.reason).startswith(f"{error}: ")


@pytest.mark.release
def test_a_process_that_dies_is_the_reason_of_its_repetition_and_ends_no_other(
    put: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GAPLAB_PLUGINS", str(put(dies=DIES)))
    spec = resolve_experiment(toy())
    whole = Recorded("x", "x", 0, spec.model_dump(mode="json"), tuple(repetition(setting(spec, 0))))
    deadly = replace(whole, spec={**whole.spec, "robot": {"name": "dies", "options": {}}})

    found = list(rerun_all([whole, deadly, replace(whole, number=1)], cores=1))

    assert [(each.outcome, each.repetition) for each in found] == [("same", 0), ("not computed", 0), ("different", 1)]
    assert found[1].reason == "its process died: it was killed, or ran out of memory"


def test_a_thread_of_a_plug_in_keeps_no_process_that_recomputes(
    put: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GAPLAB_PLUGINS", str(put(lingering=LINGERING)))
    spec = resolve_experiment(toy(robot="lingering"))
    whole = Recorded("x", "x", 0, spec.model_dump(mode="json"), tuple(repetition(setting(spec, 0))))

    assert [each.outcome for each in rerun_all([whole], cores=1)] == ["same"]


def test_zeros_of_both_signs_differ_and_nan_is_nan() -> None:
    assert difference(Probed(1, 0.0, 1.0), Probed(1, -0.0, 1.0)) == "fitness is -0.0 here, and 0.0 in the archive"
    assert difference(Probed(1, float("nan"), 1.0), Probed(1, float("nan"), 1.0)) is None


def test_readings_and_repeats_are_compared_and_so_is_their_absence() -> None:
    bare, sensed = Probed(1, 0.5, 1.0), Probed(1, 0.5, 1.0, readings=frozen([16.0, -4.0]))
    other = Probed(1, 0.5, 1.0, readings=frozen([16.0, -4.5]))

    assert difference(sensed, other) == "readings[1] is -4.5 here, and -4.0 in the archive"
    assert difference(bare, sensed) == "readings[0] is 16.0 here, and absent in the archive"
    assert difference(sensed, bare) == "readings[0] is absent here, and 16.0 in the archive"
    assert difference(replace(bare, repeats=frozen([0.5])), bare) == (
        "repeats[0] is absent here, and 0.5 in the archive"
    )
