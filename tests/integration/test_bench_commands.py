"""The commands for a robot on a bench, on a service in a thread."""

import io
import json
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from gaplab import Client, read_robot
from gaplab.api.clients.progress import RecordProgress, Snapshot, log
from gaplab.api.commands.exit_codes import Exit
from gaplab.schemas.measurements import TakeSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.engines.mujoco.engine import MuJoCo
from gaplab.services.experiments import stored_files
from gaplab.services.experiments.limits import FREELY
from gaplab.services.measuring import taking
from gaplab.services.store.models import EventRow
from gaplab.services.store.session import Store
from gaplab.services.world.motions import commands_at, open_loop
from tests.commands import Gaplab
from tests.drawn_arm import imported
from tests.experiments import submit_one, toy
from tests.integration.test_bench import compute, measure, pending
from tests.integration.test_bench_http import traces_of
from tests.integration.test_bench_safety import BEYOND, ask, safety, submit

PHYSICAL = {"kind": "physical", "probes": "never"}


def asked(store: Store, **changes: Any) -> Any:
    """The request of a new experiment."""
    submit_one(store, toy(**{"strategy": "random", "repetitions": 1, "reality": PHYSICAL} | changes))
    compute(store)
    return pending(store)[0]


def persons(store: Store) -> dict[str, str]:
    """Who corrected, voided or decided, by the kind of event."""
    with store.reading() as session:
        return {event.kind: event.body["by"] for event in session.query(EventRow) if "by" in event.body}


def test_a_request_is_read_moved_answered_and_corrected(sqlite_store: Store, gaplab: Gaplab) -> None:
    request = asked(sqlite_store, iterations=1)

    assert request.id in gaplab("requests").out
    assert f"{request.id} is open" in gaplab("requests", request.id).out
    assert "has no actuators" in gaplab("motion", request.id, "--format", "json").err
    said = gaplab("measured", request.id, "4.4", "--note", "cold", "--json")
    answer = json.loads(said.out)["id"]
    assert "would be done" in gaplab("correct", answer, "0.44", "--reason", "4.4 was 0.44", "--dry-run").out
    assert "Done" in gaplab("correct", answer, "0.44", "--reason", "4.4 was 0.44", "--operator", "Bea").out
    assert persons(sqlite_store) == {"corrected": "Bea"}
    read = gaplab("requests", request.id).out
    assert f"{answer} replaced: 4.4" in read
    assert "counted: 0.44" in read


def test_a_request_says_what_to_run_how_often_and_in_which_unit(sqlite_store: Store, gaplab: Gaplab) -> None:
    request = asked(sqlite_store, iterations=1, reality=PHYSICAL | {"repeats": 3})

    read = gaplab("requests", request.id).out

    assert f"repeats: 3, fitness in {request.unit}\n" in read
    assert f"genome: {json.dumps(request.genome)}\n" in read


def test_a_failure_has_its_reason_and_its_operator_and_no_unit(sqlite_store: Store, gaplab: Gaplab) -> None:
    request = asked(sqlite_store, iterations=1)

    answer = json.loads(gaplab("measured", request.id, "--failed", "it fell", "--operator", "Ada", "--json").out)

    assert f"  {answer['id']} counted: failed, by Ada: it fell\n" in gaplab("requests", request.id).out


def test_a_second_answer_says_how_a_person_decides(sqlite_store: Store, gaplab: Gaplab) -> None:
    request = asked(sqlite_store, iterations=1)
    gaplab("measured", request.id, "0.3")

    said = gaplab("measured", request.id, "0.4", "--operator", "Eve").out
    decision = said.partition("`gaplab ")[2].partition("`")[0].replace("WHY", "why").split()

    assert "is stored: conflict." in said
    assert "Done" in gaplab(*decision).out
    assert "counted: 0.4 " in gaplab("requests", request.id).out


