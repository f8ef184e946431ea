"""Robots from files: stored by their hash, named in specs, simulated by workers, and in archives."""

import json
from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from typing import Any

import pytest
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.robots import FileKind
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.archives import export
from gaplab.services.archives.rerunning import verify
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import stored_files, submission
from gaplab.services.running import execution, sensitivity
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.clock import now
from gaplab.services.store.models import ExperimentRow, FileRow
from gaplab.services.store.session import Store
from gaplab.services.world import robot_library, world_checks
from gaplab.services.world.robot_files import RobotFile
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.robots.robot_file import Imported
from gaplab.services.world.world import Inertia
from tests.archiving import exported, imported
from tests.experiments import listed, run, submit_one

JSON = {"Content-Type": "application/json"}
SPEC: dict[str, Any] = {
    "strategy": "simulated_fit",
    "robot": "walker",
    "engine": "mujoco",
    "tunables": ["static_friction", "dynamic_friction", "restitution"],
    "budget": {
        "preset": "smoke",
        "controller_evaluations": 25,
        "selection_evaluations": 25,
        "simulator_evaluations": 25,
    },
    "iterations": 1,
    "repetitions": 1,
}


def file_of(name: str = "walker") -> RobotFile:
    """The quadruped, as a file has it."""
    example = robot_library.robot_file(Imported.example().options.sha256)
    assert example is not None
    return RobotFile.read(json.dumps(example.content | {"name": name}))


@pytest.fixture(autouse=True)
def _nothing_known() -> Iterator[None]:
    """Let each test know the robots of its own store alone."""
    robot_library._known.clear()
    yield
    robot_library._known.clear()


@pytest.fixture
def store(sqlite_store: Store) -> Store:
    return sqlite_store


@pytest.fixture
def http(store: Store) -> TestClient:
    return TestClient(create_app(store))


def test_a_robot_is_stored_once_under_the_hash_of_its_content(http: TestClient) -> None:
    file = file_of()
    first = http.post("/robots", json=file.content)
    again = http.post("/robots", content=file.text, headers=JSON)

    assert first.status_code == again.status_code == 201
    assert first.json()["sha256"] == again.json()["sha256"] == file.sha256
    assert [each["name"] for each in http.get("/robots").json()] == ["walker"]
    assert http.get(f"/robots/{file.sha256}").text == http.get("/robots/walker").text == file.text
    assert http.get("/robots/nobody").status_code == 404


@pytest.mark.parametrize(
    ("content", "status", "pointer"),
    [
        (b"<mujoco/>", 422, None),
        (b"[" * 100_000, 422, None),
        (b"x" * 2_000_001, 413, None),
        (b'{"name": "walker"}', 422, "/world"),
    ],
)
def test_what_is_no_robot_file_is_refused_with_its_place(
    http: TestClient, content: bytes, status: int, pointer: str | None
) -> None:
    answer = http.post("/robots", content=content, headers=JSON)

    assert answer.status_code == status
    if pointer is not None:
        assert pointer in [each["pointer"] for each in answer.json()["errors"]]
    assert http.get("/robots").json() == []


def test_a_robot_cannot_have_the_name_of_a_plug_in_or_a_controller_that_is_not_there(http: TestClient) -> None:
    taken = http.post("/robots", json=file_of("quadruped").content).json()
    unknown = {"usual_controller": {"name": "wings", "options": {}}, "usual_task": {"name": "fly", "options": {}}}
    winged = http.post("/robots", json=file_of().content | unknown).json()

    assert taken["title"] == winged["title"] == "The robot file is invalid"
    assert "gaplab has a robot 'quadruped' already" in taken["errors"][0]["message"]
    assert [each["pointer"] for each in winged["errors"]] == ["/usual_controller", "/usual_task"]
    assert "wings" in winged["errors"][0]["message"]


def test_a_spec_means_the_newest_robot_of_a_name_and_keeps_its_hash(store: Store) -> None:
    old = stored_files.ROBOTS.add(store, file_of().text)
    first = submit_one(store, ExperimentSpec.model_validate(SPEC))
    heavier = json.loads(file_of().text)
    heavier["world"]["bodies"][0]["mass_kg"] = 3.0
    new = stored_files.ROBOTS.add(store, json.dumps(heavier))
    second = submit_one(store, ExperimentSpec.model_validate(SPEC))

    assert [each.spec["robot"]["options"]["sha256"] for each in (first, second)] == [old.sha256, new.sha256]
    assert first.spec["robot"]["options"]["name"] == "walker"


