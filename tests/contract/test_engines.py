"""What every engine promises, asked of each one that is installed, with each robot that it runs."""

import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import PluginBroken
from gaplab.services.engines import engines
from gaplab.services.engines.base import USES, WARM_SCENES, Engine
from gaplab.services.engines.energy import Energy
from gaplab.services.world.motions import NO_MEMORY, Loop, Motion, Start, Trajectory, open_loop
from gaplab.services.world.robot_library import IMPORTED
from gaplab.services.world.robots import robots
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.sensing import disturbed
from gaplab.services.world.tunables import tunables
from gaplab.services.world.world import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Inertia,
    Material,
    Part,
    PDMotor,
    Shape,
    Sphere,
    Vector,
    World,
)


class Pair(NamedTuple):
    engine: Engine
    robot: Robot

    def roll(self, world: World | None = None) -> FloatArray:
        here, known = world or self.robot.world, self.robot.known
        return flat(self.engine.rollout(here, disturbed(here, self.robot.motion(known), known)))


def flat(trajectory: Trajectory) -> FloatArray:
    return np.concatenate([trajectory.positions_m.ravel(), trajectory.orientations.ravel()])


def runnable() -> list[tuple[str, str]]:
    installed = {name: engine() for name, engine in engines.items() if engine.available()}
    worlds = {name: robot().world for name, robot in robots.items() if name != IMPORTED}  # that is another quadruped
    return [(name, robot) for name, engine in installed.items() for robot in worlds if engine.runs(worlds[robot])]


PAIRS = runnable()
WITH_BODIES = [(engine, robot) for engine, robot in PAIRS if robots[robot]().world.bodies]


@pytest.fixture(params=PAIRS, ids="-".join)
def pair(request: pytest.FixtureRequest) -> Pair:
    engine, robot = request.param
    return Pair(engines[engine](), robots[robot]())


@pytest.fixture(params=WITH_BODIES, ids="-".join)
def embodied(request: pytest.FixtureRequest) -> Pair:
    engine, robot = request.param
    return Pair(engines[engine](), robots[robot]())


def each_body(world: World, change: Callable[[Body], Body]) -> World:
    return replace(world, bodies=tuple(change(body) for body in world.bodies))


def each_joint(world: World, **changes: Any) -> World:
    return replace(world, joints=tuple(replace(joint, **changes) for joint in world.joints))


def each_motor(world: World, **changes: Any) -> World:
    joints = (replace(joint, motor=joint.motor and replace(joint.motor, **changes)) for joint in world.joints)
    return replace(world, joints=tuple(joints))


def larger(body: Body) -> Body:
    if isinstance(body.shape, Sphere):
        return replace(body, shape=Sphere(1.1 * body.shape.radius_m))
    assert isinstance(body.shape, Box)
    x, y, z = body.shape.size_m
    return replace(body, shape=Box((1.1 * x, 1.1 * y, 1.1 * z)))


def in_parts(world: World, extra: Shape, center_m: Vector = (0.0, 0.0, 0.0)) -> World:
    """Each foot with a further shape below it, and an inertia of its own."""

    def change(body: Body) -> Body:
        if not isinstance(body.shape, Sphere):
            return body
        x, y, z = body.center_m
        parts = (*body.parts, Part(extra, (x, y, z - 0.01)))
        center = (x + center_m[0], y + center_m[1], z + center_m[2])
        return replace(body, shape=parts, center_m=center, inertia=Inertia((1e-3, 1e-3, 1e-3)))

    return each_body(world, change)


def with_pd(world: World, **changes: Any) -> World:
    motor = PDMotor(**{"follows": "position", "max_torque_nm": 8.0, "kp": 20.0, "kd": 0.5, **changes})
    return replace(world, joints=tuple(replace(joint, motor=joint.motor and motor) for joint in world.joints))


