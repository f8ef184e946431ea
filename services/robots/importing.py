"""A robot file from a URDF or an MJCF; its start is within the limits, and its lowest point touches the ground."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from hashlib import sha256
from itertools import compress
from pathlib import Path

import numpy as np
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from gaplab.schemas.mistakes import sentence
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.robots import RobotSource
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import InvalidRobot, InvalidSpec
from gaplab.services.robots.bodies import FREE, Bodies, joint_name, joint_number, quaternion, rotation_of
from gaplab.services.robots.motors import with_motors, with_swings
from gaplab.services.robots.options import ImportOptions, Notes, listed
from gaplab.services.robots.reading import Handle, Source, body_name, mujoco_library, read_source
from gaplab.services.robots.xml import decoded
from gaplab.services.world.robot_files import LONGEST_NAME, RobotFile
from gaplab.services.world.world import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Joint,
    Material,
    Part,
    Quaternion,
    Surfaces,
    World,
)

HUGE_M = 10.0
"""Length in a robot from which its file may mean millimetres."""

URDF_STEP_S = 1 / 240
"""Time step of a URDF, which has none: Bullet's."""

SAME_KG = 1e-9
"""Difference of masses that rounding explains."""


@dataclass(frozen=True)
class MassRow:
    """Masses of one body of a World, before and after; its members are the bodies of the file that it consists of."""

    body: str
    members: tuple[str, ...]
    before_kg: float
    after_kg: float


@dataclass(frozen=True)
class ImportedFile:
    """A robot file, and its masses before and after."""

    robot: RobotFile
    masses: tuple[MassRow, ...]

    @property
    def before_kg(self) -> float:
        """Return the mass of the robot in the file."""
        return sum(row.before_kg for row in self.masses)

    @property
    def after_kg(self) -> float:
        """Return the mass of the robot in its World."""
        return sum(row.after_kg for row in self.masses)


def import_robot(file: Path, options: ImportOptions) -> ImportedFile:
    """Return the robot of a URDF or an MJCF.

    Raises:
        InvalidRobot: with every reason that was found.
        EngineUnavailable: MuJoCo is not installed.
        OSError: the file cannot be read.
    """
    notes = Notes()
    content = file.read_bytes()
    source = read_source(file, decoded(content), options, notes)
    bodies = Bodies(source)
    world = _world(source, bodies)
    notes.check()
    masses = tuple(_masses(source, bodies))
    for row in masses:
        if abs(row.after_kg - row.before_kg) > SAME_KG:
            notes.lose(f"{row.body}: {row.before_kg:.6g} kg in the file, {row.after_kg:.6g} kg imported")
    name = _name(options.name or source.name or file.stem)
    usual = ("sine", "reach") if world.fixed else ("cpg", "walk") if world.joints else ("recorded", "recorded")
    try:
        robot = RobotFile(
            name=name,
            source=RobotSource(
                file=file.name,
                sha256=sha256(content).hexdigest(),
                options=options.model_dump(mode="json", exclude_defaults=True),
            ),
            usual_controller=options.controller or PluginRef(name=usual[0]),
            usual_task=options.task or PluginRef(name=usual[1]),
            lost=tuple(notes.lost),
            world=world,
        )
        return ImportedFile(RobotFile.read(robot.text), masses)
    except ValidationError as error:
        raise InvalidRobot(sentence(dict(each)) for each in error.errors()) from error
    except InvalidSpec as error:
        raise InvalidRobot(f"{each.pointer}: {each.message}" for each in error.violations) from error
    except ValueError as error:  # JSON has neither nan nor infinity
        raise InvalidRobot(["a mass, a length or another number of the file is not finite"]) from error