def test_an_unknown_robot_is_told_with_every_other_mistake(store: Store) -> None:
    with pytest.raises(InvalidSpec) as raised:
        submission.submit(store, StudySpec.model_validate({"robot": "wolker", "optimizer": "none"}))

    assert {each.pointer for each in raised.value.violations} == {"/robot", "/optimizer"}


def test_an_unknown_robot_is_told_with_the_names_of_the_stored_ones(store: Store, http: TestClient) -> None:
    stored_files.ROBOTS.add(store, file_of().text)
    specs = {"/experiments": {"strategy": "random", "robot": "wolker"}, "/studies": {"robot": "wolker"}}
    answers = [http.post(path, json=spec) for path, spec in specs.items()]
    answers.append(
        http.post("/samples/check?robot=wolker", content="gene_0,value_1\n", headers={"Content-Type": "text/csv"})
    )

    for answer in answers:
        (found,) = answer.json()["errors"]
        assert (answer.status_code, found["pointer"]) == (422, "/robot")
        assert found["permitted"] == ["quadruped", "toy_function", "walker"]
        assert "did you mean 'walker'?" in found["message"]


def test_a_table_of_samples_is_checked_for_a_stored_robot(store: Store, http: TestClient) -> None:
    stored_files.ROBOTS.add(store, file_of().text)
    table = ",".join([*(f"gene_{i}" for i in range(24)), "value_1"]) + "\n" + ",".join(["0.5"] * 24 + ["0.3"]) + "\n"

    answer = http.post("/samples/check?robot=walker", content=table, headers={"Content-Type": "text/csv"})

    assert answer.status_code == 200
    assert [each["values"] for each in answer.json()["samples"]] == [[0.3]]


def test_a_robot_that_the_process_knows_but_that_is_not_stored_is_refused(store: Store) -> None:
    robot_library.learn([file_of().text])
    unstored = {"name": "robot_file", "options": {"sha256": file_of().sha256}}

    with pytest.raises(InvalidSpec, match=r"no robot with the hash .* is stored here"):
        submit_one(store, ExperimentSpec.model_validate(SPEC | {"robot": unstored}))


def test_it_is_said_why_an_engine_cannot_run_a_robot(store: Store) -> None:
    inertia = Inertia((0.01, 0.01, 0.01))
    bodies = [replace(body, shape=body.parts * 30, inertia=inertia) for body in Quadruped().world.bodies]
    world = replace(Quadruped().world, bodies=tuple(bodies))
    stored_files.ROBOTS.add(store, file_of().model_copy(update={"world": world}).text)

    with pytest.raises(InvalidSpec, match=r"pybullet cannot run the .*, since its bodies and shapes need \d+ links"):
        submit_one(store, ExperimentSpec.model_validate(SPEC | {"robot": "walker", "engine": "pybullet"}))


def test_a_robot_from_a_file_takes_no_options(store: Store) -> None:
    stored_files.ROBOTS.add(store, file_of().text)
    with pytest.raises(InvalidSpec, match="comes from a file, which has no options"):
        submit_one(store, ExperimentSpec.model_validate(SPEC | {"robot": {"name": "walker", "options": {"legs": 4}}}))


@pytest.mark.release
def test_a_robot_from_a_file_has_the_numbers_of_the_plug_in_to_the_last_bit(store: Store) -> None:
    stored_files.ROBOTS.add(store, file_of().text)
    made = submit_one(store, ExperimentSpec.model_validate(SPEC))
    with store.reading() as session:
        from_file = ResolvedSpec.model_validate(session.get_one(ExperimentRow, made.id).spec)
    plug_in = resolve_experiment(ExperimentSpec.model_validate(SPEC | {"robot": Quadruped.name}))

    ours, theirs = (list(repetition(setting(spec, 0))) for spec in (from_file, plug_in))
    assert [repr(step) for step in ours] == [repr(step) for step in theirs]


def test_who_claims_work_on_a_stored_robot_can_send_its_file(store: Store) -> None:
    stored_files.ROBOTS.add(store, file_of().text)
    submit_one(store, ExperimentSpec.model_validate(SPEC))

    robot_library._known.clear()
    (claim,) = execution.claim(store, "me", 1)
    assert robot_library.needed_by(claim.spec.model_dump()) == (file_of().text,)
    robot_library._known.clear()
    check = sensitivity.claim(store, "me")
    assert check is not None
    assert robot_library.needed_by(check.spec.model_dump()) == (file_of().text,)


