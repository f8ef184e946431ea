"""Recorded reality: a pool that an engine made in place of a robot, and what strategies and users do with it."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

import gaplab
from gaplab.api.app import create_app
from gaplab.api.commands import tables
from gaplab.api.library.robots import read_robot
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.archives.rerunning import verify
from gaplab.services.core.errors import Conflict, InvalidSpec
from gaplab.services.experiments import stored_files
from gaplab.services.specs.resolution import resolve, resolve_experiment
from gaplab.services.store.session import Store
from gaplab.services.world import robot_library
from gaplab.services.world.motions import Start
from gaplab.services.world.pools import Channel, Pool, Recorded, fit_violations
from tests.drawn_arm import imported
from tests.recordings import TRUTH, arm_and_pool, simulated, written

pytest.importorskip("mujoco")

TELLS_APART = [
    "random",
    "informative",
    "farthest",
    {"name": "estimation_exploration", "options": {"select": "disagreement"}},
    {
        "name": "weighted",
        "options": {"fit_weight": 0.0, "disagreement_weight": 0.0, "information_weight": 1.0},
    },
]
SPEC: dict[str, Any] = {
    "engine": "mujoco",
    "tunables": list(TRUTH),
    "budget": {"preset": "smoke", "simulator_evaluations": 40},
    "tuner": "gauss_newton",
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return arm_and_pool(tmp_path_factory.mktemp("pool"))


def spec_of(files: tuple[Path, Path], **fields: Any) -> dict[str, Any]:
    arm, pool = files
    reality = {"kind": "recorded", "pool": str(pool), **fields.pop("reality", {})}
    return {**SPEC, "robot": str(arm), "reality": reality, **fields}


@pytest.fixture(scope="module")
def result(files: tuple[Path, Path]) -> Any:
    strategies = [*TELLS_APART, "direct"]
    return gaplab.run(spec_of(files, strategies=strategies, repetitions=1, iterations=2), workers=2, progress=False)


def test_strategies_without_fitness_select_each_recording_once_and_never_one_that_is_held_out(result: Any) -> None:
    samples = result.samples
    held_out = {0, 1, 2, 3, 4, 5, 6, 7} - set(samples.gene_0.astype(int))

    assert len(samples) == 2 * len(TELLS_APART)
    assert not samples.duplicated(["experiment", "repetition", "gene_0"]).any()
    assert len(held_out) >= 2  # a fifth of eight, rounded


def test_the_error_on_held_out_recordings_falls_and_the_fit_on_the_whole_pool_is_the_baseline(result: Any) -> None:
    curve = result.curve.set_index(["strategy", "evaluations"])["mean"]

    assert set(curve.index.get_level_values("strategy")) == {
        "random",
        "informative",
        "farthest",
        "estimation_exploration",
        "weighted",
        "direct",
    }
    assert -0.5 < curve["direct", 0] < 0.0  # it errs by less than half of the untuned simulator
    assert curve["random", 2] > curve["random", 0]


def test_the_figure_and_the_command_have_the_error_and_the_number_of_recordings(result: Any) -> None:
    svg = result.figure().content("svg").decode()
    (best,) = tables.best(result.study)

    assert ", mean error on held-out recordings, × untuned, 0." in best
    assert "Error on held-out recordings" in svg
    assert "Number of recordings used" in svg


def test_a_tuning_on_a_pool_identifies_what_made_it(files: tuple[Path, Path]) -> None:
    arm, pool = files
    tuning = gaplab.Tuning(arm, list(TRUTH), pool=pool, engine="mujoco", progress=False)

    found = tuning.simulator

    assert found.values == pytest.approx(TRUTH, rel=0.05)
    assert found.held_out_error is not None
    assert found.held_out_error < 1.5  # times the noise of the sensors
    with pytest.raises(Conflict, match="/strategy: random is not of a tuning; permitted: `direct`"):
        gaplab.Tuning(arm, list(TRUTH), pool=pool, engine="mujoco", strategy="random")


def test_a_repetition_gives_the_same_bits_again(result: Any, tmp_path: Path) -> None:
    archive = result.save(tmp_path / "study.zip")
    robot_library._known.clear()

    with archive.open("rb") as file:
        found = verify(file)

    assert [each.outcome for each in found.repetitions] == ["same"] * (len(TELLS_APART) + 1)


def test_each_repetition_may_hold_out_one_recording_which_tells_what_the_others_say_of_it(
    files: tuple[Path, Path],
) -> None:
    spec = spec_of(files, strategies=["direct"], repetitions=8, reality={"held_out": "each"})
    found = gaplab.run(spec, workers=2, progress=False)

    errors = found.simulators.held_out_error

    assert len(errors) == 8
    assert errors.nunique() == 8
    assert len(found.samples) == 0


REFUSED: dict[str, tuple[dict[str, Any], str, str]] = {
    "a strategy of fitness": ({"strategy": "simulated_fit"}, "/strategy", "recordings have none"),
    "estimation_exploration as in robotics": ({"strategy": "estimation_exploration"}, "/strategy", "have none"),
    "weighted with fitness": ({"strategy": "weighted"}, "/strategy", "random"),
    "fitness to compare": ({"discrepancy": "huber"}, "/discrepancy", '"permitted": ["readings"]'),
    "a controller": ({"controller": "sine"}, "/controller", "left out"),
    "more recordings than there are": ({"iterations": 7}, "/iterations", "at most 6"),
    "held-out samples": ({"held_out": 0.2}, "/held_out", "0, or left out"),
    "a bench": ({"reality": {"bench": "desk"}}, "/reality/bench", "left out"),
    "hidden parameters": ({"reality": {"parameters": {"joint_damping": 1.0}}}, "/reality/parameters", "left out"),
    "probes": ({"reality": {"probes": "each"}}, "/reality/probes", "left out"),
    "no pool": ({"reality": {"pool": None}}, "/reality/pool", "a pool that is stored"),
    "another robot": ({"robot": "quadruped"}, "/reality/pool", "which the quadruped lacks"),
}


def test_the_only_recording_of_a_pool_cannot_be_held_out(files: tuple[Path, Path], tmp_path: Path) -> None:
    pool = Pool.read(files[1].read_bytes())
    alone = written(tmp_path, pool.model_copy(update={"recordings": pool.recordings[:1]}))

    with pytest.raises(InvalidSpec, match="/reality/held_out: the pool swings has one recording"):
        gaplab.Tuning(files[0], pool=alone, engine="mujoco", reality={"held_out": "each"})
    assert gaplab.Tuning(files[0], pool=alone, engine="mujoco").spec.iterations == 1


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_recorded_reality_does_not_have_is_refused_with_place_and_what_is_permitted(
    case: str, files: tuple[Path, Path], sqlite_store: Store
) -> None:
    fields, pointer, words = REFUSED[case]
    store = sqlite_store
    stored_files.ROBOTS.add(store, files[0].read_bytes())
    stored_files.POOLS.add(store, files[1].read_bytes())
    reality = {"kind": "recorded", "pool": "swings", **fields.pop("reality", {})}
    spec = {**SPEC, "robot": "arm", "strategy": "random", "reality": reality, **fields}
    http = TestClient(create_app(store))

    answer = http.post("/experiments", json=spec)

    assert answer.status_code == 422
    assert pointer in answer.text
    assert words in json.dumps(answer.json(), ensure_ascii=False)
    assert http.get("/studies").json()["items"] == []


def test_a_pool_is_stored_once_listed_and_travels_in_archives(
    result: Any, files: tuple[Path, Path], tmp_path: Path, sqlite_store: Store
) -> None:
    http, pool = TestClient(create_app(sqlite_store)), Pool.read(files[1].read_bytes())
    archive = result.save(tmp_path / "study.zip")

    imported = http.post("/import", content=archive.read_bytes(), headers={"Content-Type": "application/zip"})
    again = http.post("/pools", json=pool.content)

    assert imported.status_code == 201, imported.text
    assert again.status_code == 201
    (listed,) = http.get("/pools").json()
    assert listed["sha256"] == pool.sha256 == again.json()["sha256"]
    assert listed["recordings"] == 8


def test_a_stored_spec_has_the_hash_of_its_pool_and_resolves_to_itself(files: tuple[Path, Path], store: Store) -> None:
    pool = Pool.read(files[1].read_bytes())
    stored_files.ROBOTS.add(store, files[0].read_bytes())
    stored_files.POOLS.add(store, pool.text)
    reality = {"kind": "recorded", "pool": "swings"}
    spec = ExperimentSpec.model_validate({**SPEC, "robot": "arm", "strategy": "random", "reality": reality})

    found = stored_files.resolved_here(store, spec, resolve_experiment)

    assert found.reality.pool is not None
    assert found.reality.pool.sha256 == pool.sha256
    assert found.iterations == 6  # all that are not held out
    assert resolve(found)[0] == found
    named = spec.model_copy(update={"discrepancy": PluginRef(name="readings", options={"absolute_weight": 0.5})})
    options = stored_files.resolved_here(store, named, resolve_experiment).discrepancy.options
    assert options == found.discrepancy.options | {"absolute_weight": 0.5}  # up to the last reading
    assert options["seconds"] == pytest.approx(0.9)


def test_a_joint_begins_where_a_biased_encoder_that_read_its_start_was_wrong(tmp_path: Path) -> None:
    channels = tuple(Channel(name=f"angle {joint}", unit="rad", noise=0.01) for joint in ("shoulder", "elbow"))
    start, commands = Start(angles_rad=(0.1, 0.3)), ((0.1,), (0.4,))
    one = Recorded(name="one", start=start, times_s=(0.0, 0.2), commands=commands, readings=((0.0, 0.0),) * 2)
    parts: dict[str, Any] = {"sensors": channels, "times_s": (0.01, 0.2), "joints": ("shoulder", "elbow")}

    said = [
        simulated(imported(tmp_path), [one], truth, actuators=("shoulder",), **parts).readings(0)
        for truth in ({"bias(elbow)": 0.0}, {"bias(elbow)": 0.2}, {"bias(elbow)": -0.2})
    ]

    for readings in said:  # with noise of 0.01; nothing commands the elbow, which stays where it was
        assert readings[:, 1] == pytest.approx([0.3, 0.3], abs=0.06)


BROKEN: dict[str, tuple[dict[str, Any], str, str]] = {
    "two of one name": ({"name": "swing 1"}, "/recordings", "each name is permitted once"),
    "a column too few": ({"readings": [[0.1, 0.2]]}, "/recordings/0/readings", "exactly 3"),
    "a clock that runs backwards": ({"times_s": [0.4, 0.0]}, "/recordings/0/times_s/1", "0.0 follows 0.4"),
    "commands without times": ({"times_s": [0.0]}, "/recordings/0/commands", "2 commands at 1 times"),
    "too many readings": ({"readings": [[0, 0, 0]] * 11}, "/recordings/0/readings", "at most 10"),
    "nan": ({"readings": [[0, float("nan"), 0]]}, "/recordings/0/readings/0/1", "finite"),
    "commands from later on": ({"times_s": [0.1, 0.4]}, "/recordings/0/times_s/0", "begin at 0.1 s"),
    "a turn of nothing": ({"start": {"turn": [0, 0, 0, 0]}}, "/recordings/0/start/turn", "x, y, z, w of norm 1"),
    "a turn of norm 2": ({"start": {"turn": [1, 1, 1, 1]}}, "/recordings/0/start/turn", "has norm 2"),
    "a start of other joints": ({"start": {"angles_rad": [0.1]}}, "/recordings/0/start", "exactly 0"),
}


def test_a_sensor_that_read_nothing_is_refused(files: tuple[Path, Path]) -> None:
    content = json.loads(files[1].read_bytes())
    for each in content["recordings"]:
        each["readings"] = [[*row[:2], None] for row in each["readings"]]

    with pytest.raises(InvalidSpec, match="/sensors/2: the sensor z has no reading in any recording"):
        Pool.read(json.dumps(content))


def test_a_base_that_never_moves_begins_nowhere_else(files: tuple[Path, Path]) -> None:
    pool = Pool.read(files[1].read_bytes())
    moved = pool.recordings[1].model_copy(update={"start": Start(velocity_m_s=(1.0, 0.0, 0.0))})
    pool, world = pool.model_copy(update={"recordings": (pool.recordings[0], moved)}), read_robot(files[0]).world

    (found,) = fit_violations(pool, replace(world, fixed=True), "arm", "/reality/pool")

    assert (found.pointer, found.value) == ("/reality/pool", "swing 1")
    assert not [*fit_violations(pool, replace(world, fixed=False), "arm", "/reality/pool")]


@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_pool_is_refused_with_every_place(case: str, files: tuple[Path, Path]) -> None:
    change, pointer, words = BROKEN[case]
    content = json.loads(files[1].read_bytes())
    content["recordings"][0] |= change

    with pytest.raises(InvalidSpec) as refused:
        Pool.read(json.dumps(content))

    found = [each for each in refused.value.violations if each.pointer == pointer]
    assert found
    assert words in str(refused.value) or words in str(found[0].permitted)