TURN = (0.0, 0.0, 0.1, 0.99**0.5)
WITH_OR_WITHOUT: dict[str, tuple[Callable[[World], World], Callable[[World], World]]] = {
    "body.center_m": (
        lambda world: in_parts(world, Sphere(0.02)),
        lambda world: in_parts(world, Sphere(0.02), (0.02, 0.0, 0.0)),
    ),
    "body.inertia": (
        lambda world: world,
        lambda world: each_body(world, lambda body: replace(body, inertia=Inertia((0.01, 0.01, 0.01)))),
    ),
    "body.parts": (lambda world: world, lambda world: in_parts(world, Sphere(0.025))),
    "fixed": (lambda world: world, lambda world: replace(world, fixed=True, observed=world.bodies[-1].name)),
    "gravity_tilt_rad": (lambda world: world, lambda world: replace(world, gravity_tilt_rad=(0.05, -0.1))),
    "ground_m": (lambda world: world, lambda world: replace(world, ground_m=-0.02)),
    "joint.armature": (lambda world: world, lambda world: each_joint(world, armature=0.01)),
    "joint.damping": (lambda world: world, lambda world: each_joint(world, damping=0.5)),
    "joint.dry_friction": (lambda world: world, lambda world: each_joint(world, dry_friction=1.0)),
    "joint.limits": (lambda world: world, lambda world: each_joint(world, limits=(-0.1, 0.1))),
    "joint.slides": (lambda world: world, lambda world: each_joint(world, slides=True)),
    "joint.start": (lambda world: world, lambda world: each_joint(world, start=0.2)),
    "joint.static_friction": (lambda world: world, lambda world: each_joint(world, static_friction=1.0)),
    "joint.stribeck_speed": (
        lambda world: each_joint(world, static_friction=1.0),
        lambda world: each_joint(world, static_friction=1.0, stribeck_speed=1.0),
    ),
    "joint.turn": (lambda world: world, lambda world: each_joint(world, turn=TURN)),
    "motor.delay_s": (with_pd, lambda world: with_pd(world, delay_s=0.1)),
    "motor.follows": (
        lambda world: with_pd(world, max_torque_nm=0.02),  # a torque alone turns a limb faster and faster
        lambda world: with_pd(world, max_torque_nm=0.02, follows="torque"),
    ),
    "motor.kd": (with_pd, lambda world: with_pd(world, kd=1.0)),
    "motor.kp": (with_pd, lambda world: with_pd(world, kp=10.0)),
    "noise.start_tilt_rad": (
        lambda world: world,
        lambda world: replace(world, noise=replace(world.noise, start_tilt_rad=0.05)),
    ),
    "observed": (lambda world: world, lambda world: replace(world, observed=world.bodies[-1].name)),
    "shape.capsule": (
        lambda world: in_parts(world, Sphere(0.02)),
        lambda world: in_parts(world, Capsule(0.02, 0.03)),
    ),
    "shape.cylinder": (
        lambda world: in_parts(world, Sphere(0.02)),
        lambda world: in_parts(world, Cylinder(0.03, 0.04)),
    ),
    "shape.hull": (
        lambda world: in_parts(world, Sphere(0.02)),
        lambda world: in_parts(world, Hull(((0.03, 0, 0), (-0.03, 0.03, 0), (-0.03, -0.03, 0), (0, 0, -0.03)))),
    ),
    "slope_rad": (lambda world: world, lambda world: replace(world, slope_rad=0.1)),
    "start_turn": (lambda world: world, lambda world: replace(world, start_turn=TURN)),
    "surfaces": (
        lambda world: world,
        lambda world: replace(
            each_body(world, lambda body: replace(body, surface="ice")), surfaces=(("ice", Material(0.1, 0.05)),)
        ),
    ),
}
"""Two worlds that differ in a field that not every world has."""


