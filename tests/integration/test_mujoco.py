"""What is particular to the MuJoCo engine, beyond the contract that every engine keeps."""

import subprocess
import sys
from collections.abc import Iterator
from ctypes import c_double, c_int32, c_int64
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.mujoco import MuJoCo
from gaplab.services.engines.mujoco import worlds as models_module
from gaplab.services.engines.mujoco.callback import callbacks, layout
from gaplab.services.engines.mujoco.engine import ROWS
from gaplab.services.engines.mujoco.model import named
from gaplab.services.engines.mujoco.pool import in_force
from gaplab.services.engines.mujoco.worlds import Models
from gaplab.services.world.motions import Motion, open_loop
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.world import Body, Box, Joint, Material, Motor, Sphere, World

mujoco = pytest.importorskip("mujoco")
pytest.importorskip("mujoco.introspect.structs")
pytest.importorskip("numba")

G, STEP_S = 9.81, 1 / 100
ROBOT = Quadruped()
MOTION = open_loop(ROBOT.motion(ROBOT.known))
MATERIALS = [Material(1.0, 0.8), Material(0.3, 0.3), Material(0.8, 0.5, 0.5)]
SLEDGE = World(
    bodies=(Body("board", 1.9, Box((2.0, 2.0, 0.02)), collides=False), Body("foot", 0.1, Sphere(0.02))),
    joints=(Joint("hinge", "board", "foot", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),),
    start_height_m=0.02,
    time_step_s=STEP_S,
)
BOX = World(bodies=(Body("box", 2.0, Box((0.2, 0.2, 0.04))),), start_height_m=0.02, time_step_s=STEP_S)
WEIGHT_N = 2.0 * G


@pytest.fixture
def engine() -> Iterator[MuJoCo]:
    engine = MuJoCo()
    yield engine
    engine.close()


def in_material(material: Material) -> World:
    return replace(ROBOT.world, material=material)


def path(engine: MuJoCo, world: World, motion: Motion = MOTION) -> FloatArray:
    return engine.rollout(world, motion).positions_m


FIELDS = "qpos qvel qacc qacc_warmstart qacc_smooth qfrc_applied qfrc_bias qfrc_smooth sensordata"
ROW_FIELDS = "efc_vel efc_pos efc_force efc_J efc_b efc_AR efc_frictionloss"


class Sliding:
    """Something of 2 kg at rest on the ground, to be thrown, and followed step by step."""

    def __init__(self, world: World, material: Material) -> None:
        (prepared,) = Models(mujoco, world)[[replace(world, material=material)]]
        self.model, self.data = prepared.model, mujoco.MjData(prepared.model)
        self.step(30)

    def step(self, count: int) -> None:
        with in_force(mujoco, callbacks()):
            for _ in range(count):
                self.data.qfrc_applied[:] = 0.0
                mujoco.mj_step(self.model, self.data)

    def throw(self, x: float, y: float) -> None:
        self.data.qvel[:2] = x, y

    def speed(self) -> float:
        return float(np.hypot(*self.data.qvel[:2]))


@pytest.mark.parametrize("world", [SLEDGE, BOX], ids=["foot", "box"])
@pytest.mark.parametrize("material", [Material(1.0, 0.8), Material(1.2, 0.3), Material(0.5, 0.1)])
@pytest.mark.parametrize("direction", [(1.0, 0.0), (np.sqrt(0.5), np.sqrt(0.5))])
def test_what_slides_is_slowed_by_the_dynamic_friction_in_any_direction(
    world: World, material: Material, direction: tuple[float, float]
) -> None:
    sliding = Sliding(world, material)
    sliding.throw(3 * direction[0], 3 * direction[1])

    sliding.step(20)

    assert (3 - sliding.speed()) / (20 * STEP_S) == pytest.approx(material.dynamic_friction * G, rel=0.01)


@pytest.mark.parametrize("world", [SLEDGE, BOX], ids=["foot", "box"])
def test_what_slid_to_rest_stays(world: World) -> None:
    sliding = Sliding(world, Material(1.0, 0.8))
    sliding.throw(0.2, 0.0)
    sliding.step(30)
    place = sliding.data.qpos[:2].copy()

    sliding.step(100)

    assert sliding.data.qpos[:2] == pytest.approx(place, abs=1e-3)  # the board rocks a little


@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.85])
@pytest.mark.parametrize("height_m", [0.2, 0.5, 1.0])
def test_a_ball_leaves_with_the_restitutions_share_of_the_speed_at_which_it_came(
    engine: MuJoCo, restitution: float, height_m: float
) -> None:
    ball = World(bodies=(Body("ball", 1.0, Sphere(0.05)),), start_height_m=0.05 + height_m, time_step_s=STEP_S)
    still = Motion(np.zeros(1), np.zeros((1, 0)), np.arange(0, 1, STEP_S))

    heights = path(engine, replace(ball, material=Material(restitution=restitution)), still)[:, 2]

    speeds = np.diff(heights) / STEP_S
    first = int(np.argmax(speeds > 0))
    assert speeds[first] == pytest.approx(-restitution * speeds[first - 1], rel=1e-3)