def test_what_was_measured_is_found_again_with_its_measurements(sqlite_store: Store, gaplab: Gaplab) -> None:
    request = asked(sqlite_store, iterations=1)
    answer = json.loads(gaplab("measured", request.id, "0.3", "--json").out)["id"]

    waiting = gaplab("requests", request.experiment).out
    listed = gaplab("requests", request.experiment, "--all").out

    assert waiting == f"Nothing is to be measured; `gaplab requests {request.experiment} --all` lists what was.\n"
    assert request.id in listed
    assert f"{answer} counted: 0.3" in listed


def test_an_unknown_bench_is_answered_with_those_that_have_requests(sqlite_store: Store, gaplab: Gaplab) -> None:
    assert gaplab("requests", "--bench", "tabel").out == "Nothing was asked for on the bench 'tabel'.\n"
    asked(sqlite_store, iterations=1, reality=PHYSICAL | {"bench": "table"})

    said = gaplab("requests", "--bench", "tabel").out

    assert said == "Nothing was asked for on the bench 'tabel'; benches with requests: table.\n"


def test_an_expected_excess_of_a_limit_is_told_before_a_person_or_a_driver_measures(
    sqlite_store: Store, gaplab: Gaplab, tmp_path: Path
) -> None:
    id_ = submit(sqlite_store, "warn")
    ask(sqlite_store, safety=safety(BEYOND) | {"unknown": ["torque is not told"]})
    warnings = f"warning: {BEYOND}\nwarning: torque is not told\n"
    (request,) = pending(sqlite_store)
    driver = tmp_path / "driver.py"
    driver.write_text(
        "class Driver:\n"
        "    def connect(self): pass\n"
        "    def run(self, motion): raise RuntimeError('it ran')\n"
        "    def stop(self): pass\n"
    )

    driven = gaplab("drive", id_, "--driver", str(driver))
    within = gaplab("drive", id_, "--driver", str(driver), "--within-limits")

    assert "open, beyond its limits" in gaplab("requests").out
    assert gaplab("requests", request.id).err == warnings
    assert driven.err.startswith(warnings)
    assert "it ran" in driven.err
    assert (within.code, "it ran" in within.err) == (Exit.CONFLICT, False)
    assert within.err.startswith(warnings)
    assert f"request {request.id} is beyond its limits" in within.err
    assert pending(sqlite_store)[0].state == "open"


@pytest.mark.parametrize(
    ("file", "code", "said"),
    [
        ("no.py", Exit.FILE, "no.py: No such file or directory"),
        ("notes.txt", Exit.FAILED, "notes.txt is not a Python file"),
    ],
)
def test_a_driver_that_is_no_file_is_told_like_other_missing_files(
    gaplab: Gaplab, tmp_path: Path, file: str, code: Exit, said: str
) -> None:
    (tmp_path / "notes.txt").write_text("text")

    answer = gaplab("drive", "e1", "--driver", str(tmp_path / file))

    assert (answer.code, answer.err) == (code, f"gaplab: {tmp_path}/{said}\n")


@pytest.mark.parametrize(("values", "wrong"), [(["0.2", "0.3", "nan"], "nan"), (["0.2", "-0.3", "abc"], "abc")])
def test_a_value_that_is_no_number_is_named_with_its_place(
    sqlite_store: Store, gaplab: Gaplab, values: list[str], wrong: str
) -> None:
    for command in (("measured", "r1"), ("correct", "m1", "--reason", "why")):
        said = gaplab(*command, *values)

        assert said.code == Exit.USAGE
        assert f"value 3: '{wrong}' is not a finite number" in said.err


def test_an_operator_without_an_answer_is_refused(gaplab: Gaplab, tmp_path: Path) -> None:
    said = gaplab("traces", "r1", str(tmp_path / "x.csv"), "--operator", "Ada")

    assert (said.code, "add --answer" in said.err) == (Exit.USAGE, True)


