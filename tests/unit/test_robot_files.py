"""Robot files: the same robot after a round trip, a stable hash, and clear errors."""

import json
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from typing import Any

import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.robots import RobotSource
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.world.robot_files import MOST_BYTES, RobotFile
from gaplab.services.world.robots.quadruped import Quadruped
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
    Noise,
    Part,
    PDMotor,
    Sphere,
    World,
)

TETRAHEDRON = Hull(((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1)))
PARTS = tuple(
    Part(shape, (0.1, 0.0, 0.0), (0.0, 0.0, 0.6, 0.8), collides=False)
    for shape in (Box((0.1, 0.2, 0.3)), Sphere(0.1), Capsule(0.1, 0.2), Cylinder(0.1, 0.2), TETRAHEDRON)
)
EVERYTHING = World(
    bodies=(
        Body("base", 2.0, PARTS, (0.0, 0.1, 0.0), inertia=Inertia((0.1, 0.2, 0.25))),
        Body("leg", 0.5, Capsule(0.1, 0.2), surface="rubber"),
        Body("slider", 0.5, Sphere(0.1), collides=False),
    ),
    joints=(
        Joint("hip", "base", "leg", (0.0, 0.0, 0.1), (1.0, 0.0, 0.0), Motor(0.1, 5.0), limits=(-1.0, 1.0), start=0.5),
        Joint(
            "rail",
            "leg",
            "slider",
            (0.0, 0.0, 0.1),
            (0.0, 0.6, 0.8),
            PDMotor("velocity", 3.0, kd=1.0),
            slides=True,
            static_friction=0.3,
            stribeck_speed=0.2,
        ),
    ),
    material=Material(0.7, 0.6, 0.1),
    surfaces=(("rubber", Material(1.2, 1.1)),),
    slope_rad=0.1,
    noise=Noise(target=0.01),
    ground_m=0.01,
    gravity_tilt_rad=(0.1, -0.2),
    time_offset_s=-0.03,
    biases=(("angle hip", 0.02),),
    fixed=True,
    observed="slider",
)


def file_of(world: World) -> RobotFile:
    walk = PluginRef(name="walk", options={"counted_s": 1.5})
    source = RobotSource(file="robot.urdf", sha256="0" * 64, options={"fixed": True})
    return RobotFile(
        name="robot",
        source=source,
        usual_controller=PluginRef(name="square_pulses"),
        usual_task=walk,
        lost=("hip: its velocity limit 20 rad/s",),
        world=world,
    )


@pytest.mark.parametrize("world", [EVERYTHING, Quadruped().world], ids=["everything", "quadruped"])
def test_a_robot_that_is_read_equals_the_one_that_was_written(world: World) -> None:
    robot = file_of(world)

    assert RobotFile.read(robot.text) == robot
    assert RobotFile.read(robot.text).world == world


def test_the_hash_depends_on_values_and_not_on_spaces_order_or_how_the_world_was_edited() -> None:
    robot = file_of(EVERYTHING)
    reordered = json.dumps(dict(reversed(robot.content.items())), indent=3)

    assert RobotFile.read(reordered).sha256 == robot.sha256
    assert file_of(EVERYTHING.edited("slope", slope_rad=0.1)).sha256 == robot.sha256
    assert file_of(replace(EVERYTHING, slope_rad=0.2)).sha256 != robot.sha256


def test_a_copy_with_another_world_is_another_file() -> None:
    file = file_of(Quadruped().world)
    before = file.sha256

    copy = file.model_copy(update={"world": replace(file.world, start_height_m=0.5)})

    assert copy.sha256 != before
    assert RobotFile.read(copy.text).world.start_height_m == 0.5
    assert file.sha256 == before


def test_values_that_are_the_defaults_are_not_in_the_text() -> None:
    """So a field that the World gets later does not change the hash of a stored robot."""
    world = file_of(Quadruped().world).content["world"]

    assert "noise" not in world
    assert world["bodies"][0].keys() == {"name", "mass_kg", "shape"}


def edit(*path: Any, to: Any) -> Callable[[Any], None]:
    def change(content: Any) -> None:
        for part in path[:-1]:
            content = content[part]
        content[path[-1]] = to

    return change


