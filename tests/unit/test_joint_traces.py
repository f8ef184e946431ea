"""Traces of joints: an arm's encoders become fitness and readings, and what is wrong with them is told."""

from typing import Any

import numpy as np
import pytest

import gaplab
from gaplab.api.clients.trace_files import mapped
from gaplab.schemas.traces import TracesSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.csv_tables import csv_text, read_csv
from gaplab.services.engines.mujoco.engine import MuJoCo
from gaplab.services.replay.traces import evaluated
from gaplab.services.world.logs import Trace, read_trace
from gaplab.services.world.motions import commands_at, open_loop
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.traces import unlikely_joints
from tests.drawn_arm import imported

LAG_S = 7.5


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return gaplab.read_robot(imported(tmp_path_factory.mktemp("arm")))


class Log:
    """What the arm's encoders say of its known motion, at 50 Hz, with rest before and after it."""

    def __init__(self, robot: Robot) -> None:
        motion = open_loop(robot.motion(robot.known))
        clock = np.arange(-50, 151) * 0.02
        inside = np.clip(clock, 0.0, 2.0)
        self.times_s = clock + LAG_S
        recorded = MuJoCo().record(robot.world, motion, frozen(np.unique(inside)))
        assert recorded.angles_rad is not None
        self.angles = recorded.angles_rad[np.searchsorted(np.unique(inside), inside)]
        commands = commands_at(motion, inside)
        assert commands is not None
        self.commands = np.where(clock[:, None] < 0.0, [joint.start for joint in robot.world.joints], commands)

    def text(self, *headings: str, commands: bool = False, **columns: Any) -> str:
        named = dict(zip(("shoulder", "elbow"), self.angles.T, strict=True)) | columns
        rows = [self.times_s, *named.values(), *(self.commands.T if commands else ())]
        sent = ["command shoulder", "command elbow"] if commands else []
        return csv_text(["time_s", *(headings or named), *sent], np.column_stack(rows).tolist())


def rated(robot: Robot, trace: Trace) -> Any:
    motion = open_loop(robot.motion(robot.known))
    times_s = frozen(np.arange(101) * 0.02)
    recorded = MuJoCo().record(robot.world, motion, times_s)
    expected = Trace(times_s, recorded.poses[:, :3], recorded.poses[:, 3:], recorded.angles_rad)
    return evaluated(robot, robot.known, [trace], expected, TracesSpec(traces=("a" * 64,)))


@pytest.mark.parametrize(("commands", "share"), [(True, 1.0), (True, 0.0), (False, 1.0)])
def test_encoders_of_an_arm_give_fitness_and_readings(arm: Robot, commands: bool, share: float) -> None:
    """Commands that never change say nothing about time."""
    log = Log(arm)
    log.commands *= share
    found = rated(arm, read_trace(log.text(commands=commands), "/traces/0", arm.world))

    real = MuJoCo().rollout(arm.world, open_loop(arm.motion(arm.known)))
    assert found.traces[0].lag_s == pytest.approx(LAG_S, abs=0.011)
    assert found.values[0] == pytest.approx(float(arm.fitness(real)), abs=0.005)
    assert np.shape(found.readings) == (1, 8, 3)
    assert found.doubts == ()


@pytest.mark.parametrize("commands", [True, False])
def test_an_arm_that_sags_after_its_motion_is_not_against_its_commands(arm: Robot, commands: bool) -> None:
    log, rows = Log(arm), 900
    log.times_s = np.append(log.times_s, log.times_s[-1] + np.arange(1, rows + 1) * 0.02)
    log.angles = np.vstack([log.angles, np.full((rows, 2), -0.9)])
    log.commands = np.vstack([log.commands, np.tile(log.commands[-1], (rows, 1))])

    assert rated(arm, read_trace(log.text(commands=commands), "/traces/0", arm.world)).doubts == ()


def test_columns_are_mapped_with_sign_unit_and_zero(arm: Robot) -> None:
    log = Log(arm)
    plain = read_trace(log.text(commands=True), "/traces/0", arm.world)
    degrees, ticks = np.rad2deg(log.angles[:, 0]), 2048 - log.angles[:, 1] * 4096 / (2 * np.pi)
    text = log.text("Pan", "position_Tilt", shoulder=degrees, elbow=ticks)

    found = read_trace(
        mapped(read_csv(text), {"shoulder": "Pan [deg]", "elbow": "Tilt [-ticks @ 2048]"}), "/traces/0", arm.world
    )

    assert np.allclose(found.angles_rad, plain.angles_rad, atol=1e-9)
    percent = mapped(
        read_csv(log.text("s", "e", elbow=(log.angles[:, 1] + 1.6) / 0.032)), {"shoulder": "s", "elbow": "e [%]"}
    )
    assert np.allclose(read_trace(percent, "/traces/0", arm.world).angles_rad, plain.angles_rad, atol=1e-9)
    speeds = read_csv("time_s,shoulder,elbow,velocity_elbow,battery,pos_error\n0,50,50,10,99,5\n1,50,50,10,98,5\n")
    shares = read_trace(mapped(speeds, {"*": "[%]"}), "/traces/0", arm.world)
    assert (shares.angles_rad[0].tolist(), shares.speeds_rad_s[0, 1]) == ([0.0, 0.0], pytest.approx(0.32))
    goals = read_csv("time_s,s,e,goal_e\n0,1,1,3\n1,1,1,3\n")
    goals = mapped(goals, {"shoulder": "s", "elbow": "e", "command elbow": "goal_e"})
    assert read_trace(goals, "/traces/0", arm.world).commands[:, 1].tolist() == [3.0, 3.0]
    with pytest.raises(ValueError, match="no column of 'Elbw' for elbow; it has time_s, Pan, position_Tilt"):
        mapped(read_csv(text), {"elbow": "Elbw [deg]"})