def test_a_measurement_is_voided_and_one_in_conflict_is_decided_about(sqlite_store: Store, gaplab: Gaplab) -> None:
    request = asked(sqlite_store, iterations=2)
    measure(sqlite_store, request, 0.3)
    other = measure(sqlite_store, request, 0.4)

    other_robot = "--reason", "the first was of another robot", "--operator", "Bea"
    assert "Done" in gaplab("decide", other.id, "this", *other_robot).out
    assert "Done" in gaplab("void", other.id, "--reason", "the floor was wet", "--operator", "Cy").out
    assert persons(sqlite_store) == {"decided": "Bea", "voided": "Cy"}
    assert gaplab("decide", other.id, "that").code == 2
    assert pending(sqlite_store)[0].id == request.id


def test_a_request_that_is_not_stuck_cannot_be_offered_again(sqlite_store: Store, gaplab: Gaplab) -> None:
    request = asked(sqlite_store, iterations=1)

    said = gaplab("reopen", request.id)

    assert said.code != 0
    assert "open" in said.err


def test_the_take_of_a_dead_phone_is_ended_with_a_reason(sqlite_store: Store, gaplab: Gaplab) -> None:
    request = asked(sqlite_store, iterations=1)
    taking.take(sqlite_store, request.id, TakeSpec(operator="Eve"), FREELY)

    refused = gaplab("reopen", request.id)
    said = gaplab("reopen", request.id, "--reason", "her phone is dead", "--operator", "Ada")

    assert "taken, not stuck" in refused.err
    assert "is open" in said.out
    assert persons(sqlite_store) == {"released": "Ada"}


@pytest.mark.release
def test_traces_are_computed_and_stored_as_an_answer(sqlite_store: Store, gaplab: Gaplab, tmp_path: Path) -> None:
    pytest.importorskip("pybullet")
    robot = {"robot": "quadruped", "engine": "pybullet", "budget": "smoke", "iterations": 1}
    request = asked(sqlite_store, **robot, reality=PHYSICAL | {"repeats": 2})
    files = [str(file) for file in traces_of(request.genome, tmp_path)]

    computed = gaplab("traces", request.id, *files).out
    assert computed.count("m/s; the motion begins at") == 2
    assert pending(sqlite_store)[0].answers == ()
    assert "is stored: counted" in gaplab("traces", request.id, *files, "--answer", "--operator", "Ada").out
    assert " by Ada\n" in gaplab("requests", request.id).out


def test_encoders_of_an_arm_answer_a_request(sqlite_store: Store, gaplab: Gaplab, tmp_path: Path) -> None:
    stored_files.ROBOTS.add(sqlite_store, imported(tmp_path).read_text())
    request = asked(sqlite_store, robot="arm", engine="mujoco", budget="smoke", iterations=1)
    robot: Any = read_robot(tmp_path / "arm.json")
    motion = open_loop(robot.motion(np.array(request.genome)))
    times_s = frozen(np.arange(101) * 0.02)
    recorded = MuJoCo().record(robot.world, motion, times_s)
    degrees = np.rad2deg(recorded.angles_rad)
    rows = np.column_stack([times_s + 3.0, -degrees[:, 0], degrees[:, 1], *commands_at(motion, times_s).T])
    file = tmp_path / "run.csv"
    head = "time_s,position_Pan,Tilt,command shoulder,command elbow"
    np.savetxt(file, rows, delimiter=",", header=head, comments="")
    mapping = ["--map", "shoulder=Pan [-deg]", "--map", "elbow=Tilt [deg]"]

    plain = gaplab("traces", request.id, str(file))
    without = gaplab("traces", request.id, str(file), "--map", "shoulder=Pan", "--map", "elbow=Tilt")
    answered = gaplab("traces", request.id, str(file), *mapping, "--answer", "--operator", "Ada")

    assert "the trace needs one column each of angle shoulder, angle elbow" in plain.err
    assert "doubtful: trace 1: the column 'angle elbow', line " in without.out
    assert "is it `[deg]`?" in without.out
    assert "the motion begins at 3.000 s (match 1.00)" in answered.out
    assert "is stored: counted" in answered.out
    assert "is not JOINT=COLUMN" in gaplab("traces", request.id, str(file), "--map", "Pan").err
    named = "--robot", "arm", "--name", "runs", "--noise", "angle"
    assert "--noise: 'angle' is not NAME=NUMBER" in gaplab("pool", "import", str(file), *named).err
    (found,) = taking.list_requests(sqlite_store, taking.RequestFilter(pending=False)).items
    fitness = float(robot.fitness(recorded.trajectory))
    assert found.answers[0].values == pytest.approx((fitness,), abs=1e-3)
    assert np.shape(found.answers[0].readings) == (1, len(robot.sensors.times_s), 3)


