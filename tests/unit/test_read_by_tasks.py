"""What tasks read: groups of sensors, their names, times and noises; and the task that compares angles and commands."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.contract.robots import arm, trajectories
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import InvalidSpec, PluginBroken
from gaplab.services.engines.mujoco.engine import MuJoCo
from gaplab.services.specs.assembly import edits_of
from gaplab.services.specs.defaults import completed
from gaplab.services.specs.robots import Driven, robot_of, sensors
from gaplab.services.specs.simulation import Simulation
from gaplab.services.world.motions import Trajectory, commands_at
from gaplab.services.world.robots.quadruped import LEGS
from gaplab.services.world.tasks import tasks

QUADRUPED = PluginRef(name="quadruped")
JOINTS = arm()


def task(name: str, **options: Any) -> Any:
    made: Any = tasks.create(PluginRef(name=name, options=options))
    made.prepare(JOINTS)
    return made


def test_a_stored_spec_has_the_options_that_were_given_alone() -> None:
    walk = {"settling_s": 0.5, "counted_s": 2.5, "direction": "any"}

    assert completed(tasks, PluginRef(name="walk")).options == walk
    given = completed(tasks, PluginRef(name="walk", options={"sensors": "angles, base", "noise_angle": 0.001}))
    assert given.options == walk | {"sensors": ["base", "angles"], "noise_angle": 0.001}


def test_sensors_are_as_before_unless_options_say_so() -> None:
    assert task("walk").sensors.names == ("roll", "pitch", "height", "x", "y")
    assert task("walk").sensors.times_s.tolist() == [0.75, 1, 1.25, 1.5, 1.75, 2, 2.25, 2.5, 2.75, 3]
    assert task("walk").sensors.noises.tolist() == [0.02, 0.02, 0.005, 0.005, 0.005]
    assert task("reach").sensors.names == ("x", "y", "z")
    assert task("reach").sensors.times_s.tolist() == [0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2]
    assert not task("walk").joints
    assert not task("reach").joints


@pytest.mark.parametrize("name", ["walk", "reach", "track"])
def test_every_task_reads_the_groups_that_its_options_name(name: str) -> None:
    every: Any = {"sensors": ["torques", "base", "speeds", "angles"], "noise_speed": 0.3, "every_s": 0.5}
    made, usual = task(name, **every), task(name, sensors=["base"])
    seen = trajectories(made.sensors.times_s, JOINTS)

    values = made.sense(seen)

    joints = [f"{what} {joint.name}" for what in ("angle", "speed", "torque") for joint in JOINTS.actuators]
    assert made.sensors.names == (*usual.sensors.names, *joints)
    assert made.sensors.units[-9:] == ("rad",) * 3 + ("rad/s",) * 3 + ("N·m",) * 3
    assert made.sensors.noises[-6:-3].tolist() == [0.3] * 3
    assert set(np.round(np.diff(made.sensors.times_s), 9)) == {0.5}
    assert np.array_equal(values[..., -9:], np.concatenate([seen.angles_rad, seen.speeds_rad_s, seen.torques_nm], -1))
    silent = made.sense(replace(seen, torques_nm=None))
    assert np.isnan(silent[..., -3:]).all()
    assert np.array_equal(silent[..., :-3], values[..., :-3])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sensors": "angle"}, "unknown group of sensors 'angle'; permitted: base, angles, speeds, torques, contacts"),
        ({"sensors": []}, "sensors must have at least 1 item"),
        ({"every_s": 0.0}, "every_s must be at least 0.001"),
        ({"noise_angle": 0.0}, "noise_angle must be above 0"),
    ],
)
def test_options_that_make_no_sense_are_refused(options: Any, message: str) -> None:
    with pytest.raises(InvalidSpec, match=message):
        task("walk", **options)


def test_too_many_readings_are_refused_with_their_number() -> None:
    options = {"sensors": ["angles", "speeds"], "every_s": 0.002, "counted_s": 300.0}
    with pytest.raises(
        InvalidSpec, match=r"3,600,000 readings of a rollout, 150000 times 24, are too many: take a lon"
    ):
        robot_of(Driven(QUADRUPED, None, PluginRef(name="walk", options=options)))


def test_tracking_is_minus_the_root_mean_square_of_angle_less_command() -> None:
    made = task("track", counted_s=0.04)
    angles, commands = np.zeros((3, 3)), np.zeros((1, 3, 3))
    angles[:, 0], commands[..., 0] = [0.1, 0.2, 0.3], [0.1, 0.1, 0.4]
    angles[:, 1:] = 9.0  # these motors follow a speed and a torque
    nowhere = frozen(np.zeros((3, 3))), frozen(np.zeros((3, 4)))
    seen = Trajectory(made.observe_s, *nowhere, angles_rad=angles, commands=commands[0])

    assert made.observe_s.tolist() == [0.0, 0.02, 0.04]
    assert float(made.fitness(seen)) == pytest.approx(-np.sqrt(0.02 / 3))
    encoder = replace(JOINTS, biases=((f"angle {JOINTS.joints[0].name}", -0.1),))
    read = replace(seen, angles_rad=angles[None], commands=commands, worlds=[encoder])
    assert float(made.fitness(read)[0]) == pytest.approx(-np.sqrt(0.05 / 3))
    assert task("track").observe_s[-1] == 2.0
    assert task("track", counted_s=0.05).observe_s.tolist() == [0.0, 0.02, 0.04, 0.05]
    described = sensors(Driven(QUADRUPED, None, PluginRef(name="track")))
    assert described is not None
    assert (len(described.names), len(described.times_s)) == (12, 100)


def test_who_cannot_track_is_refused() -> None:
    with pytest.raises(InvalidSpec, match="those of mlp depend on what it observes"):
        robot_of(Driven(QUADRUPED, PluginRef(name="mlp"), PluginRef(name="track")))
    with pytest.raises(InvalidSpec, match="no hinge of this robot follows positions"):
        tasks.create(PluginRef(name="track")).prepare(replace(JOINTS, joints=JOINTS.joints[1:]))


def test_readings_and_fitness_are_those_of_a_recording_of_the_motion() -> None:
    robot = robot_of(Driven(QUADRUPED, None, PluginRef(name="track", options={"sensors": "base, angles"})))
    simulation, nothing = Simulation(robot, MuJoCo(), ()), np.empty((1, 0))

    outcome = simulation.sense(np.stack([robot.known, robot.known * 0.9]), nothing)[0, 0]

    values, times_s = robot.sensors.values(outcome[1:]), robot.sensors.times_s
    _, recorded = simulation.record(robot.known, nothing[0], times_s)
    commands = commands_at(robot.motion(robot.known), robot.motion(robot.known).observe_s)
    assert recorded.angles_rad is not None
    assert np.allclose(values[:, 3:], recorded.angles_rad, atol=1e-9)
    assert np.allclose(values[:, :3], recorded.poses[:, :3], atol=1e-9)
    assert commands is not None
    errors = np.vstack([-commands[:1], recorded.angles_rad - commands[1:]])  # all joints start at 0
    assert outcome[0] == pytest.approx(-np.sqrt((errors**2).mean()), abs=1e-6)
    assert outcome[0] == float(robot.fitness(recorded.trajectory)) == simulation(robot.known[None], nothing)[0, 0]


def test_contacts_tell_which_feet_are_on_the_ground() -> None:
    robot = robot_of(Driven(QUADRUPED, None, PluginRef(name="walk", options={"sensors": "contacts", "every_s": 0.05})))

    outcomes = Simulation(robot, MuJoCo(), ()).sense(robot.known[None], np.empty((1, 0)))

    contacts = robot.sensors.values(outcomes[0, 0, 1:])
    assert robot.sensors.names == tuple(f"contact {leg}_shin" for leg in LEGS)
    assert set(np.unique(contacts)) == {0.0, 1.0}
    together = np.asarray(np.corrcoef(contacts.T))
    assert together[0, 3] > 0.5 > together[0, 1] + 0.5  # in its trot, diagonal legs move together


@pytest.mark.parametrize(("label", "values"), [("ground_height", (0.0, 0.005, -0.05)), ("length_scale", (1.0, 1.2))])
def test_contacts_are_those_with_the_ground_and_the_feet_of_each_simulator(label: str, values: Any) -> None:
    robot = robot_of(Driven(QUADRUPED, None, PluginRef(name="walk", options={"sensors": "contacts", "every_s": 0.05})))
    simulation, simulators = Simulation(robot, MuJoCo(), edits_of([label])), frozen([[each] for each in values])

    outcomes = simulation.sense(robot.known[None], simulators)

    shares = robot.sensors.values(outcomes[0, :, 1:]).mean(axis=(1, 2))

    assert shares == pytest.approx(shares[0], abs=0.12)


def test_contacts_of_a_base_that_begins_turned_are_those_of_the_turned_base() -> None:
    world, turn = robot_of(Driven(QUADRUPED)).world, (np.sin(0.2), 0.0, 0.0, np.cos(0.2))
    level, begun = task("walk", sensors="contacts"), task("walk", sensors="contacts")
    level.prepare(world)
    begun.prepare(replace(world, start_turn=turn))

    def contacts(walk: Any, orientation: Any) -> Any:
        pose = np.array([[0.0, 0.0, world.start_height_m]])
        return walk.sense(Trajectory(np.zeros(1), pose, np.array([orientation]), np.zeros((1, len(world.joints)))))

    assert contacts(begun, (0.0, 0.0, 0.0, 1.0)).tolist() == contacts(level, turn).tolist()
    assert contacts(level, turn).tolist() != contacts(level, (0.0, 0.0, 0.0, 1.0)).tolist()


def test_contacts_are_refused_where_not_the_base_is_observed() -> None:
    with pytest.raises(InvalidSpec, match="contacts need the motion of the base, and front_left_shin is observed"):
        task("walk", sensors="contacts").prepare(replace(robot_of(Driven(QUADRUPED)).world, observed="front_left_shin"))


class Blind(MuJoCo):
    """An engine that tells no joints."""

    def rollouts(self, worlds: Any, motions: Any) -> Trajectory:
        return super().rollouts(worlds, [motion.observed_at(motion.observe_s, joints=False) for motion in motions])


def test_an_engine_that_tells_no_joints_is_named() -> None:
    robot = robot_of(Driven(QUADRUPED, None, PluginRef(name="walk", options={"sensors": ["angles"]})))

    with pytest.raises(PluginBroken, match="the engine 'mujoco' tells no angles of joints, which the quadruped needs"):
        Simulation(robot, Blind(), ())(robot.known[None], np.empty((1, 0)))