def test_its_fields_are_where_mujocos_description_of_itself_says() -> None:
    box = Sliding(BOX, Material())
    model, data = box.model, box.data
    mujoco.mj_forward(model, data)
    offsets, _ = layout("mjData")
    contact, size = layout("mjContact")

    def number(address: int, kind: type) -> int | float:
        return kind.from_address(address).value  # type: ignore[attr-defined]

    for name in f"{FIELDS} {ROW_FIELDS}".split():
        assert number(data._address + offsets[name], c_int64) == getattr(data, name).ctypes.data, name
    inside, _ = layout("mjModel")
    assert number(model._address + inside["numeric_data"], c_int64) == model.numeric_data.ctypes.data
    assert number(model._address + inside["nv"], c_int64) == model.nv
    assert number(data._address + offsets["ncon"], c_int32) == len(data.contact) > 1
    first = number(data._address + offsets["contact"], c_int64)
    for index, point in enumerate(data.contact):
        assert number(first + index * size + contact["dist"], c_double) == point.dist  # type: ignore[arg-type]
        assert number(first + index * size + contact["friction"], c_double) == point.friction[0]  # type: ignore[arg-type]
        assert number(first + index * size + contact["efc_address"], c_int32) == point.efc_address  # type: ignore[arg-type]


@pytest.mark.parametrize("missing", ["mujoco", "numba"])
def test_it_is_listed_with_its_install_line_where_one_of_its_libraries_is_missing(
    missing: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gaplab.services.engines.mujoco.engine.find_spec", lambda name: name != missing or None)
    monkeypatch.setattr("gaplab.services.engines.base.find_spec", lambda name: None if name == missing else True)

    described = MuJoCo.describe()

    assert not described.available
    assert "gaplab[mujoco]" in (described.note or "")


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("count", [1, 5, ROWS + 1])
def test_the_numbers_depend_neither_on_the_threads_nor_on_how_rollouts_are_batched(
    engine: MuJoCo, threads: int, count: int
) -> None:
    worlds = [in_material(material) for material in MATERIALS]
    genomes = np.vstack([ROBOT.known, ROBOT.space.draw(count - 1, np.random.default_rng(0))])
    motions = [replace(open_loop(ROBOT.motion(genome)), observe_s=np.array([0.2, 0.5])) for genome in genomes]
    apart = np.array([[path(engine, world, motion) for world in worlds] for motion in motions])
    other = MuJoCo(MuJoCo.Options(threads=threads))

    together = other.rollouts(worlds, motions).positions_m

    other.close()
    assert np.array_equal(together, apart)


def test_worlds_of_several_kinds_may_share_a_call(engine: MuJoCo) -> None:
    worlds = [in_material(MATERIALS[1]), replace(ROBOT.world, gravity_m_s2=5.0), in_material(MATERIALS[2])]

    together = engine.rollouts(worlds, [MOTION]).positions_m[0]

    assert np.array_equal(together, [path(engine, world) for world in worlds])


def test_a_rollout_that_fails_does_not_harm_the_others_of_its_call(engine: MuJoCo) -> None:
    lost = replace(MOTION, targets=np.full_like(MOTION.targets, np.nan))

    together = engine.rollouts([ROBOT.world], [MOTION, lost, MOTION]).positions_m[:, 0]

    assert np.array_equal(together[[0, 2]], [path(engine, ROBOT.world)] * 2)
    assert np.all(np.isnan(together[1]))


def test_a_rollout_at_which_mujoco_stops_does_not_harm_the_others_of_its_call(
    engine: MuJoCo, monkeypatch: pytest.MonkeyPatch
) -> None:
    heavy = ROBOT.world.edited("gravity_m_s2", gravity_m_s2=20.0)
    alone = path(engine, ROBOT.world)
    scene = engine._scenes[ROBOT.world.built(engine.in_place)]
    plain = scene.pool._threads

    class Stopping:
        def rollout(self, models: Any, *args: Any, **options: Any) -> None:
            if any(model.opt.gravity[2] == -20.0 for model in models):
                raise mujoco.FatalError("stopped")
            plain.rollout(models, *args, **options)

        def close(self) -> None:
            plain.close()

    monkeypatch.setattr(scene.pool, "_threads", Stopping())
    found = engine.rollouts([ROBOT.world, heavy], [MOTION, MOTION]).positions_m

    assert np.array_equal(found[:, 0], [alone, alone])
    assert np.isnan(found[:, 1]).all()


def test_a_robot_of_large_models_keeps_few_of_them(engine: MuJoCo, monkeypatch: pytest.MonkeyPatch) -> None:
    models = Models(mujoco, ROBOT.world)
    monkeypatch.setattr(models_module, "KEPT_BYTES", 3 * models.structure.model.nbuffer)
    worlds = [in_material(Material(0.1 * number, 0.1)) for number in range(5)]

    for world in worlds:
        models[[world]]

    assert len(models._kept) == 3
    assert [each.world for each in models[worlds]] == worlds
    models[worlds[:1]]
    assert len(models._kept) == 3


@pytest.mark.release
def test_warnings_are_neither_printed_nor_written_to_a_file(tmp_path: Path) -> None:
    script = (
        "from dataclasses import replace; from gaplab.services.world.robots.quadruped import Quadruped;"
        "from gaplab.services.engines.mujoco import MuJoCo; import os; robot = Quadruped();"
        f"engine = MuJoCo(); os.chdir({str(tmp_path)!r});"
        "engine.rollout(replace(robot.world, gravity_m_s2=-1e300), robot.motion(robot.known))"
    )

    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)

    assert list(tmp_path.iterdir()) == []
    assert "WARNING" not in done.stdout + done.stderr