EDITS: dict[str, Callable[[World], World]] = {
    "material.static_friction": lambda world: replace(world, material=replace(world.material, static_friction=1.3)),
    "material.dynamic_friction": lambda world: replace(world, material=replace(world.material, dynamic_friction=0.4)),
    "material.restitution": lambda world: replace(world, material=replace(world.material, restitution=0.5)),
    "body.mass_kg": lambda world: each_body(world, lambda body: replace(body, mass_kg=1.5 * body.mass_kg)),
    "body.shape": lambda world: each_body(world, larger),
    "motor.position_gain": lambda world: each_motor(world, position_gain=0.02),
    "motor.max_torque_nm": lambda world: each_motor(world, max_torque_nm=0.3),
    "motor.max_speed_rad_s": lambda world: each_motor(world, max_speed_rad_s=0.5),
    "start_height_m": lambda world: replace(world, start_height_m=world.start_height_m + 0.05),
    "gravity_m_s2": lambda world: replace(world, gravity_m_s2=1.62),
    "time_step_s": lambda world: replace(world, time_step_s=0.8 * world.time_step_s),
    "solver_iterations": lambda world: replace(world, solver_iterations=5),
}


def test_a_rollout_is_bit_equal_whatever_the_engine_ran_before(pair: Pair) -> None:
    expected = pair.roll()

    for edit in EDITS.values():
        pair.roll(edit(pair.robot.world))

    assert np.array_equal(pair.roll(), expected)


def test_feet_that_end_near_their_start_leave_nothing_to_the_next_rollout(embodied: Pair) -> None:
    """A contact point that stays in the engine's memory would push the next robot with its old impulse."""
    expected = embodied.roll()
    turned = np.zeros(len(embodied.robot.world.actuators))
    turned[::3] = 0.4
    for end_s in (0.3, 0.5):
        embodied.engine.rollout(embodied.robot.world, Motion(np.array([0.0]), turned[None], np.array([end_s])))
        assert np.array_equal(embodied.roll(), expected)


def test_engines_in_one_process_do_not_disturb_each_other(pair: Pair) -> None:
    expected = pair.roll()
    other = Pair(type(pair.engine)(), pair.robot)

    other.roll(replace(pair.robot.world, material=Material(0.3, 0.1, 0.5)))

    assert np.array_equal(pair.roll(), expected)
    assert np.array_equal(other.roll(), expected)


def test_threads_that_share_an_engine_get_the_bits_of_one_after_the_other(pair: Pair) -> None:
    frictions = [0.3 + 0.1 * number for number in range(6)]
    worlds = [replace(pair.robot.world, material=Material(each, each)) for each in frictions]
    expected = [pair.roll(world) for world in worlds]

    with ThreadPoolExecutor(len(worlds)) as pool:
        found = list(pool.map(pair.roll, worlds))

    assert np.array_equal(found, expected)


SCRIPT = """
from gaplab.services.world.robots import robots
from gaplab.services.engines import engines
engine, robot = engines[{engine!r}](), robots[{robot!r}]()
trajectory = engine.rollout(robot.world, robot.motion(robot.known))
print("bits:" + trajectory.positions_m.tobytes().hex())
"""


def test_a_rollout_is_bit_equal_in_a_fresh_process(pair: Pair) -> None:
    script = SCRIPT.format(engine=pair.engine.name, robot=pair.robot.name)
    for edit in EDITS.values():
        pair.roll(edit(pair.robot.world))

    fresh = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout

    here = pair.engine.rollout(pair.robot.world, pair.robot.motion(pair.robot.known)).positions_m
    assert fresh.split("bits:")[1].split()[0] == here.tobytes().hex()


def test_every_honoured_field_changes_a_trajectory(pair: Pair) -> None:
    expected = pair.roll()

    fields = pair.engine.honours - WITH_OR_WITHOUT.keys()
    ignored = [field for field in fields if np.array_equal(pair.roll(edited(pair, field)), expected)]

    assert ignored == []


