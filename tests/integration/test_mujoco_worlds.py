"""Worlds of any robot in MuJoCo: in place, in batches, and with controllers in loops."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.mujoco import MuJoCo
from gaplab.services.engines.mujoco import engine as of_scenes
from gaplab.services.engines.mujoco import worlds as of_worlds
from gaplab.services.engines.mujoco.model import Structure, _inverse_inertias
from gaplab.services.engines.mujoco.model import compiled as compiled_once
from gaplab.services.engines.mujoco.worlds import Models
from gaplab.services.world.inertias import inverse_inertias
from gaplab.services.world.motions import Loop, Motion
from gaplab.services.world.world import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Inertia,
    Joint,
    Material,
    Motor,
    Part,
    PDMotor,
    Sphere,
    World,
)

mujoco = pytest.importorskip("mujoco")
pytest.importorskip("numba")

G, STEP_S = 9.81, 1 / 240
UPPER, LOWER = 0.15, 0.15
PD = PDMotor("position", 15.0, kp=40.0, kd=1.0)
ROD = Hull(tuple((x, y, z) for x in (-0.01, 0.01) for y in (-0.01, 0.01) for z in (-UPPER, 0.0)))


def walker(motor: Motor | PDMotor = PD, **joint: Any) -> World:
    """A trunk on four legs of two joints, with knees bent at the start."""
    values: dict[str, Any] = {"damping": 0.05, "dry_friction": 0.1, "armature": 0.005, **joint}
    trunk = (Part(Box((0.3, 0.2, 0.08))), Part(Capsule(0.03, 0.2), (0.0, 0.0, 0.05)))
    bodies = [Body("world", 3.0, trunk, inertia=Inertia((0.01, 0.03, 0.04)))]  # named as MuJoCo's ground
    joints = []
    for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        leg = f"{'front' if x > 0 else 'rear'} {'left' if y > 0 else 'right'}"
        shin = (Part(Cylinder(0.01, LOWER), (0.0, 0.0, -LOWER / 2), collides=False), Part(Sphere(0.02), (0, 0, -LOWER)))
        bodies += [
            Body(f"{leg} thigh", 0.4, (Part(ROD),), (0.0, 0.0, -0.05), inertia=Inertia((0.001, 0.001, 0.0001))),
            Body(f"{leg} shin", 0.2, shin, (0.0, 0.0, -0.08), inertia=Inertia((5e-4, 5e-4, 5e-5)), surface="foot"),
        ]
        hip = ("world", f"{leg} thigh", (0.13 * x, 0.1 * y, 0.0), (0.0, 1.0, 0.0), motor)
        knee = (f"{leg} thigh", f"{leg} shin", (0.0, 0.0, -UPPER), (0.0, 1.0, 0.0), motor)
        joints += [
            Joint(f"{leg} hip", *hip, start=0.6, limits=(-1.0, 2.0), **values),
            Joint(f"{leg} knee", *knee, start=-1.2, limits=(-2.5, -0.3), **values),
        ]
    return World(
        bodies=tuple(bodies),
        joints=tuple(joints),
        surfaces=(("foot", Material(0.9, 0.7)),),
        start_height_m=0.28,
        time_step_s=STEP_S,
    )


WORLD = walker()
STARTS = np.array([joint.start for joint in WORLD.joints])
TIMES_S = np.arange(0.0, 1.0, 0.05)
OBSERVE_S = np.array([0.5, 1.0])


def motion(seed: int) -> Motion:
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(STARTS))
    return Motion(TIMES_S, STARTS + 0.3 * np.sin(9 * TIMES_S[:, None] + phases), OBSERVE_S)


MOTIONS = [motion(seed) for seed in range(3)]


def simulators(count: int) -> list[World]:
    """Worlds that differ in masses, gains, friction, delay and limits, all in place."""
    worlds = []
    for factor in np.linspace(0.8, 1.2, count).tolist():
        bodies = tuple(replace(body, mass_kg=factor * body.mass_kg) for body in WORLD.bodies)
        motor = replace(PD, kp=PD.kp * factor, max_torque_nm=PD.max_torque_nm / factor, delay_s=0.02 * (factor > 1))
        changes: dict[str, Any] = {"motor": motor, "dry_friction": 0.2 * factor}
        joints = tuple(
            replace(joint, **changes, limits=None if factor < 0.9 else joint.limits) for joint in WORLD.joints
        )
        world = WORLD.edited("body.mass_kg", bodies=bodies).edited("motor.kp", joints=joints)
        worlds.append(world.edited("surfaces", surfaces=(("foot", Material(factor, 0.8 * factor)),)))
    return worlds


def paths(engine: MuJoCo, worlds: list[World], motions: Any) -> FloatArray:
    seen = engine.rollouts(worlds, motions)
    return np.concatenate([seen.positions_m, seen.orientations], axis=-1)


@pytest.fixture
def engine() -> Iterator[MuJoCo]:
    engine = MuJoCo()
    yield engine
    engine.close()


def wave(genomes: FloatArray, seen: FloatArray, memories: FloatArray, time_s: float) -> tuple[FloatArray, FloatArray]:
    """A reflex, row by row: each joint follows a wave, and gives way with what it feels."""
    felt = np.tanh(genomes * seen[:, : genomes.shape[1]] + 0.3 * seen[:, -4:-3])
    memories = 0.9 * memories + 0.1 * felt
    return STARTS + 0.2 * np.sin(9 * time_s + genomes) + 0.1 * memories, memories


def loops(count: int, latency_s: float = 0.0) -> list[Loop]:
    genomes = np.random.default_rng(1).normal(size=(count, len(STARTS)))
    senses = ("angles", "speeds", "tilt", "turning", "contacts")
    return [Loop(wave, senses, each, np.zeros(len(STARTS)), 0.02, OBSERVE_S, latency_s=latency_s) for each in genomes]


@pytest.mark.parametrize("threads", [1, 2])
def test_twenty_simulators_share_a_call_and_none_is_compiled_again(
    threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    worlds = simulators(20)
    apart = np.stack([paths(MuJoCo(), [world], MOTIONS)[:, 0] for world in worlds], axis=1)
    compiled = []

    def counted(library: Any, world: World) -> Structure:
        compiled.append(world)
        return compiled_once(library, world)

    monkeypatch.setattr(of_worlds, "compiled", counted)
    engine = MuJoCo(MuJoCo.Options(threads=threads))

    together = paths(engine, worlds, MOTIONS)

    assert np.isfinite(together).all()
    assert np.array_equal(together, apart)
    assert len({path.tobytes() for path in together[0]}) == len(worlds)
    assert len(compiled) == 1


def test_more_simulators_than_models_are_kept_give_the_same_numbers(engine: MuJoCo) -> None:
    worlds = simulators(max(of_worlds.KEPT, of_scenes.ROWS) + 4)
    expected = paths(engine, worlds, MOTIONS)
    few = MuJoCo()

    for order in (slice(None), slice(None, None, -1), slice(None, None, 2), slice(None)):
        assert np.array_equal(paths(few, worlds[order], MOTIONS), expected[:, order])
    by_turns = [paths(few, [world], MOTIONS)[:, 0] for world in worlds]
    assert np.array_equal(np.stack(by_turns, axis=1), expected)


def test_worlds_may_differ_in_place_and_in_what_is_built(engine: MuJoCo) -> None:
    longer = replace(WORLD, start_height_m=0.3)
    worlds = [*simulators(3), longer, longer.edited("slope_rad", slope_rad=0.1), WORLD]

    together = paths(engine, worlds, MOTIONS)

    assert np.array_equal(together, np.stack([paths(MuJoCo(), [world], MOTIONS)[:, 0] for world in worlds], axis=1))


@pytest.mark.parametrize("motor", [PD, replace(PD, delay_s=0.03), Motor(0.07, 8.0)], ids=["pd", "late", "servo"])
@pytest.mark.parametrize("period_s", [0.01, 0.05])
def test_a_loop_that_plays_a_motion_is_the_motion_to_the_bit(
    engine: MuJoCo, motor: Motor | PDMotor, period_s: float
) -> None:
    """The servo's law takes accelerations from the step before, which MuJoCo's state does not have."""
    world, played = walker(motor), MOTIONS[0]

    def play(genomes: FloatArray, _: FloatArray, memories: FloatArray, time_s: float) -> tuple[FloatArray, FloatArray]:
        row = np.searchsorted(played.times_s, time_s + 1e-9, side="right") - 1
        return np.tile(played.targets[row], (len(genomes), 1)), memories

    loop = Loop(play, (), np.zeros(1), np.zeros(0), period_s, OBSERVE_S)
    times_s = np.arange(0.0, 1.01, 0.1)
    one, other = (engine.record(world, each, times_s) for each in (played, loop))

    assert np.isfinite(one.poses).all()
    assert np.array_equal(other.poses, one.poses)
    assert np.array_equal(other.angles_rad, one.angles_rad)  # type: ignore[arg-type]
    assert np.array_equal(other.torques_nm, one.torques_nm)  # type: ignore[arg-type]
    assert np.array_equal(paths(engine, [world], [loop]), paths(engine, [world], [played]))


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("together", [1, 2, 5])
def test_loops_are_bit_equal_in_any_batch_of_worlds_and_controllers(threads: int, together: int) -> None:
    worlds = [*simulators(4), WORLD.edited("slope_rad", slope_rad=0.05)]
    expected = paths(MuJoCo(), worlds, loops(5, 0.03))
    engine = MuJoCo(MuJoCo.Options(threads=threads))

    parts = [
        [paths(engine, worlds[m : m + together], loops(5, 0.03)[n : n + together]) for m in range(0, 5, together)]
        for n in range(0, 5, together)
    ]

    assert np.isfinite(expected).all()
    assert np.array_equal(np.concatenate([np.concatenate(row, axis=1) for row in parts]), expected)


def test_latency_changes_what_a_loop_does(engine: MuJoCo) -> None:
    at_once, late = (paths(engine, [WORLD], loops(1, latency_s)) for latency_s in (0.0, 0.05))

    assert not np.array_equal(at_once, late)


def test_a_loop_that_fails_does_not_harm_the_others_of_its_call(engine: MuJoCo) -> None:
    def broken(genomes: FloatArray, *now: Any) -> tuple[FloatArray, FloatArray]:
        targets, memories = wave(genomes, *now)
        return np.where(genomes[:, :1] > 1e3, np.nan, targets), memories

    whole = [replace(loop, act=broken) for loop in loops(3)]
    lost = [whole[0], replace(whole[1], genome=np.full(len(STARTS), 1e4)), whole[2]]

    together = paths(engine, [WORLD], lost)[:, 0]

    assert np.isnan(together[1]).all()
    assert np.array_equal(together[[0, 2]], paths(engine, [WORLD], loops(3))[[0, 2], 0])


def test_sensing_is_off_again_after_loops(engine: MuJoCo) -> None:
    before = paths(engine, [WORLD], MOTIONS)
    paths(engine, [WORLD], loops(2))
    (prepared,) = engine._scenes[WORLD.built(engine.in_place)].models[[WORLD]]

    assert prepared.model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    assert np.array_equal(paths(engine, [WORLD], MOTIONS), before)


def test_a_stiff_motor_carries_a_load_through_contacts_as_its_stiffness_says(engine: MuJoCo) -> None:
    """Two blocks on the ground, one above the other, with a spring between them: the ground carries the load."""
    kp, load_kg = 5000.0, 10.0
    spring = PDMotor("position", 1e3, kp, 300.0)
    world = World(
        bodies=(
            Body("foot", 0.5, Box((0.4, 0.4, 0.1))),
            Body("load", load_kg, Box((0.2, 0.2, 0.1)), collides=False),
        ),
        joints=(Joint("lift", "foot", "load", (0, 0, 0.2), (0.0, 0.0, 1.0), spring, slides=True),),
        start_height_m=0.05,
        time_step_s=1 / 100,
    )
    still = Motion(np.zeros(1), np.zeros((1, 1)), np.array([2.0, 3.0]))

    found = engine.record(world, still, still.observe_s)

    assert found.angles_rad is not None
    assert found.torques_nm is not None
    assert found.angles_rad[:, 0] == pytest.approx(-load_kg * G / kp, rel=0.01)
    assert found.torques_nm[:, 0] == pytest.approx(load_kg * G, rel=0.01)


def test_a_light_limb_with_a_stiff_motor_is_stable_beside_others(engine: MuJoCo) -> None:
    stiff = walker(replace(PD, kp=1e5, kd=1e3, max_torque_nm=1e3), armature=0.0, damping=0.0, dry_friction=0.0)
    still = Motion(np.zeros(1), STARTS[None], np.array([0.5, 1.0]))

    found = engine.record(stiff, still, still.observe_s).angles_rad

    assert found is not None
    assert found == pytest.approx(np.tile(STARTS, (2, 1)), abs=0.02)


@pytest.mark.parametrize("torque_nm", [3.0, -3.0])
def test_a_fast_joint_stops_at_its_limit_and_does_not_bounce(engine: MuJoCo, torque_nm: float) -> None:
    arm = Body("arm", 0.5, Box((0.1, 0.1, 0.3)), collides=False)
    push = PDMotor("torque", 100.0)
    joint = Joint("joint", "frame", "arm", (0, 0, 0), (0.0, 1.0, 0.0), push, limits=(-1.5, 1.5))
    frame = Body("frame", 1.0, Box((0.1, 0.1, 0.1)))
    world = World((frame, arm), (joint,), start_height_m=3.0, gravity_m_s2=0.0, fixed=True, time_step_s=STEP_S)
    push_it = Motion(np.zeros(1), np.array([[torque_nm]]), np.linspace(STEP_S, 1.0, 240))

    angles = engine.record(world, push_it, push_it.observe_s).angles_rad

    assert angles is not None
    assert np.abs(angles).max() == pytest.approx(1.5, abs=1e-3)
    assert np.abs(angles[-1]) == pytest.approx(1.5, abs=1e-3)
    arrived = int(np.argmax(np.abs(angles[:, 0]) > 1.49))
    assert 5 < arrived < 120
    assert np.abs(angles[arrived:]).min() > 1.48


def test_what_no_joint_moves_away_from_the_ground_bears_no_load(engine: MuJoCo) -> None:
    """A wheel that lies on the ground and turns about the vertical, on a base that never moves."""
    wheel = Body("wheel", 1.0, (Part(Cylinder(0.2, 0.1)),), inertia=Inertia((0.01, 0.01, 0.02)))
    axle = Joint("axle", "stand", "wheel", (0, 0, 0.045), (0.0, 0.0, 1.0), PDMotor("torque", 1.0))
    world = World((Body("stand", 1.0, Box((0.1, 0.1, 0.1))), wheel), (axle,), fixed=True, time_step_s=STEP_S)
    push = Motion(np.zeros(1), np.array([[0.02]]), np.array([1.0]))

    angles = engine.record(world, push, push.observe_s).angles_rad

    assert angles is not None
    assert angles[0, 0] == pytest.approx(0.5 * 0.02 / 0.02 * 1.0, rel=0.01)


def test_a_world_that_cannot_move_is_seen_where_it_stands(engine: MuJoCo) -> None:
    statue = World((Body("statue", 1.0, Box((0.1, 0.1, 0.1))),), fixed=True, start_height_m=0.5, time_step_s=STEP_S)

    seen = engine.rollout(statue, Motion(np.zeros(1), np.zeros((1, 0)), np.array([0.0, 1.0])))

    assert np.array_equal(seen.positions_m, [[0.0, 0.0, 0.5]] * 2)


def test_the_inverse_inertia_of_joints_is_that_of_the_core() -> None:
    made = Models(mujoco, WORLD)
    (prepared,) = made[[walker(damping=0.0, motor=PDMotor("torque", 1.0))]]
    data = mujoco.MjData(prepared.model)

    found = _inverse_inertias(mujoco, made.structure, prepared.model, data, WORLD)

    assert np.array(found)[made.structure.dofs] == pytest.approx(inverse_inertias(WORLD), rel=1e-9)