WORLD, BASE, HIP = ("world",), ("world", "bodies", 0), ("world", "joints", 0)
REFUSED: dict[str, tuple[Callable[[Any], None], str, str]] = {
    "mass": (edit(*BASE, "mass_kg", to=0), "/world/bodies/0/mass_kg", "above 0, not 0"),
    "text": (edit(*BASE, "mass_kg", to="1"), "/world/bodies/0/mass_kg", 'a finite number, not "1"'),
    "nan": (edit(*BASE, "mass_kg", to=float("nan")), "/world/bodies/0/mass_kg", "a finite number"),
    "field": (edit(*BASE, "colour", to="red"), "/world/bodies/0/colour", "colour is not a field here"),
    "kind": (edit(*BASE, "shape", 0, "shape", "kind", to="cone"), "/world/bodies/0/shape/0/shape", "box, sphere"),
    "size": (edit(*BASE, "shape", 0, "shape", "size_m", 1, to=-1), "/world/bodies/0/shape/0/shape/size_m", "1e-06 to"),
    "vertices": (
        edit(*BASE, "shape", 4, "shape", "points_m", to=[[0.01 * i, 0.1 * i * i, i**3] for i in range(65)]),
        "/world/bodies/0/shape/4/shape/points_m",
        "at most 64 items, not 65",
    ),
    "flat": (
        edit(*BASE, "shape", 4, "shape", "points_m", to=[[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]),
        "/world/bodies/0/shape/4/shape/points_m",
        "enclose a volume",
    ),
    "triangle": (
        edit(*BASE, "inertia", "moments_kg_m2", to=[0.1, 0.1, 0.3]),
        "/world/bodies/0/inertia/moments_kg_m2",
        "exceeds the sum",
    ),
    "moments": (
        edit(*BASE, "inertia", "moments_kg_m2", to=[0, 1, 1]),
        "/world/bodies/0/inertia/moments_kg_m2",
        "above 0",
    ),
    "turn": (edit(*BASE, "shape", 0, "turn", to=[0, 0, 0, 2]), "/world/bodies/0/shape/0/turn", "length 1"),
    "axis": (edit(*HIP, "axis", to=[1, 1, 0]), "/world/joints/0/axis", "length 1"),
    "limits": (edit(*HIP, "limits", to=[1, -1]), "/world/joints/0/limits", "the smaller limit"),
    "start": (edit(*HIP, "start", to=2), "/world/joints/0/start", "within the limits"),
    "static_friction": (edit(*HIP, "static_friction", to=-1), "/world/joints/0/static_friction", "at least 0"),
    "stribeck_speed": (edit(*HIP, "stribeck_speed", to=0), "/world/joints/0/stribeck_speed", "above 0"),
    "ground_m": (edit("world", "ground_m", to=5), "/world/ground_m", "-1 to 1"),
    "gravity_tilt_rad": (edit("world", "gravity_tilt_rad", to=[3, 0]), "/world/gravity_tilt_rad", "less than π/2"),
    "time_offset_s": (edit("world", "time_offset_s", to=-99), "/world/time_offset_s", "-10 to 10"),
    "damping": (edit(*HIP, "damping", to=-1), "/world/joints/0/damping", "at least 0"),
    "motor": (edit(*HIP, "motor", to={"position_gain": 0.1}), "/world/joints/0/motor/max_torque_nm", "missing"),
    "torque": (edit(*HIP, "motor", "max_torque_nm", to=0), "/world/joints/0/motor/max_torque_nm", "above 0"),
    "gain": (edit(*HIP, "motor", "position_gain", to=1.5), "/world/joints/0/motor/position_gain", "at most 1"),
    "follows": (edit("world", "joints", 1, "motor", "follows", to="x"), "/world/joints/1/motor/follows", "one of"),
    "names": (edit(*HIP, "name", to="rail"), "/world/joints", "unique names"),
    "parent": (edit(*HIP, "parent", to="arm"), "/world/joints/0/parent", "the name of a body"),
    "cycle": (edit(*HIP, "parent", to="slider"), "/world/bodies/1", "joined to the base 'base'"),
    "child": (edit(*HIP, "child", to="base"), "/world/joints/0/child", "other than the base"),
    "twice": (edit(*HIP, "child", to="slider"), "/world/joints/0/child", "carried by one joint"),
    "surface": (edit(*BASE, "surface", to="ice"), "/world/bodies/0/surface", "one of the world's surfaces"),
    "observed": (edit(*WORLD, "observed", to="tail"), "/world/observed", "the name of a body"),
    "step": (edit(*WORLD, "time_step_s", to=1e-6), "/world/time_step_s", "1e-05 to 0.1"),
    "delay": (edit(*WORLD, "noise", to={"latency_s": 11}), "/world/noise/latency_s", "0 to 10"),
    "bodies": (edit(*WORLD, "bodies", to=[]), "/world/bodies", "1 to 200 bodies"),
    "joints": (edit(*WORLD, "joints", to=[{}] * 14_000), "/world/joints", "at most 200, not 14,000"),
    "edits": (edit(*WORLD, "origin", to=None), "/world/origin", "not a field of a robot file"),
    "version": (edit("format_version", to=2), "/format_version", "at most 1"),
    "name": (edit("name", to="A robot"), "/name", "must match"),
    "unmotored": (edit(*WORLD, "joints", to=[]), "/world/joints", "at least one has a motor"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_an_error_names_the_place_and_what_is_permitted(case: str) -> None:
    change, pointer, message = REFUSED[case]
    content = deepcopy(file_of(EVERYTHING).content)
    change(content)

    with pytest.raises(InvalidSpec) as caught:
        RobotFile.read(json.dumps(content))

    violations = {violation.pointer: violation.message for violation in caught.value.violations}
    assert message in violations[pointer]
    assert all("tagged-union" not in each and "tuple[" not in each for each in violations)


def test_the_first_hundred_violations_are_told() -> None:
    content = file_of(EVERYTHING).content
    content["world"]["bodies"] = [{}] * 200

    with pytest.raises(InvalidSpec) as caught:
        RobotFile.read(json.dumps(content))

    assert len(caught.value.violations) == 100


def test_a_text_that_is_too_long_or_no_json_is_refused() -> None:
    with pytest.raises(InvalidSpec, match=r"2,000,001 bytes.*at most 2,000,000"):
        RobotFile.read(b" " * (MOST_BYTES + 1))
    with pytest.raises(InvalidSpec, match="not JSON"):
        RobotFile.read("{")