@pytest.mark.parametrize("field", USES)
def test_every_honoured_field_that_a_world_may_use_changes_a_trajectory(embodied: Pair, field: str) -> None:
    without, used = (change(embodied.robot.world) for change in WITH_OR_WITHOUT[field])
    if lacked := embodied.engine.lacks(used):
        pytest.skip(f"{embodied.engine.name} does not honour {', '.join(lacked)}")

    one, other = embodied.roll(without), embodied.roll(used)

    assert USES[field](used)
    assert np.isfinite(one).all()
    assert np.isfinite(other).all()
    assert not np.array_equal(one, other)


def test_an_engine_lacks_what_it_does_not_honour_and_a_world_uses(pair: Pair) -> None:
    class Basic(type(pair.engine)):  # type: ignore[misc]
        honours = pair.engine.honours - {"slope_rad", "joint.damping"}

    world = pair.robot.world
    assert Basic.lacks(world) == ()
    assert Basic.lacks(replace(world, slope_rad=0.1)) == ("slope_rad",)
    if world.joints:
        assert Basic.lacks(each_joint(replace(world, slope_rad=0.1), damping=0.1)) == ("joint.damping", "slope_rad")


def edited(pair: Pair, field: str) -> World:
    """The world with the field changed: by the tunable that edits it, else by the table above."""
    if field in EDITS:
        return EDITS[field](pair.robot.world)
    tunable = next(each for each in tunables.values() if each.field == field)()
    return tunable.edit(pair.robot.world, 0.5 * (tunable.lower + tunable.upper))


def test_a_tunable_of_a_field_that_is_not_honoured_changes_nothing(pair: Pair) -> None:
    expected = pair.roll()

    in_motions = {"noise"}  # of any engine
    for tunable in (each() for each in tunables.values() if each.field not in pair.engine.honours | in_motions):
        for value in (tunable.lower, tunable.upper):
            assert np.array_equal(pair.roll(tunable.edit(pair.robot.world, value)), expected), tunable.name


def test_a_trajectory_has_a_pose_for_each_observation(pair: Pair) -> None:
    motion = pair.robot.motion(pair.robot.known)

    trajectory = pair.engine.rollout(pair.robot.world, motion)

    count = len(motion.observe_s)
    assert np.array_equal(trajectory.times_s, motion.observe_s)
    assert trajectory.positions_m.shape == (count, 3)
    assert trajectory.orientations.shape == (count, 4)
    assert np.isfinite(pair.robot.fitness(trajectory))


def test_static_friction_below_dynamic_friction_acts_as_if_equal_to_it(embodied: Pair) -> None:
    below, equal = (
        embodied.roll(replace(embodied.robot.world, material=Material(static, 0.8))) for static in (0.2, 0.8)
    )

    assert np.array_equal(below, equal)


def test_more_worlds_than_are_kept_warm_give_the_same_numbers(embodied: Pair) -> None:
    worlds = [replace(embodied.robot.world, gravity_m_s2=9.0 + number / 10) for number in range(WARM_SCENES + 3)]
    expected = [embodied.roll(world) for world in worlds]

    assert np.array_equal([embodied.roll(world) for world in worlds], expected)


def test_targets_may_change_between_time_steps_and_after_the_last_observation(embodied: Pair) -> None:
    motion = open_loop(embodied.robot.motion(embodied.robot.known))
    late = replace(
        motion,
        times_s=np.append(motion.times_s, [100.0, 100.0001]),
        targets=np.vstack([motion.targets, motion.targets[:2]]),
    )

    changed, expected = (embodied.engine.rollout(embodied.robot.world, each) for each in (late, motion))

    assert np.array_equal(flat(changed), flat(expected))


