"""A URDF or MJCF as a MuJoCo model whose base is free, so that no mass is welded to the world.

Masses and inertias that no rigid body has are refused, or replaced where the user asks for it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import EngineUnavailable, InvalidRobot
from gaplab.services.engines.mujoco.pool import unlogged
from gaplab.services.robots.options import ImportOptions, Notes, listed
from gaplab.services.robots.urdf import read_urdf
from gaplab.services.robots.xml import tree

Handle: TypeAlias = Any
"""An object of MuJoCo's, which has no types."""

INIT_QPOS = "init_qpos"
"""Name of the numbers that are the start in Gymnasium's files."""


@dataclass(frozen=True)
class Keyframe:
    """The start of a robot in its file.

    Attributes:
        name: its name in the file.
        angles: angle or place of each hinge and slide, by the name of the joint, or by the number of its body.
        base: `(7,)`: place and quaternion of a free base; None if the file has no free joint.
    """

    name: str
    angles: Mapping[str | int, float]
    base: FloatArray | None

    def qpos(self, model: Handle) -> FloatArray:
        """Return MuJoCo's `qpos`, `(nq,)`, of a model whose joints are not those of the file."""
        qpos = np.array(model.qpos0)
        if self.base is not None and model.jnt_type[0] == 0:
            qpos[:7] = self.base
        for at in range(model.njnt):
            if model.jnt_type[at] >= 2:
                place = int(model.jnt_qposadr[at])
                qpos[place] = self.angles.get(_key(model, at), qpos[place])
        return qpos


def take_keyframes(spec: Handle, notes: Notes, *, with_sensors: bool) -> tuple[Keyframe, ...]:
    """Return the keyframes of a spec, and then its `init_qpos`; delete what a change of the joints would break.

    MuJoCo pads the keyframes of a spec to which a joint is added at their end: angles would become a pose of the base.
    Sensors are deleted too if joints or actuators will be.
    """
    found = _keyframes(spec) if spec.keys or any(each.name == INIT_QPOS for each in spec.numerics) else ()
    sensors = list(spec.sensors) if with_sensors else []
    if sensors:
        notes.lose(f"{len(sensors)} sensors are lost")
    for each in [*spec.keys, *sensors]:
        spec.delete(each)
    return found


def _keyframes(spec: Handle) -> tuple[Keyframe, ...]:
    copy = spec.copy()
    copy.compiler.fusestatic = False
    copy.compiler.balanceinertia = True
    copy.compiler.boundmass = copy.compiler.boundinertia = 1.0  # its masses are of no use, and `mend` comes later
    model = copy.compile()
    found = [(str(model.key(at).name), model.key_qpos[at]) for at in range(model.nkey)]
    for at in range(model.nnumeric):
        if model.numeric(at).name == INIT_QPOS and model.numeric_size[at] == model.nq:
            found.append((INIT_QPOS, model.numeric(at).data))
    return tuple(_keyframe(model, name, np.array(qpos)) for name, qpos in found)


def _keyframe(model: Handle, name: str, qpos: FloatArray) -> Keyframe:
    places = {at: int(model.jnt_qposadr[at]) for at in range(model.njnt)}
    angles = {_key(model, at): float(qpos[place]) for at, place in places.items() if model.jnt_type[at] >= 2}
    free = [place for at, place in places.items() if model.jnt_type[at] == 0]
    return Keyframe(name, angles, qpos[free[0] : free[0] + 7] if free else None)


def _key(model: Handle, at: int) -> str | int:
    """Return the name of a joint, or the number of its body, as the numbers of joints change."""
    return str(model.joint(at).name) or int(model.jnt_bodyid[at])