def test_what_one_takes_home_is_saved_as_a_zip(sqlite_store: Store, gaplab: Gaplab, tmp_path: Path) -> None:
    request = asked(sqlite_store, iterations=1)
    measure(sqlite_store, request, 0.4)
    compute(sqlite_store)

    said = gaplab("takehome", request.experiment, str(tmp_path / "home.zip"))

    assert said.code == 0, said.err
    assert "controller.json" in zipfile.ZipFile(tmp_path / "home.zip").namelist()
    assert "permitted: .zip" in gaplab("takehome", request.experiment, "home.pdf").err


def test_an_experiment_that_waits_for_its_robot_is_listed_shown_and_watched(
    sqlite_store: Store, gaplab: Gaplab, url: str
) -> None:
    id_ = asked(sqlite_store, iterations=1).experiment
    watched = io.StringIO()

    listings = [gaplab("list"), gaplab("show", id_)]
    with Client(url) as client:
        log([Snapshot(client.study(id_), (RecordProgress(client.experiment(id_)),))], Console(file=watched, width=160))

    assert [said.code for said in listings] == [0, 0]
    assert all("WAITING" in said.out for said in listings)
    assert "rollouts" in watched.getvalue()
    assert "; WAITING" in watched.getvalue()
    assert "time left" not in watched.getvalue()


def test_a_negative_value_is_a_number_and_a_misspelt_option_is_none(sqlite_store: Store, gaplab: Gaplab) -> None:
    request = asked(sqlite_store, iterations=1, reality=PHYSICAL | {"repeats": 2})

    misspelt = gaplab("measured", request.id, "-0.3", "0.1", "--nte", "cold")
    answer = json.loads(gaplab("measured", request.id, "-.3", "-1e-3", "--note", "cold", "--json").out)
    corrected = gaplab("correct", answer["id"], "--reason", "the sign", "-0.4", "0.001")
    read = gaplab("requests", request.id).out

    assert (misspelt.code, "No such option: --nte" in misspelt.err) == (Exit.USAGE, True)
    assert (answer["values"], answer["note"]) == ([-0.3, -0.001], "cold")
    assert corrected.code == 0
    assert "counted: -0.4, 0.001" in read


@pytest.mark.parametrize("command", [("correct", "m1", "0.3"), ("void", "m1"), ("decide", "m1", "this")])
def test_a_reason_is_asked_for_before_the_service_is(gaplab: Gaplab, command: tuple[str, ...]) -> None:
    said = gaplab(*command)

    assert (said.code, "Missing option '--reason'" in said.err) == (Exit.USAGE, True)


def test_all_requests_are_listed_on_one_line_each(sqlite_store: Store, gaplab: Gaplab) -> None:
    reality = PHYSICAL | {"bench": "the long table at the window of the second laboratory", "probes": "each"}
    submit_one(sqlite_store, toy(robot="quadruped", engine="mujoco", repetitions=55, reality=reality))
    for _ in range(55):
        ask(sqlite_store)

    listed, printed = json.loads(gaplab("requests", "--json").out), gaplab("requests").out

    assert len(listed) == 55
    assert all(printed.count(request["id"]) == 1 for request in listed)
    assert printed.count(reality["bench"]) == 55


def test_a_recording_that_a_missing_library_reads_is_refused_with_a_sentence(
    gaplab: Gaplab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mcap.exceptions", None)

    said = gaplab("traces", "r1", str(tmp_path / "x.mcap"))

    assert said.code == Exit.FAILED
    assert said.err == "gaplab: this needs mcap, which is not installed: pip install 'gaplab[mcap]'\n"