def test_looking_more_often_changes_nothing_that_is_seen_and_time_zero_is_the_start(embodied: Pair) -> None:
    world, motion = embodied.robot.world, open_loop(embodied.robot.motion(embodied.robot.known))
    often = replace(motion, observe_s=np.arange(0.0, 3.0001, 0.1))

    seen, expected = (embodied.engine.rollout(world, each) for each in (often, motion))

    numbers = np.round(motion.observe_s / 0.1).astype(int)
    assert np.array_equal(seen.positions_m[numbers], expected.positions_m)
    assert seen.positions_m[0] == pytest.approx([0.0, 0.0, world.start_height_m])
    assert seen.orientations[0] == pytest.approx([0.0, 0.0, 0.0, 1.0])


def bend(_: Any, seen: FloatArray, memory: FloatArray, now_s: float) -> tuple[FloatArray, FloatArray]:
    return 0.5 * seen + 0.1 * np.sin(now_s), memory


def begun(world: World, seconds: FloatArray, *, loops: bool, start: Start | None) -> Motion | Loop:
    """A motion, or a loop, whose targets depend on what it does."""
    count = len(world.actuators)
    if not loops:
        return Motion(np.zeros(1), np.full((1, count), 0.2), seconds, start=start)
    return Loop(bend, ("angles",), np.zeros(1), NO_MEMORY, 0.03, seconds, latency_s=0.01, start=start)


@pytest.mark.parametrize("loops", [False, True])
def test_encoders_and_starts_are_those_of_each_rollout_alone_and_encoders_move_nothing(
    embodied: Pair, loops: bool
) -> None:
    engine, world = embodied.engine, with_pd(embodied.robot.world, delay_s=0.05)
    angles, speeds = np.linspace(-0.3, 0.3, 2 * len(world.joints)).reshape(2, -1).tolist()
    thrown = Start((0.1, 0.0, 0.6), TURN, (1.0, 0.5, 2.0), (1.0, -2.0, 3.0), tuple(angles), tuple(speeds))
    bent, seconds = Start(angles_rad=tuple(angles)), np.array([0.0, 0.02, 0.5, 1.0])
    motions = [begun(world, seconds, loops=loops, start=start) for start in (thrown, None, bent)]
    worlds = [world, world.edited("ground_m", ground_m=-0.05)]

    blind = engine.rollouts(worlds, motions)
    told = engine.rollouts(worlds, [motion.observed_at(seconds, joints=True) for motion in motions])
    twice = engine.rollouts(worlds, [motion.observed_at(seconds, joints=True) for motion in motions])

    assert blind.angles_rad is None
    assert np.array_equal(flat(blind), flat(told))
    assert len({path.tobytes() for path in told.positions_m.reshape(6, -1)}) == 6
    assert told.angles_rad is not None
    assert told.torques_nm is not None
    assert told.angles_rad[:, 0, 0] == pytest.approx(np.array([angles, [0.0] * len(angles), angles]), abs=1e-6)
    assert np.abs(told.torques_nm[:, :, 0]).max() == 0.0
    assert np.abs(told.torques_nm[:, :, -1]).max(axis=-1).min() > 0.0
    for row, motion in enumerate(motions):
        for column, each in enumerate(worlds):
            alone = engine.rollout(each, motion.observed_at(seconds, joints=True))
            recorded = engine.record(each, motion, seconds)
            for name in ("positions_m", "orientations", "angles_rad", "speeds_rad_s", "torques_nm"):
                assert np.array_equal(getattr(alone, name), getattr(told, name)[row, column])
                assert np.array_equal(getattr(twice, name), getattr(told, name))
            assert np.array_equal(recorded.angles_rad, alone.angles_rad)
            assert np.array_equal(recorded.torques_nm, alone.torques_nm)


def test_a_start_of_another_robot_is_refused(embodied: Pair) -> None:
    world, seconds = embodied.robot.world, np.array([0.5])
    fixed = replace(world, fixed=True, observed=world.bodies[-1].name)

    for here, start, why in (
        (world, Start(angles_rad=(0.1,)), "starts 1 joints, but the robot has"),
        (world, Start(speeds_rad_s=(0.1,) * 99), "starts 99 joints"),
        (fixed, Start(velocity_m_s=(1.0, 0.0, 0.0)), "it never moves"),
    ):
        with pytest.raises(PluginBroken, match=why):
            embodied.engine.rollouts([here], [begun(here, seconds, loops=False, start=start)])