@dataclass(frozen=True)
class Source:
    """A URDF or MJCF, compiled by MuJoCo.

    Attributes:
        model: MuJoCo's `MjModel`, with static bodies of their own.
        is_urdf: true for a URDF, false for MJCF.
        name: name of the robot in the file.
        masses_kg: mass of each body as the file says it, before anything was changed.
        speeds: speed limits by joint, rad/s or m/s.
        fixed: whether the base never moves.
        options: options of its import.
        notes: what is said about its import.
        keyframes: starts that an MJCF has; the first is the usual one.
    """

    model: Handle
    is_urdf: bool
    name: str
    masses_kg: Mapping[str, float]
    speeds: Mapping[str, float]
    fixed: bool
    options: ImportOptions
    notes: Notes
    keyframes: tuple[Keyframe, ...] = ()


def mujoco_library() -> Handle:
    """Return the module `mujoco`.

    Raises:
        EngineUnavailable: it is not installed.
    """
    if find_spec("mujoco") is None:
        raise EngineUnavailable("the import of robots needs MuJoCo: pip install 'gaplab[mujoco]'")
    return import_module("mujoco")


def read_source(file: Path, text: str, options: ImportOptions, notes: Notes) -> Source:
    """Return a compiled URDF or MJCF.

    Raises:
        InvalidRobot: it is neither, or has what a World cannot have.
    """
    mujoco = mujoco_library()
    try:
        with unlogged(mujoco):
            return _read(mujoco, file, text, options, notes)
    except (ValueError, SyntaxError) as error:
        message = error.msg if isinstance(error, SyntaxError) else str(error)
        raise InvalidRobot([*notes.refused, " ".join(message.split())]) from error


def _read(mujoco: Handle, file: Path, text: str, options: ImportOptions, notes: Notes) -> Source:
    root = tree(text).tag
    if root not in {"robot", "mujoco"}:
        raise InvalidRobot([f"the file is <{root}>, but an import reads URDF, <robot>, and MJCF, <mujoco>"])
    is_urdf = root == "robot"
    if is_urdf:
        urdf = read_urdf(file, text, options, notes)
        spec = mujoco.MjSpec.from_string(urdf.text, assets=urdf.assets or None)
        for body in spec.bodies:
            if body.name in urdf.massless:
                without_mass(body)
        fixed = options.fixed or urdf.fixed
        source = Source(None, is_urdf, urdf.name, urdf.masses_kg, urdf.speeds, fixed, options, notes)
    else:
        spec = mujoco.MjSpec.from_file(str(file))
        keyframes = take_keyframes(spec, notes, with_sensors=bool(options.lock))
        source = Source(None, is_urdf, spec.modelname, {}, {}, options.fixed, options, notes, keyframes)
        _lock(spec, options, notes)
    return _compiled(spec, source)


def _compiled(spec: Handle, source: Source) -> Source:
    notes = source.notes
    _refuse(spec, notes)
    spec.compiler.fusestatic = False
    root = _root(spec, notes)
    notes.check()
    fixed, replaced = source.fixed, dict[str, float]()
    if not root.joints:
        fixed = fixed or not source.is_urdf
        root.add_freejoint()
    if fixed and all("FREE" in str(joint.type) for joint in root.joints):  # else the base is the world
        replaced.update(hold(root, notes))
    moved = {body.name or f"body{at}" for at, body in enumerate(spec.bodies) if body.joints}
    replaced.update(mend(spec, notes, moved, allowed=source.options.mend))
    notes.check()
    model = spec.compile()
    compiled = {body_name(model, at): float(model.body_mass[at]) for at in range(1, model.nbody)}
    return replace(
        source, model=model, masses_kg=source.masses_kg if source.is_urdf else compiled | replaced, fixed=fixed
    )


def _root(spec: Handle, notes: Notes) -> Handle:
    """Return the body that carries all others; note static things besides it."""
    bodies = spec.worldbody.find_all("body")
    roots = [body for body in bodies if body.parent == spec.worldbody]
    if len(roots) != 1:
        notes.refuse(f"the file has {len(roots)} separate bodies, but a robot has one base: {listed(_names(roots))}")
        notes.check()
    geoms = [geom for geom in spec.geoms if geom.parent == spec.worldbody]
    planes = [geom for geom in geoms if "PLANE" in str(geom.type)]
    if planes:
        notes.lose("the ground of the file is replaced by that of the world: the plane z = 0")
    if others := [geom for geom in geoms if geom not in planes]:
        notes.lose("static shapes of the scene are lost: {}", *_names(others))
    return roots[0]