@pytest.mark.parametrize(
    ("heading", "changed", "said"),
    [
        ("elbow", lambda angles: angles, ""),
        ("elbow [deg]", np.rad2deg, ""),
        ("elbow", np.rad2deg, "is it `[deg]`?"),
        ("elbow", lambda angles: -np.rad2deg(angles), "is it `[-deg]`?"),
        ("elbow", lambda angles: 2048 + angles * 4096 / 2 / np.pi, "is it `[ticks @ 2048]`?"),
        ("elbow", lambda angles: -angles, "goes against the commands of elbow (correlation -1.00); is it `[-]`?"),
        ("elbow", lambda angles: angles + 3.0, "is outside the limits of elbow, -1.6 to 1.6; say `[@ ZERO]`"),
        ("elbow", lambda angles: angles + 0.6, "is 0.6 from the commands of elbow on average; say `[@ ZERO]`"),
        ("elbow", lambda angles: angles * 1e-2, "moves 0.01 times as far as the commands of elbow"),
    ],
)
def test_a_joint_that_cannot_have_moved_so_is_told_with_its_column(
    arm: Robot, heading: str, changed: Any, said: str
) -> None:
    log = Log(arm)
    log.angles = log.commands.copy()
    text = log.text("shoulder", heading, elbow=changed(log.angles[:, 1]), commands=True)

    told = list(unlikely_joints(read_trace(text, "/traces/0", arm.world), arm.world))

    assert bool(told) == bool(said)
    assert not said or (said in told[0] and told[0].startswith(f"the column {heading!r}"))


def test_a_joint_beyond_its_limits_is_told_with_its_line(arm: Robot) -> None:
    text = "time_s,shoulder,elbow,command shoulder\n0,0.1,0.2,1\n0.1,0.2,57,1\n0.2,0.3,-12,1\n"

    (told,) = unlikely_joints(read_trace(text, "/traces/0", arm.world), arm.world)

    assert told == ("the column 'elbow', line 3: 57 is outside the limits of elbow, -1.6 to 1.6; is it `[deg]`?")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time_s,shoulder\n0,0\n1,0\n", "line 1: the trace needs one column each of angle elbow"),
        ("time_s,shoulder,elbow,angle knee\n0,0,0,0\n", "no joint 'knee'; permitted: shoulder, elbow"),
        ("time_s,shoulder,elbow,elbow\n0,0,0,0\n", "one column each of angle elbow"),
        ("time_s,shoulder,elbow\n0,0,0\n1,0,nan\n", "line 3, elbow: 'nan' is not a finite number"),
        ("time_s,shoulder,elbow\n0,0,0\n1,0\n", "line 3, elbow: '' is not a finite number"),
        ("time_s,shoulder,elbow\n1,0,0\n0.5,0,0\n", "line 3: time_s must ascend, and 0.5 follows 1.0"),
        ("time_s,shoulder,elbow\n0,0,0\n1e-4,0,0\n", "lasts 0.0001 s; at least a time step of"),
        ("time_s,shoulder,elbow [ft]\n0,0,0\n1,0,0\n", "the unit 'ft' is not known; permitted: rad, deg, °, ticks, %"),
        ("time_s,shoulder,elbow [deg @ x]\n0,0,0\n1,0,0\n", "'x' is not a number, where the joint is at zero"),
        ("shoulder,elbow\n0,0\n1,0\n", "one column each of time_s"),
    ],
)
def test_what_is_no_trace_of_joints_is_refused_with_its_line(arm: Robot, text: str, message: str) -> None:
    with pytest.raises(InvalidSpec, match=message.replace("?", r"\?")):
        read_trace(text, "/traces/0", arm.world)


def test_a_trace_that_lacks_what_counts_is_refused(arm: Robot) -> None:
    poses = "time_s,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n9,1,0,0,0,0,0,1\n"

    with pytest.raises(InvalidSpec, match="no finite fitness from this trace, which lacks the angles of its joints"):
        rated(arm, read_trace(poses, "/traces/0", arm.world))
    walks = gaplab.read_robot("quadruped")
    joints = ",".join(joint.name for joint in walks.world.actuators)
    zeros = ",".join("0" for _ in walks.world.actuators)

    text = f"time_s,{joints}\n0,{zeros}\n9,{zeros}\n"
    with pytest.raises(InvalidSpec, match="which lacks the pose of the base"):
        rated(walks, read_trace(text, "/traces/0", walks.world))
