"""A URDF or MJCF as a MuJoCo model whose base is free, so that no mass is welded to the world."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import EngineUnavailable, InvalidRobot
from gaplab.services.engines.mujoco.logs import unlogged
from gaplab.services.robots.mending import hold, mend, without_mass
from gaplab.services.robots.options import ImportOptions, Notes, listed
from gaplab.services.robots.urdf import read_urdf
from gaplab.services.robots.xml import tree

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

    def qpos(self, model: Any) -> FloatArray:  # noqa: ANN401
        """Return MuJoCo's `qpos`, `(nq,)`, of a model whose joints are not those of the file."""
        qpos = np.array(model.qpos0)
        if self.base is not None and model.jnt_type[0] == 0:
            qpos[:7] = self.base
        for at in range(model.njnt):
            if model.jnt_type[at] >= 2:
                place = int(model.jnt_qposadr[at])
                qpos[place] = self.angles.get(_key(model, at), qpos[place])
        return qpos


def take_keyframes(spec: Any, notes: Notes, *, with_sensors: bool) -> tuple[Keyframe, ...]:  # noqa: ANN401
    """Return the keyframes of a spec, and then its `init_qpos`; delete what a change of the joints would break.

    MuJoCo pads the keyframes of a spec to which a joint is added at their end: angles would become a pose of the base.

    Args:
        spec: MuJoCo's `MjSpec` as it was read; it loses its keyframes.
        notes: what is said about it.
        with_sensors: whether the sensors are deleted too, since joints or actuators will be.
    """
    found = _keyframes(spec) if spec.keys or any(each.name == INIT_QPOS for each in spec.numerics) else ()
    sensors = list(spec.sensors) if with_sensors else []
    if sensors:
        notes.lose(f"{len(sensors)} sensors are lost")
    for each in [*spec.keys, *sensors]:
        spec.delete(each)
    return found


def _keyframes(spec: Any) -> tuple[Keyframe, ...]:  # noqa: ANN401
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


def _keyframe(model: Any, name: str, qpos: FloatArray) -> Keyframe:  # noqa: ANN401
    places = {at: int(model.jnt_qposadr[at]) for at in range(model.njnt)}
    angles = {_key(model, at): float(qpos[place]) for at, place in places.items() if model.jnt_type[at] >= 2}
    free = [place for at, place in places.items() if model.jnt_type[at] == 0]
    return Keyframe(name, angles, qpos[free[0] : free[0] + 7] if free else None)


def _key(model: Any, at: int) -> str | int:  # noqa: ANN401
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
        keyframes: starts that an MJCF has; the first is the usual one.
    """

    model: Any
    is_urdf: bool
    name: str
    masses_kg: Mapping[str, float]
    speeds: Mapping[str, float]
    fixed: bool
    keyframes: tuple[Keyframe, ...] = ()


def mujoco_library() -> Any:  # noqa: ANN401 - MuJoCo has no types
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


def _read(mujoco: Any, file: Path, text: str, options: ImportOptions, notes: Notes) -> Source:  # noqa: ANN401
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
        source = Source(None, is_urdf, urdf.name, urdf.masses_kg, urdf.speeds, options.fixed or urdf.fixed)
    else:
        spec = mujoco.MjSpec.from_file(str(file))
        keyframes = take_keyframes(spec, notes, with_sensors=bool(options.lock))
        source = Source(None, is_urdf, spec.modelname, {}, {}, options.fixed, keyframes)
        _lock(spec, options, notes)
    return _compiled(spec, options, notes, source)


def _compiled(spec: Any, options: ImportOptions, notes: Notes, source: Source) -> Source:  # noqa: ANN401
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
    replaced.update(mend(spec, notes, moved, allowed=options.mend))
    notes.check()
    model = spec.compile()
    compiled = {body_name(model, at): float(model.body_mass[at]) for at in range(1, model.nbody)}
    return replace(
        source, model=model, masses_kg=source.masses_kg if source.is_urdf else compiled | replaced, fixed=fixed
    )


def _root(spec: Any, notes: Notes) -> Any:  # noqa: ANN401
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


def _lock(spec: Any, options: ImportOptions, notes: Notes) -> None:  # noqa: ANN401
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


def _refuse(spec: Any, notes: Notes) -> None:  # noqa: ANN401
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


def _names(things: Any) -> list[str]:  # noqa: ANN401
    return [thing.name or "(unnamed)" for thing in things]


def body_name(model: Any, at: int) -> str:  # noqa: ANN401
    """Return the name of a body, or one made of its number."""
    return str(model.body(at).name) or f"body{at}"