def _lock(spec: Handle, options: ImportOptions, notes: Notes) -> None:
    """Fix joints at their reference angles, and delete their actuators."""
    notes.refuse_unknown(options.lock, [joint.name for joint in spec.joints])
    for joint in list(spec.joints):
        if options.locks(joint.name):
            for actuator in [each for each in spec.actuators if each.target == joint.name]:
                spec.delete(actuator)
            spec.delete(joint)


_COUPLINGS = {
    "equalities": "gaplab has no constraints but joints",
    "tendons": "gaplab has motors on joints alone",
    "flexes": "the bodies of gaplab are rigid",
}
"""Why elements of a spec are refused, by the name of their list."""


def _refuse(spec: Handle, notes: Notes) -> None:
    for joint in spec.joints:
        kind, name = str(joint.type).rpartition("_")[2].lower(), joint.name or "(unnamed)"
        if kind == "ball":
            notes.refuse(f"joint {name} is a ball joint, but must be a hinge or slide; --lock fixes it")
        if kind == "free" and joint.parent.parent != spec.worldbody:
            notes.refuse(f"joint {name} is free, but its body is not the base")
    for kind, why in _COUPLINGS.items():
        for name in _names(each for each in getattr(spec, kind) if getattr(each, "active", True)):
            notes.refuse(f"{kind}: {name}, but {why}")
    for body in spec.bodies:
        if len(body.joints) > 1:
            names = listed(_names(body.joints))
            notes.refuse(f"body {body.name} has {len(body.joints)} joints ({names}), but at most one is permitted")


def _names(things: Handle) -> list[str]:
    return [thing.name or "(unnamed)" for thing in things]


def body_name(model: Handle, at: int) -> str:
    """Return the name of a body, or one made of its number."""
    return str(model.body(at).name) or f"body{at}"


LEAST_KG = 0.001
"""Mass that a moving body without one gets."""

HELD_KG = 1.0
"""Mass that a base gets that never moves and has none."""

GYRATION_M = 0.03
"""Radius of gyration of a mended body without shapes."""

ROUNDING = 1e-6
"""Share by which a moment may exceed the sum of the other two, as files have rounded numbers: MuJoCo's own."""


def hold(base: Handle, notes: Notes) -> Mapping[str, float]:
    """Give a fixed base a mass and an inertia, if it has none; no number depends on them.

    Return the mass that was replaced, by the name of the body.
    """
    if not _is_empty(base):
        return {}
    _state(base)
    before = float(base.mass)
    base.mass = max(before, HELD_KG)
    _change(base, HELD_KG)
    notes.lose("{} has no mass or no inertia, but never moves: it gets 1 kg m²", base.name or "the base")
    return {base.name or "body1": before}


def without_mass(body: Handle) -> None:
    """Let a body of a spec have neither mass nor inertia, whatever its shapes are."""
    _state(body)
    body.mass = 0.0
    _change(body, 0.0)


def mend(spec: Handle, notes: Notes, moved: set[str], *, allowed: bool) -> Mapping[str, float]:
    """Replace what no rigid body has, or refuse it; return the masses that were replaced, by the names of the bodies.

    Moments that break the triangle inequality become their mean, as by MuJoCo's `balanceinertia`. Moments of zero
    become those of the body's shapes at uniform density, and a mass of zero is that of the shapes at 1000 kg/m³.
    `moved` are the names of the bodies with joints.
    """
    empty = []
    is_bounded = min(spec.compiler.boundmass, spec.compiler.boundinertia) > 0  # MuJoCo then gives each body some
    for at, body in enumerate(spec.bodies):
        name = body.name or f"body{at}"
        moments = _moments(body)
        if body.explicitinertial and max(moments) > (sum(moments) - max(moments)) * (1 + ROUNDING):
            given = ", ".join(f"{moment:.4g}" for moment in moments)
            mean = float(np.mean(moments))
            _change(body, mean) if allowed else None
            _note(notes, allowed, f"{name}: moments {given} kg m² break the triangle inequality", f"{mean:.4g} each")
        elif name in moved and not is_bounded and not _carried(body) and _is_empty(body):
            empty.append((at, body, name))
    if not allowed:
        for _, body, name in empty:
            _note(notes, allowed, f"{name} moves, but has mass {body.mass:.4g} kg and a moment of inertia of 0", "")
        return {}
    replaced = {name: float(body.mass) for _, body, name in empty}
    if empty:
        _fill(spec, empty, notes)
    return replaced