def _world(source: Source, bodies: Bodies) -> World:
    options, notes, model, fixed = source.options, source.notes, source.model, source.fixed or bodies.is_held
    _note_losses(source)
    qpos = _start_angles(source)
    joints = _with_starts([bodies.joint(head) for head in bodies.heads[1:]], source, qpos)
    joints = with_swings(with_motors(joints, source), notes)
    found, material, surfaces = _surfaces(source, bodies)
    ground_m = options.ground_m or 0.0
    height_m, turn = _base_pose(bodies, found, joints, qpos, ground_m, fixed=fixed)
    largest_m = max([abs(height_m), *(abs(each) for joint in joints for each in joint.origin_m)])
    if largest_m > HUGE_M:
        notes.lose(f"lengths up to {largest_m:.3g} m are taken as they are, not as millimetres; meshes have a scale")
    if not fixed and source.is_urdf:
        notes.lose("the base floats: --fixed holds it")
    if fixed and options.ground_m is None:
        notes.lose("the ground is at height 0 and stops the robot: -s ground_m=-1 if its base stands on something")
    usual_step_s = URDF_STEP_S if source.is_urdf else float(model.opt.timestep)
    return World(
        bodies=tuple(found),
        joints=tuple(joints),
        material=material,
        surfaces=surfaces,
        start_height_m=height_m,
        start_turn=turn,
        gravity_m_s2=0.0 if "gravity" in _flags(model, "disable") else abs(float(model.opt.gravity[2])),
        time_step_s=options.time_step_s or usual_step_s,
        ground_m=ground_m,
        fixed=fixed,
        observed=options.observed or (_last(joints) if fixed else ""),
    )


def _last(joints: list[Joint]) -> str:
    """Return the body that most joints carry, the first of several."""
    depths: dict[str, int] = {}
    for joint in joints:
        depths[joint.child] = depths.get(joint.parent, 0) + 1
    return max(depths, key=lambda name: depths[name], default="")


def _surfaces(source: Source, bodies: Bodies) -> tuple[list[Body], Material, Surfaces]:
    """Return the bodies with their surfaces, the material of most, and the surfaces of the others."""
    found, usual, options, notes = (
        [bodies.body(head) for head in bodies.heads],
        Material(),
        source.options,
        source.notes,
    )
    static, dynamic = options.static_friction, options.dynamic_friction
    if source.is_urdf or static is not None or dynamic is not None:
        static = usual.static_friction if static is None else static
        dynamic = min(usual.dynamic_friction, static) if dynamic is None else dynamic
        notes.lose(f"friction of all contacts: static {static:g}, dynamic {dynamic:g}")
        return found, Material(static, dynamic), ()
    frictions = [bodies.friction(head) for head in bodies.heads]
    most = Counter(value for value in frictions if value is not None).most_common(1)
    common = most[0][0] if most else usual.static_friction
    notes.lose(f"friction: MuJoCo's one coefficient {common:g} is both the static and the dynamic one")
    others = sorted({value for value in frictions if value is not None} - {common})
    names = {value: f"friction_{value:g}" for value in others}
    found = [
        body if value not in names else replace(body, surface=names[value])
        for body, value in zip(found, frictions, strict=True)
    ]
    return found, Material(common, common), tuple((name, Material(value, value)) for value, name in names.items())


def _note_losses(source: Source) -> None:
    """Note what a compiled model has, and a World has not."""
    model, notes = source.model, source.notes
    notes.lose("collisions of the robot's bodies with each other are lost: bodies touch the ground alone")
    if source.is_urdf:
        return
    notes.lose("soft contacts and limits (solref, solimp, margin, condim, cone) are lost: contacts are rigid")
    _note_flags(model, notes)
    _note_forces(model, notes)
    for field, what in (("nsensor", "sensors"), ("nexclude", "excluded contacts"), ("npair", "pairs of contacts")):
        if count := int(getattr(model, field, 0)):
            notes.lose(f"{count} {what} are lost")
    if np.any(model.opt.gravity[:2]) or model.opt.gravity[2] > 0:
        notes.refuse(f"gravity is {model.opt.gravity.tolist()}, but must point down; a slope is a tunable")
    for field, what in (("density", "air or water"), ("viscosity", "air or water"), ("wind", "wind")):
        if np.any(getattr(model.opt, field)):
            notes.lose(f"{what} ({field}) is lost")