def test_the_pose_is_of_the_bodys_frame_not_of_its_center_of_mass(embodied: Pair) -> None:
    box = Body("box", 1.0, Box((0.1, 0.1, 0.1)), center_m=(0.0, 0.0, 0.05))
    still = Motion(np.zeros(1), np.zeros((1, 0)), np.array([0.0, 1.0]))

    heights = embodied.engine.rollout(World(bodies=(box,), start_height_m=0.0), still).positions_m[:, 2]

    assert heights == pytest.approx(0.0, abs=2e-3)


def test_importing_the_engines_loads_none_of_their_libraries() -> None:
    script = """
import sys
from gaplab.services.engines import engines
assert list(engines)
assert not {"pybullet", "mujoco", "numba", "sapien"} & set(sys.modules)
"""

    subprocess.run([sys.executable, "-c", script], check=True)


def test_a_robot_left_alone_stands_still_at_the_height_of_its_legs(embodied: Pair) -> None:
    actuators = len(embodied.robot.world.actuators)
    alone = Motion(np.zeros(1), np.zeros((1, actuators)), np.array([1.0, 2.0]))

    trajectory = embodied.engine.rollout(embodied.robot.world, alone)

    early, late = trajectory.positions_m
    assert late[2] == pytest.approx(embodied.robot.world.start_height_m, abs=0.02)
    assert np.linalg.norm(late - early) < 0.01
    assert abs(trajectory.orientations[-1, 3]) > np.cos(np.radians(5) / 2)


@pytest.mark.parametrize("gravity_m_s2", [-1e4, 1e9, 1e300])
def test_physics_that_blows_up_is_nan_and_harms_no_later_rollout(embodied: Pair, gravity_m_s2: float) -> None:
    expected = embodied.roll()

    blown_up = embodied.roll(replace(embodied.robot.world, gravity_m_s2=gravity_m_s2))

    assert np.all(np.isnan(blown_up))
    assert np.array_equal(embodied.roll(), expected)


def test_a_rollout_whose_energy_explodes_is_nan_and_harms_no_later_one(
    embodied: Pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = embodied.roll()

    with monkeypatch.context() as without_limbs:  # so nothing pushes the robot
        none = np.zeros((len(embodied.robot.world.bodies), 1 + len(embodied.robot.world.joints)))
        without_limbs.setattr(Energy, "levers_m", property(lambda _: none))
        exploded = embodied.roll()

    assert np.all(np.isnan(exploded))
    assert np.array_equal(embodied.roll(), expected)


def test_a_motion_of_another_robot_is_refused_with_the_names_of_the_actuators(embodied: Pair) -> None:
    world = embodied.robot.world
    motion = open_loop(embodied.robot.motion(embodied.robot.known))
    names = ", ".join(joint.name for joint in world.actuators)

    for targets in (motion.targets[:, :1], np.hstack([motion.targets, motion.targets])):
        with pytest.raises(PluginBroken, match=f"has {targets.shape[1]} targets at a time, but .*: {names}; give"):
            embodied.engine.rollouts([world], [replace(motion, targets=targets)])


def test_targets_that_are_no_numbers_give_nan_and_harm_no_later_rollout(embodied: Pair) -> None:
    expected = embodied.roll()
    motion = open_loop(embodied.robot.motion(embodied.robot.known))

    lost = embodied.engine.rollout(embodied.robot.world, replace(motion, targets=np.full_like(motion.targets, np.nan)))

    assert np.all(np.isnan(flat(lost)))
    assert np.array_equal(embodied.roll(), expected)