def test_what_belongs_to_the_process_is_as_it_was_after_a_rollout(engine: MuJoCo) -> None:
    path(engine, ROBOT.world)

    assert mujoco.get_mjcb_control() is None
    assert mujoco.get_mjcb_time() is None
    assert mujoco.get_mjcb_sensor() is None
    assert mujoco.MjLogConfig.get().logto_file


def test_every_body_has_the_mass_and_the_inertia_of_its_solid_shape(engine: MuJoCo) -> None:
    (prepared,) = engine._scenes[ROBOT.world.kind].models[[ROBOT.world]]
    model = prepared.model

    for body in ROBOT.world.bodies:
        made = model.body(named(body.name))
        assert made.mass[0] == pytest.approx(body.mass_kg)
        assert sorted(made.inertia) == pytest.approx(sorted(solid(body)))
        assert made.ipos == pytest.approx(body.center_m)


def solid(body: Body) -> list[float]:
    """Principal moments of inertia of even density."""
    if isinstance(body.shape, Sphere):
        return [0.4 * body.mass_kg * body.shape.radius_m**2] * 3
    assert isinstance(body.shape, Box)
    x, y, z = np.square(body.shape.size_m)
    return [body.mass_kg / 12 * (y + z), body.mass_kg / 12 * (x + z), body.mass_kg / 12 * (x + y)]


class Turning:
    """A motor that turns an arm of 1/600 kg m² against a hub that stands still."""

    def __init__(self, motor: Motor) -> None:
        world = World(
            bodies=(Body("hub", 1e6, Box((1.0, 1.0, 1.0))), Body("arm", 1.0, Box((0.1, 0.1, 0.1)), collides=False)),
            joints=(Joint("shaft", "hub", "arm", (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), motor),),
            start_height_m=10.0,
            gravity_m_s2=0.0,
            time_step_s=STEP_S,
        )
        (prepared,) = Models(mujoco, world)[[world]]
        self.model, self.data = prepared.model, mujoco.MjData(prepared.model)

    def step(self, target: float, count: int) -> tuple[float, float]:
        """Angle and speed."""
        with in_force(mujoco, callbacks()):
            for _ in range(count):
                self.data.qfrc_applied[6] = target
                mujoco.mj_step(self.model, self.data)
        return float(self.data.qpos[7]), float(self.data.qvel[6])


@pytest.mark.parametrize("gain", [0.02, 0.07, 0.2])
def test_a_motor_closes_its_share_of_the_error_in_each_step(gain: float) -> None:
    turning = Turning(Motor(gain, 1e3))
    begun, _ = turning.step(1.0, 3)  # to get to speed takes a free limb a step or two

    angle, _ = turning.step(1.0, 10)

    assert (1 - angle) / (1 - begun) == pytest.approx((1 - gain) ** 10, rel=0.1)


def test_a_motor_gives_no_more_than_its_torque() -> None:
    turning = Turning(Motor(0.1, 0.02, 1e3))
    _, before = turning.step(1e6, 40)  # what its rotor takes at first is given back a ninth at a time

    _, after = turning.step(1e6, 10)

    assert (after - before) / (10 * STEP_S) == pytest.approx(0.02 * 600, rel=0.02)


def test_a_motor_turns_no_faster_than_its_limit() -> None:
    _, speed = Turning(Motor(0.1, 1e3, 3.0)).step(1e6, 50)

    assert speed == pytest.approx(3.0, rel=1e-3)


def test_a_motor_without_torque_leaves_its_hinge_free(engine: MuJoCo) -> None:
    weak = tuple(replace(joint, motor=Motor(0.07, 0.0)) for joint in ROBOT.world.joints)
    free = tuple(replace(joint, motor=None) for joint in ROBOT.world.joints)
    still = Motion(np.zeros(1), np.zeros((1, 0)), MOTION.observe_s)

    collapsed = path(engine, replace(ROBOT.world, joints=weak))

    assert np.array_equal(collapsed, path(engine, replace(ROBOT.world, joints=free), still))
    assert collapsed[-1, 2] < 0.1