def _note_forces(model: Handle, notes: Notes) -> None:
    """Note springs, compensation of gravity and coefficients of damping, which a World has not."""
    bodies = [body_name(model, at) for at in range(model.nbody)]
    joints = [joint_name(model, at) for at in range(model.njnt)]
    owners = [joints[joint] for joint in model.dof_jntid]
    of_the_base = model.jnt_type[model.dof_jntid] == FREE
    springs = np.logical_or(model.jnt_stiffness, model.jnt_stiffnesspoly.any(axis=1))
    for line, names, has in (
        ("springs of joints are lost: {}", joints, springs),
        ("compensation of gravity (gravcomp) is lost: {}", bodies, model.body_gravcomp),
        ("compensation of gravity by motors (actuatorgravcomp) is lost: {}", joints, model.jnt_actgravcomp),
        ("damping is linear; its other coefficients are lost: {}", owners, model.dof_dampingpoly.any(axis=1)),
    ):
        if found := list(compress(names, has)):
            notes.lose(line, *found)
    for field, what in (("damping", "damping"), ("frictionloss", "dry friction"), ("armature", "armature")):
        if largest := float(np.max(getattr(model, f"dof_{field}")[of_the_base], initial=0.0)):
            notes.lose(f"{what} {largest:g} of the base's free joint is lost")


def _note_flags(model: Handle, notes: Notes) -> None:
    for what in ("disable", "enable"):
        if names := sorted(_flags(model, what) - {"gravity"}):
            notes.lose(f"flags that {what} a part of MuJoCo are lost: {{}}", *names)


def _flags(model: Handle, what: str) -> set[str]:
    """Return the names of the parts of MuJoCo that a file disables or enables."""
    kind, start = {"disable": ("mjtDisableBit", "mjDSBL_"), "enable": ("mjtEnableBit", "mjENBL_")}[what]
    bits, set_ = getattr(mujoco_library(), kind).__members__, int(getattr(model.opt, f"{what}flags"))
    return {
        name.removeprefix(start).lower() for name, bit in bits.items() if name.startswith(start) and set_ & int(bit)
    }


def _masses(source: Source, bodies: Bodies) -> Iterator[MassRow]:
    for head in bodies.heads:
        names = tuple(body_name(source.model, at) for at in bodies.members(head)) if head else ()
        before = sum(source.masses_kg.get(name, 0.0) for name in names)
        yield MassRow(bodies.name(head), names, before, bodies.mass_kg(head) if head else 0.0)


def _name(given: str) -> str:
    name = re.sub(r"[^a-z0-9]+", "_", given.lower()).strip("_")
    if not name:
        raise InvalidRobot([f"the name {given!r} has no letter from a to z and no digit; give one with --name"])
    return (name if name[:1].isalpha() else f"robot_{name}")[:LONGEST_NAME]


ROUNDED = 1e-4
"""Distance from a limit that the rounding of an angle in a file or an option explains, rad or m."""


def _start_angles(source: Source) -> FloatArray:
    """Return MuJoCo's `qpos`, `(nq,)`, at the start: a keyframe or the reference angles, the base as `options.turn`."""
    qpos, options = _angles_of_the_file(source), source.options
    if options.turn is not None:
        if source.model.jnt_type[0] != FREE:
            source.notes.refuse("the base is fixed to the world, so it cannot be turned")
        else:
            qpos[3:7] = np.roll(quaternion(Rotation.from_euler("xyz", options.turn)), 1)
    return qpos


def _angles_of_the_file(source: Source) -> FloatArray:
    keyframes, options, notes = source.keyframes, source.options, source.notes
    if options.keyframe is not None:
        names = [each.name for each in keyframes]
        keyframes = tuple(each for each in keyframes if each.name == options.keyframe)
        if not keyframes:
            notes.refuse(f"there is no keyframe {options.keyframe!r}; keyframes: {listed(names) or 'none'}")
            notes.check()
    return keyframes[0].qpos(source.model) if keyframes else np.array(source.model.qpos0)