def _note(notes: Notes, allowed: bool, fault: str, instead: str) -> None:
    if allowed:
        notes.lose(f"{fault}: mended to {instead}")
    else:
        notes.refuse(f"{fault}; --mend replaces it")


def _moments(body: Handle) -> FloatArray:
    """Return `(3,)`: the principal moments that a body of a spec has."""
    full = np.array(body.fullinertia)
    if np.isnan(full[0]):
        return np.sort(np.array(body.inertia, dtype=float))
    xx, yy, zz, xy, xz, yz = full
    return np.asarray(np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


def _change(body: Handle, *moments: float) -> None:
    body.fullinertia = [np.nan, 0, 0, 0, 0, 0]
    body.inertia = moments * (1 if len(moments) == 3 else 3)


def _is_empty(body: Handle) -> bool:
    """Return whether a body has no mass or no inertia."""
    if not body.explicitinertial:
        return not _has_mass(body)
    return bool(body.mass <= 0 or min(_moments(body)) <= 0)


def _carried(body: Handle) -> bool:
    """Return whether a massless body has its mass from bodies that are fixed to it."""
    return body.mass <= 0 and any(_has_mass(child) for child in body.bodies if not child.joints)


def _has_mass(body: Handle) -> bool:
    """Return whether a body has mass: its own, that of its shapes, or that of bodies that are fixed to it."""
    has_own = body.mass > 0 if body.explicitinertial else any(map(_is_heavy, body.geoms))
    return has_own or any(_has_mass(child) for child in body.bodies if not child.joints)


def _is_heavy(geom: Handle) -> bool:
    return bool(geom.density > 0 if np.isnan(geom.mass) else geom.mass > 0)


def _state(body: Handle) -> None:
    """Let a body whose mass would be that of its shapes have one of its own, with its centre at the origin."""
    if not body.explicitinertial:
        body.explicitinertial, body.ipos = True, [0.0] * 3


def _fill(spec: Handle, empty: list[tuple[int, Any, str]], notes: Notes) -> None:
    """Give bodies the inertia of their shapes: a copy of the spec is compiled, in which MuJoCo computes it."""
    copy, shaped = spec.copy(), set[int]()
    for at, _, _ in empty:
        twin = copy.bodies[at]
        _change(twin, 1.0)  # MuJoCo refuses the moments of zero even where it does not use them
        if any(map(_is_heavy, twin.geoms)):
            shaped.add(at)
            twin.explicitinertial, twin.ipos = False, [np.nan] * 3  # MuJoCo computes what has no centre of mass
        else:
            _state(twin)
            twin.mass = 1.0
            _change(twin, GYRATION_M**2)
    model = copy.compile()
    for at, body, name in empty:
        found = model.body(at)
        before = body.mass
        _state(body)
        body.mass = float(found.mass[0]) if before <= 0 and at in shaped else max(before, LEAST_KG)
        moments = found.inertia * body.mass / float(found.mass[0])
        _change(body, *moments.tolist())
        body.iquat = found.iquat
        given = ", ".join(f"{moment:.3g}" for moment in moments)
        _note(notes, True, f"{name}: mass {before:.4g} kg, inertia 0", f"{body.mass:.4g} kg and {given} kg m²")
