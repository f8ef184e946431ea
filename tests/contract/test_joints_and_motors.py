"""Joints and motors of every engine against the textbook."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.base import Engine
from gaplab.services.world.kinematics import about, product
from gaplab.services.world.motions import Start
from gaplab.services.world.world import (
    UNTURNED,
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Inertia,
    Joint,
    Part,
    PDMotor,
    Shape,
    Sphere,
    World,
)
from tests.contract.textbook import (
    FRAME,
    LOAD,
    STEP_S,
    G,
    X,
    Y,
    Z,
    angles,
    changing,
    engine,
    held,
    honoured,
    positions,
    rig,
    times,
)

__all__ = ["engine"]

KG = LOAD.mass_kg
MOMENT = KG / 12 * (0.1**2 + 0.3**2)  # of the load about y
PUSH = PDMotor("torque", max_torque_nm=100.0)
QUARTER = (0.7071067811865476, 0.0, 0.0, 0.7071067811865476)


def test_a_push_against_damping_ends_at_their_balance_and_a_slide_runs_out(engine: Engine) -> None:
    push, damping = 6.0, 3.0
    world = rig(axis=X, slides=True, damping=damping, motor=PUSH)
    seen = times(3.0, 60)

    x = angles(engine, world, changing(seen, {0.0: push, 1.5: 0.0}))

    decay = KG / damping
    top = push / damping * (1 - np.exp(-1.5 / decay))
    pushed = push / damping * (seen - decay * (1 - np.exp(-seen / decay)))
    at_end = push / damping * (1.5 - decay * (1 - np.exp(-1.5 / decay)))
    expected = np.where(seen <= 1.5, pushed, at_end + top * decay * (1 - np.exp(-(seen - 1.5) / decay)))
    assert x == pytest.approx(expected, rel=0.01, abs=2 * STEP_S * top)


def test_damping_far_stronger_than_a_step_can_follow_is_stable(engine: Engine) -> None:
    world = rig(axis=X, slides=True, damping=1e5, motor=PUSH)

    x = angles(engine, world, held(times(1.0), 50.0))

    assert x == pytest.approx(50.0 / 1e5 * times(1.0), rel=0.2, abs=1e-5)


@pytest.mark.parametrize("slides", [True, False])
@pytest.mark.parametrize("push", [20.0, -20.0])
def test_a_joint_stays_within_its_limits(engine: Engine, slides: bool, push: float) -> None:
    world = rig(axis=Y, slides=slides, limits=(-0.3, 0.2), motor=PUSH, damping=5.0)

    reached = angles(engine, world, held(times(2.0), push))

    assert reached[-1] == pytest.approx(0.2 if push > 0 else -0.3, abs=0.01)
    assert np.all((reached > -0.33) & (reached < 0.23))


def test_a_joint_moves_freely_within_its_limits(engine: Engine) -> None:
    seen = times(0.3)
    wide = rig(limits=(-1.0, 1.0), motor=PUSH)

    turned = angles(engine, wide, held(seen, 0.1))

    assert turned == pytest.approx(0.5 * 0.1 / MOMENT * seen * (seen + STEP_S), rel=0.02)


@pytest.mark.parametrize("slides", [True, False])
def test_dry_friction_holds_below_its_threshold_and_brakes_above(engine: Engine, slides: bool) -> None:
    inertia = KG if slides else MOMENT
    friction = 4.0 * inertia
    world = rig(slides=slides, dry_friction=friction, motor=PUSH)
    seen = times(0.5)

    below = angles(engine, world, held(seen, 0.9 * friction))
    above = angles(engine, world, held(seen, 1.5 * friction))

    assert np.abs(below).max() < 2e-3
    assert above == pytest.approx(0.5 * 0.5 * friction / inertia * seen**2, rel=0.05, abs=0.01)


@pytest.mark.parametrize("dry", [0.0, 2.0])
def test_a_joint_that_sticks_breaks_loose_and_then_has_its_dry_friction(engine: Engine, dry: float) -> None:
    static, stribeck = 3.0, 0.2
    world = rig(axis=X, slides=True, dry_friction=dry, static_friction=static, stribeck_speed=stribeck, motor=PUSH)
    seen = times(0.5)

    below = angles(engine, world, held(seen, 0.9 * (dry + static)))
    above = angles(engine, world, held(seen, 1.3 * (dry + static)))

    def moves(_: float, state: FloatArray) -> list[float]:
        friction = dry + static * np.exp(-((state[1] / stribeck) ** 2))
        return [state[1], (1.3 * (dry + static) - friction) / KG]

    expected = solve_ivp(moves, (0, seen[-1]), [0.0, 0.0], t_eval=seen, rtol=1e-8).y[0]
    assert np.abs(below).max() < 2e-3
    assert above == pytest.approx(expected, rel=0.05, abs=0.01)


def test_a_pendulum_swings_on_from_the_angle_and_the_speed_that_a_motion_begins_with(engine: Engine) -> None:
    reach, start = 0.4, Start(angles_rad=(2.0,), speeds_rad_s=(3.0,))
    bob = Body("bob", 1.0, Sphere(0.05), (0.0, 0.0, -reach), collides=False)
    world = replace(rig(bob, gravity_m_s2=G, start=0.3), time_step_s=1 / 2000)
    seen = np.arange(0, 1.0001, 0.1)

    told = engine.rollout(world, replace(held(seen), start=start, joints=True))

    pull = reach * G / (0.4 * 0.05**2 + reach**2)
    swung = solve_ivp(lambda _, y: [y[1], -pull * np.sin(y[0])], (0, 1.1), [2.0, 3.0], t_eval=seen, rtol=1e-9).y
    assert told.angles_rad is not None
    assert told.speeds_rad_s is not None
    assert told.angles_rad[:, 0] == pytest.approx(swung[0], abs=0.01)
    assert told.speeds_rad_s[:, 0] == pytest.approx(swung[1], abs=0.05)


def test_dry_friction_stops_what_slides(engine: Engine) -> None:
    world = rig(axis=X, slides=True, dry_friction=4.0, motor=PUSH)

    x = angles(engine, world, changing(np.array([0.5, 2.0, 3.0]), {0.0: 8.0, 0.5: 0.0}))

    assert x[2] == pytest.approx(x[1], abs=2e-3)
    assert x[1] == pytest.approx(2 * x[0], rel=0.05)  # braked as it was pushed, with 4 N


def test_an_armature_turns_with_its_joint(engine: Engine) -> None:
    seen = times(0.5)

    turned = angles(engine, rig(armature=2 * MOMENT, motor=PUSH), held(seen, 0.3))

    assert turned == pytest.approx(0.5 * 0.3 / (3 * MOMENT) * seen * (seen + STEP_S), rel=0.02)


def test_an_armature_slows_a_pendulum_but_weighs_nothing(engine: Engine) -> None:
    bob = Body("bob", 1.0, Sphere(0.05), (0.0, 0.0, -0.4), collides=False)
    swing = rig(bob, gravity_m_s2=G, start=0.1, armature=0.3)

    about_joint = 0.4 * 0.05**2 + 0.4**2 + 0.3
    assert period(engine, swing) == pytest.approx(2 * np.pi * np.sqrt(about_joint / (G * 0.4)), rel=0.01)


def period(engine: Engine, world: object) -> float:
    """Of a small swing that begins at its widest: four times the time to its first crossing of zero."""
    seen = np.arange(1, 480) * STEP_S
    swung = angles(engine, world, held(seen))  # type: ignore[arg-type]
    first = int(np.argmax(swung <= 0))
    assert first > 0
    share = swung[first - 1] / (swung[first - 1] - swung[first])
    return float(4 * (seen[first - 1] + share * STEP_S))


@pytest.mark.parametrize("turn", [UNTURNED, tuple(about(np.array(Z), np.array([0.6]))[0].tolist())])
def test_a_body_of_parts_swings_by_its_moments_of_inertia(engine: Engine, turn: tuple[float, ...]) -> None:
    moments, reach = (0.02, 0.05, 0.04), 0.3
    parts = (Part(Box((0.1, 0.1, 0.1))), Part(Sphere(0.05), (0.0, 0.0, -0.5)))
    bob = Body("bob", 2.0, parts, (0.0, 0.0, -reach), inertia=Inertia(moments, turn))  # type: ignore[arg-type]
    angle = 2 * np.arctan2(turn[2], turn[3])
    about_y = moments[0] * np.sin(angle) ** 2 + moments[1] * np.cos(angle) ** 2

    found = period(engine, rig(bob, gravity_m_s2=G, start=0.1))

    assert found == pytest.approx(2 * np.pi * np.sqrt((about_y + 2.0 * reach**2) / (2.0 * G * reach)), rel=0.01)


SOLIDS: list[tuple[Shape, float]] = [
    (Sphere(0.1), 0.4 * 0.1**2),
    (Box((0.1, 0.2, 0.3)), (0.1**2 + 0.3**2) / 12),
    (Cylinder(0.1, 0.4), (3 * 0.1**2 + 0.4**2) / 12),
    (Capsule(0.1, 0.3), 0.01853846),
    (
        Hull(tuple((x, y, z) for x in (-0.05, 0.05) for y in (-0.1, 0.1) for z in (-0.15, 0.15))),
        (0.1**2 + 0.3**2) / 12,
    ),
]


@pytest.mark.parametrize(("shape", "moment"), SOLIDS, ids=lambda each: type(each).__name__)
def test_a_solid_turns_by_the_inertia_of_its_shape(engine: Engine, shape: Shape, moment: float) -> None:
    seen = times(0.5)
    world = rig(Body("solid", 2.0, shape, collides=False), motor=PUSH)

    turned = angles(engine, world, held(seen, 0.1))

    assert turned == pytest.approx(0.5 * 0.1 / (2 * moment) * seen * (seen + STEP_S), rel=0.02)


@pytest.mark.parametrize("kp", [100.0, 2000.0])
def test_a_position_motor_sags_by_the_load_over_its_stiffness(engine: Engine, kp: float) -> None:
    motor = PDMotor("position", 1e3, kp=kp, kd=2 * np.sqrt(kp * KG))
    world = rig(gravity_m_s2=G, axis=Z, slides=True, motor=motor)

    z = angles(engine, world, held(np.array([2.0, 3.0]), 0.1))

    assert z == pytest.approx(0.1 - KG * G / kp, abs=0.02 * KG * G / kp)


def test_a_position_motor_swings_like_a_damped_spring(engine: Engine) -> None:
    kp, kd = 50.0, 2.0
    world = replace(rig(axis=X, slides=True, motor=PDMotor("position", 1e3, kp=kp, kd=kd)), time_step_s=1 / 1000)
    seen = np.arange(1, 21) * 0.1

    x = angles(engine, world, held(seen, 1.0))

    fades, turns = kd / (2 * KG), np.sqrt(kp / KG - (kd / (2 * KG)) ** 2)
    expected = 1 - np.exp(-fades * seen) * (np.cos(turns * seen) + fades / turns * np.sin(turns * seen))
    assert x == pytest.approx(expected, abs=0.03)


def test_a_motor_stiffer_than_a_step_can_follow_is_stable(engine: Engine) -> None:
    world = rig(motor=PDMotor("position", 1e6, kp=1e6, kd=10.0))

    turned = angles(engine, world, held(times(1.0), 0.5))

    assert turned[1:] == pytest.approx(0.5, abs=0.05)


def test_light_legs_with_strong_motors_keep_their_shape(engine: Engine) -> None:
    """Joints that move each other, and are moved by the ground: four legs, stiffer than a step can follow."""
    bodies, joints = [Body("trunk", 8.0, Box((0.4, 0.2, 0.1)))], []
    motor = PDMotor("position", 100.0, kp=300.0, kd=5.0)
    for leg, (x, y) in enumerate([(0.2, 0.15), (0.2, -0.15), (-0.2, 0.15), (-0.2, -0.15)]):
        thigh, shin = f"thigh {leg}", f"shin {leg}"
        bodies.append(Body(thigh, 0.5, Box((0.03, 0.03, 0.2)), (0.0, 0.0, -0.1), collides=False))
        bodies.append(Body(shin, 0.05, Capsule(0.01, 0.2), (0.0, 0.0, -0.1)))
        joints.append(Joint(f"hip {leg}", "trunk", thigh, (x, y, 0.0), Y, motor, start=0.5))
        joints.append(Joint(f"knee {leg}", thigh, shin, (0.0, 0.0, -0.2), Y, motor, start=-0.7))
    starts = [joint.start for joint in joints]
    world = World(tuple(bodies), tuple(joints), start_height_m=0.5, start_turn=QUARTER, time_step_s=STEP_S)
    honoured(engine, world)

    recorded = engine.record(world, held(times(3.0, 40), *starts), times(3.0, 40))

    assert recorded.angles_rad is None or np.abs(recorded.angles_rad - starts).max() < 0.2
    assert recorded.angles_rad is None or np.abs(recorded.angles_rad[-10:] - starts).max() < 0.05
    assert np.linalg.norm(recorded.poses[-1, :3]) < 2.0
    assert np.ptp(recorded.poses[-10:, :3], axis=0).max() < 0.02


def test_a_motor_gives_no_more_than_its_largest_torque(engine: Engine) -> None:
    seen = times(0.5)
    world = rig(axis=X, slides=True, motor=PDMotor("position", 3.0, kp=1e4, kd=1.0))

    x = angles(engine, world, held(seen, 100.0))

    assert x == pytest.approx(0.5 * 3.0 / KG * seen * (seen + STEP_S), rel=0.02, abs=2e-5)


def test_a_velocity_motor_is_slowed_by_its_load_over_its_gain(engine: Engine) -> None:
    world = rig(gravity_m_s2=G, axis=Z, slides=True, motor=PDMotor("velocity", 1e3, kd=100.0))

    z = angles(engine, world, held(np.array([1.0, 2.0]), 0.5))

    assert z[1] - z[0] == pytest.approx(0.5 - KG * G / 100.0, abs=0.005)


@pytest.mark.parametrize("slides", [True, False])
def test_a_torque_motor_accelerates_evenly(engine: Engine, slides: bool) -> None:
    seen = times(0.4)

    moved = angles(engine, rig(slides=slides, motor=PUSH), held(seen, 0.2))

    inertia = KG if slides else MOMENT
    assert moved == pytest.approx(0.5 * 0.2 / inertia * seen * (seen + STEP_S), rel=0.02)


def test_a_recording_tells_the_torque_of_a_pd_motor(engine: Engine) -> None:
    world = rig(gravity_m_s2=G, axis=Z, slides=True, motor=PDMotor("position", 1e3, kp=500.0, kd=60.0))
    honoured(engine, world)

    torques = engine.record(world, held(np.array([3.0]), 0.0), np.array([0.0, 3.0])).torques_nm

    if torques is None:
        pytest.skip(f"{engine.name} does not tell torques")
    assert torques[:, 0] == pytest.approx([0.0, KG * G], rel=0.01)


@pytest.mark.parametrize(
    "motor",
    [PDMotor("torque", 100.0), PDMotor("velocity", 100.0, kd=5.0), PDMotor("position", 100.0, kp=50.0, kd=2.0)],
    ids=lambda motor: motor.follows,
)
def test_a_motor_follows_its_commands_late_by_its_delay(engine: Engine, motor: PDMotor) -> None:
    delay_s = 24 * STEP_S
    seen = delay_s + times(0.5)
    early, late = (rig(motor=each, start=0.2) for each in (motor, replace(motor, delay_s=delay_s)))

    soon = angles(engine, early, changing(seen - delay_s, {0.0: 0.3, 0.25: -0.2}))
    delayed = angles(engine, late, changing(seen, {0.0: 0.3, 0.25: -0.2}))

    assert np.ptp(soon) > 1e-3
    assert delayed == pytest.approx(soon, abs=1e-5)


def test_a_fixed_base_never_moves_and_its_arm_falls(engine: Engine) -> None:
    arm = Body("arm", 1.0, Sphere(0.05), (0.3, 0.0, 0.0), collides=False)
    world = replace(rig(arm, gravity_m_s2=G), observed="")
    seen = times(0.5)

    honoured(engine, world)
    recorded = engine.record(world, held(seen), seen)

    assert np.ptp(recorded.trajectory.positions_m, axis=0) == pytest.approx(0, abs=1e-9)
    assert recorded.trajectory.orientations == pytest.approx(np.tile(UNTURNED, (len(seen), 1)))
    assert recorded.angles_rad is None or recorded.angles_rad[-1, 0] > 0.3


def test_joints_begin_at_their_starts(engine: Engine) -> None:
    start, reach = 0.7, 0.3
    arm = Body("arm", 1.0, Sphere(0.05), (0.0, 0.0, -reach), collides=False)
    hand = Body("hand", 0.1, Sphere(0.05), collides=False)
    world = rig(arm, start=start, motor=PDMotor("position", 10.0, kp=100.0, kd=10.0))
    slide = replace(world.joints[0], name="slide", parent="arm", child="hand", axis=Z, slides=True, start=-0.2)
    world = replace(world, bodies=(*world.bodies, hand), joints=(*world.joints, slide), observed="hand")
    honoured(engine, world)

    seen = engine.rollout(world, held(np.array([0.0, 1.0]), start, -0.2))

    expected = [-0.2 * np.sin(start), 0.0, 5.0 - 0.2 * np.cos(start)]
    assert seen.positions_m == pytest.approx(np.array([expected, expected]), abs=2e-3)
    assert seen.orientations[0] == pytest.approx(about(np.array(Y), np.array([start]))[0], abs=1e-5)


def test_a_turned_joint_turns_its_child(engine: Engine) -> None:
    """The same pendulum, described in a frame that is turned, swings alike."""
    turn = about(np.array(Z), np.array([np.pi / 3]))[0]
    bob = Body("bob", 1.0, Sphere(0.05), (0.2, 0.0, -0.3), collides=False)
    plain = rig(bob, gravity_m_s2=G)
    axis = (np.sin(np.pi / 3), np.cos(np.pi / 3), 0.0)
    center = (0.2 * np.cos(np.pi / 3), -0.2 * np.sin(np.pi / 3), -0.3)
    turned = rig(replace(bob, center_m=center), gravity_m_s2=G, turn=tuple(turn.tolist()), axis=axis)
    seen = times(1.0)

    honoured(engine, turned)
    one, other = (engine.rollout(world, held(seen)) for world in (plain, turned))

    assert np.ptp(one.orientations, axis=0).max() > 0.1
    assert other.positions_m == pytest.approx(one.positions_m, abs=1e-4)
    alike = product(one.orientations, turn)
    assert np.abs(np.sum(alike * other.orientations, axis=1)) == pytest.approx(1, abs=1e-4)


def test_what_is_observed_is_where_its_joints_carry_it(engine: Engine) -> None:
    seen = times(0.5)
    world = rig(axis=X, slides=True, motor=PUSH, origin_m=(0.1, 0.2, 0.3))

    path = positions(engine, world, held(seen, 5.0))

    assert path[:, 0] == pytest.approx(0.1 + 0.5 * 5.0 / KG * seen * (seen + STEP_S), rel=0.01)
    assert path[:, 1:] == pytest.approx(np.tile([0.2, 5.3], (len(seen), 1)), abs=1e-5)
    assert FRAME.name not in world.observed