def test_a_spec_whose_robot_is_gone_says_so(store: Store) -> None:
    stored_files.ROBOTS.add(store, file_of("lost").text)
    made = submit_one(store, ExperimentSpec.model_validate(SPEC | {"robot": "lost"}))
    with store.transaction() as session:
        session.delete(session.get_one(FileRow, made.spec["robot"]["options"]["sha256"]))
        spec = ResolvedSpec.model_validate(session.get_one(ExperimentRow, made.id).spec)
    robot_library._known.clear()

    with pytest.raises(InvalidSpec, match="the robot 'lost' with the hash"):
        setting(spec, 0)


@pytest.mark.release
def test_a_stored_robot_stays_usable_where_later_checks_would_refuse_it(
    store: Store, http: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    stored_files.ROBOTS.add(store, file_of().text)
    made = submit_one(store, ExperimentSpec.model_validate(SPEC))
    robot_library._known.clear()
    monkeypatch.setattr(world_checks, "MOST_BODIES", 3)

    assert [each["name"] for each in http.get("/robots").json()] == ["walker"]
    assert {each["name"]: each["available"] for each in http.get("/catalogue").json()["robots"]}["walker"]
    assert http.get("/catalogue/robots/walker/shapes").json()["shapes"]
    with store.reading() as session:
        assert next(repetition(setting(ResolvedSpec.model_validate(session.get_one(ExperimentRow, made.id).spec), 0)))
    with pytest.raises(InvalidSpec, match="1 to 3 bodies"):
        stored_files.ROBOTS.add(store, file_of("another").text)


def test_a_robot_whose_usual_task_is_gone_is_unavailable_in_the_catalogue(store: Store, http: TestClient) -> None:
    lost = RobotFile.read(json.dumps(file_of("lost").content | {"usual_task": {"name": "fly", "options": {}}}))
    with store.transaction() as session:
        session.add(FileRow(sha256=lost.sha256, kind=FileKind.ROBOT, name=lost.name, text=lost.text, created_at=now()))
    stored_files.ROBOTS.add(store, file_of().text)

    entries = {each["name"]: each for each in http.get("/catalogue").json()["robots"]}

    assert not entries["lost"]["available"]
    assert "unknown task 'fly'" in entries["lost"]["note"]
    assert entries["walker"]["available"]


def test_queries_and_the_catalogue_know_it_by_its_name(store: Store, http: TestClient) -> None:
    stored_files.ROBOTS.add(store, file_of().text)
    made = submit_one(store, ExperimentSpec.model_validate(SPEC))
    entry = next(each for each in http.get("/catalogue").json()["robots"] if each["name"] == "walker")

    assert entry["details"]["controller"]["name"] == "square_pulses"
    assert (entry["details"]["genes"], entry["details"]["unit"]) == (24, "m/s")
    assert [each.id for each in listed(store, q="robot = walker")] == [made.id]
    assert listed(store, q="robot = imported") == []


def test_an_archive_has_its_robots_and_brings_them(store: Store, other: Store) -> None:
    file = file_of()
    stored_files.ROBOTS.add(store, file.text)
    made = submit_one(store, ExperimentSpec.model_validate(SPEC))
    archive = exported(export(store, made.id))
    robot_library._known.clear()

    imported(other, archive)

    assert RobotFile.read(stored_files.robot_text(other, "walker")).sha256 == file.sha256


@pytest.mark.release
def test_an_archive_of_a_robot_from_a_file_is_verified_in_processes_that_do_not_know_it(store: Store) -> None:
    stored_files.ROBOTS.add(store, file_of().text)
    made = submit_one(store, ExperimentSpec.model_validate(SPEC))
    (claim,) = execution.claim(store, "me", 1)
    run(store, claim, repetition(setting(claim.spec, claim.number)))
    archive = BytesIO(exported(export(store, made.id)))
    robot_library._known.clear()

    (found,) = verify(archive, cores=1).repetitions

    assert (found.outcome, found.reason) == ("same", None)
    assert found.steps == found.stored_steps > 0


def test_an_archive_gives_no_name_another_meaning(store: Store, other: Store) -> None:
    stored_files.ROBOTS.add(store, file_of().text)
    made = submit_one(store, ExperimentSpec.model_validate(SPEC))
    archive = exported(export(store, made.id))
    own = json.loads(file_of().text)
    own["world"]["bodies"][0]["mass_kg"] = 3.0
    mine = stored_files.ROBOTS.add(other, json.dumps(own))

    imported(other, archive)

    assert [each.sha256 for each in stored_files.ROBOTS.all(other)] == [mine.sha256, file_of().sha256]
    assert RobotFile.read(stored_files.robot_text(other, "walker")).sha256 == mine.sha256