def _with_starts(joints: list[Joint], source: Source, qpos: FloatArray) -> list[Joint]:
    """Return the joints with their angles at time 0: the user's, else the file's, else the middle of the limits."""
    model, options, notes = source.model, source.options, source.notes
    given = {
        joint_name(model, at): float(qpos[int(model.jnt_qposadr[at])])
        for at in range(model.njnt)
        if model.jnt_type[at] != FREE
    }
    unknown = [each for each in options.start if not any(fnmatchcase(joint.name, each) for joint in joints)]
    if unknown:
        names = listed((joint.name for joint in joints), 30)
        notes.refuse(f"no joint has a name like {listed(unknown)}, of which a start was given; joints: {names}")
    return [replace(joint, start=_start(joint, given[joint.name], options.start, notes)) for joint in joints]


def _start(joint: Joint, given: float, chosen: Mapping[str, float], notes: Notes) -> float:
    wanted = [angle for pattern, angle in chosen.items() if fnmatchcase(joint.name, pattern)]
    start = wanted[-1] if wanted else given
    if joint.limits is None:
        return start
    lower, upper = joint.limits
    nearest = min(max(start, lower), upper)
    if abs(start - nearest) <= ROUNDED:
        return nearest
    if wanted:
        notes.refuse(f"{joint.name} cannot start at {start:g}: its limits are {lower:g} to {upper:g}")
        return start
    notes.lose(
        f"starts at {(lower + upper) / 2:.4g}, since {start:g} is outside the limits; --start sets it: {{}}", joint.name
    )
    return (lower + upper) / 2


def _base_pose(
    bodies: Bodies, world_bodies: list[Body], joints: list[Joint], qpos: FloatArray, ground_m: float, *, fixed: bool
) -> tuple[float, Quaternion]:
    """Return height and rotation of the base: its lowest point touches the ground; a fixed base is only raised."""
    model, data = bodies.model, mujoco_library().MjData(bodies.model)
    data.qpos[:] = qpos
    for joint in joints:
        data.qpos[int(model.jnt_qposadr[joint_number(model, joint.name)])] = joint.start
    mujoco_library().mj_kinematics(model, data)
    lowest = [
        _lowest_m(part, *_frame(model, data, head))
        for head, body in zip(bodies.heads, world_bodies, strict=True)
        for part in body.parts
        if part.collides
    ]
    place, turn = _frame(model, data, bodies.heads[0])
    height, below = float(place[2]), min(lowest, default=ground_m) - ground_m
    return height - (min(below, 0.0) if fixed else below) + 0.0, quaternion(turn)


def _frame(model: Handle, data: Handle, head: int) -> tuple[FloatArray, Rotation]:
    turn = rotation_of(data.xquat[head])
    at = int(model.body_jntadr[head])
    is_free = at < 0 or model.jnt_type[at] == FREE
    return np.asarray(data.xpos[head] + (0 if is_free else turn.apply(model.jnt_pos[at]))), turn


def _lowest_m(part: Part, place_m: FloatArray, turn: Rotation) -> float:
    """Return the height of the lowest point of a part on a body whose frame has this place `(3,)` and rotation."""
    center = place_m + turn.apply(part.center_m)
    down = (turn * Rotation.from_quat(part.turn)).as_matrix()[2]
    shape = part.shape
    if isinstance(shape, Box):
        reach = float(np.abs(down) @ np.array(shape.size_m)) / 2
    elif isinstance(shape, Hull):
        reach = -float((np.array(shape.points_m) @ down).min())
    elif isinstance(shape, Cylinder):
        reach = abs(down[2]) * shape.length_m / 2 + shape.radius_m * float(np.sqrt(max(0.0, 1 - down[2] ** 2)))
    else:
        straight = shape.length_m / 2 if isinstance(shape, Capsule) else 0.0
        reach = abs(down[2]) * straight + shape.radius_m
    return float(center[2] - reach)
