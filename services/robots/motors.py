"""Motors of joints: those of an MJCF, or one kind for all joints of a URDF, which has none."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.robots.bodies import FREE, joint_name, joint_number
from gaplab.services.robots.options import Notes, listed
from gaplab.services.robots.reading import Handle, Source, mujoco_library
from gaplab.services.world.world import Joint, Motor, PDMotor

REACH_RAD, REACH_M = 0.35, 0.02
"""Error at which a motor whose gain is computed has its largest torque: a share of a usual step of a leg."""

DAMPING_RATIO = 0.7
"""Damping of a joint under a motor whose gains are computed; 1 is critical."""

SWING_RAD, SWING_M = 0.5, 0.02
"""Largest usual movement to each side of the start."""

BOUNDLESS_RAD = np.pi
"""Error for which a motor without a limit has torque enough, where the joint has no limits either."""

TURNS_RAD = 4 * np.pi
"""Limit of a hinge beyond which a file may mean degrees."""

_OPTIONS = {"servo": ("position_gain",), "position": ("kp", "kd"), "velocity": ("kp", "kd"), "torque": ()}
"""Options that the kinds of motors use, but for `max_torque`, which all use; kd of `velocity` may be computed of kp."""

FILTERS = {0, 2, 3}
"""MuJoCo's types of actuators' dynamics that a World may do without: none, and filters of the control."""


def with_motors(joints: list[Joint], source: Source) -> list[Joint]:
    """Return the joints with their motors: the file's, unless the options say which."""
    options, notes = source.options, source.notes
    if not joints:
        if options.fixed:
            notes.refuse("no joint of the file moves, and neither does its base")
        return joints
    if options.motor is None and not source.is_urdf:
        return _of_the_file(joints, source)
    chosen = [joint.name for joint in joints if fnmatchcase(joint.name, options.motored)]
    if not chosen:
        notes.refuse(f"no joint has a name like {options.motored!r}; joints: {listed((j.name for j in joints), 30)}")
    kind = options.motor or "position"
    why = "in place of the file's" if source.model.nu else "as the file has none"
    notes.lose(
        f"{'each joint gets' if len(chosen) == len(joints) else 'these joints get'} a motor, {why}: {{}}", *chosen
    )
    inertias = joint_inertias(source)
    _refuse_unused(_OPTIONS[kind], kind, source)
    return [_driven(j, kind, inertias[j.name], source) if j.name in chosen else j for j in joints]


def _driven(joint: Joint, kind: str, inertia: float, source: Source) -> Joint:
    options, notes = source.options, source.notes
    torque = options.max_torque or effort(source.model, joint.name)
    unit = "N" if joint.slides else "N·m"
    needed = needed_torque(source.model, joint.name)
    if torque is not None and options.max_torque is None and torque > PLACEHOLDER * needed:
        line = f"{torque:g} {unit} is more than {PLACEHOLDER:g} times what the robot's weight needs, and is taken for"
        notes.lose(
            f"{line} the largest effort, from which gains follow; `-s max_torque=` sets another: {{}}", joint.name
        )
    if torque is None:
        torque = needed
        notes.lose(f"{joint.name} has no largest effort: {torque:.3g} {unit}, of the robot's weight")
    if kind == "servo":
        speed = source.speeds.get(joint.name, 20.0)
        return replace(joint, motor=Motor(options.position_gain, torque, speed))
    reach = REACH_M if joint.slides else REACH_RAD
    kp = options.kp or torque / reach
    kd = options.kd or 2 * DAMPING_RATIO * float(np.sqrt(kp * inertia))
    if joint.name in source.speeds:
        notes.lose("velocity limits are lost, which a servo keeps: {}", joint.name)
    if kind == "position":
        return replace(joint, motor=PDMotor("position", torque, kp, kd))
    if kind == "velocity":
        return replace(joint, motor=PDMotor("velocity", torque, kd=kd), swing=source.speeds.get(joint.name, 5.0) / 2)
    return replace(joint, motor=PDMotor("torque", torque), swing=torque / 2)


def _of_the_file(joints: list[Joint], source: Source) -> list[Joint]:
    notes = source.notes
    found = dict(_motors(source, {joint.name: joint for joint in joints}))
    if len(found) == 0:
        notes.refuse("the file has no actuators: give all joints a motor with --motor")
    order = [joint.name for joint in joints if joint.name in found]
    if order != list(found):
        notes.lose("the order of actuators is that of the joints: {}", *order)
    kinds = sorted({joint.motor.follows for joint in found.values() if isinstance(joint.motor, PDMotor)})
    used = {option for kind in kinds for option in _OPTIONS[kind] if (kind, option) != ("velocity", "kp")}
    if kinds:
        _refuse_unused(used, " or ".join(kinds), source)
    return [found.get(joint.name, joint) for joint in joints]


def _refuse_unused(used: Collection[str], kinds: str, source: Source) -> None:
    """Refuse options that would change nothing."""
    names = {"kp", "kd", "position_gain"}
    for name, value in source.options.model_dump(include=names, exclude_defaults=True).items():
        if name not in used:
            source.notes.refuse(
                f"{name}={value:g} has no effect on {kinds} motors: leave it out, or choose others with --motor"
            )


def _motors(source: Source, joints: Mapping[str, Joint]) -> Iterator[tuple[str, Joint]]:
    model, notes, seen = source.model, source.notes, set()
    for at in range(model.nu):
        name = str(model.actuator(at).name) or f"actuator{at}"
        if int(model.actuator_trntype[at]) != 0:
            notes.refuse(f"actuator {name} does not move a joint")
            continue
        joint = joints.get(joint_name(model, int(np.ravel(model.actuator_trnid[at])[0])))
        if joint is None:
            notes.refuse(f"actuator {name} moves the base")
        elif joint.name in seen:
            notes.refuse(f"actuator {name} is the second one of joint {joint.name}")
        elif int(model.actuator_gaintype[at]) != 0 or int(model.actuator_biastype[at]) > 1:
            notes.refuse(f"actuator {name} is not a motor, position or velocity actuator")
        else:
            seen.add(joint.name)
            yield joint.name, _motor(source, at, name, joint)


def _motor(source: Source, at: int, name: str, joint: Joint) -> Joint:
    model, options, notes = source.model, source.options, source.notes
    gear, gain = float(model.actuator_gear[at, 0]), float(model.actuator_gainprm[at, 0])
    _, stiffness, damping = (-float(value) for value in model.actuator_biasprm[at, :3])
    kind = "position" if stiffness > 0 else "velocity" if damping > 0 else "torque"
    matches = {"position": gain == stiffness, "velocity": gain == damping, "torque": True}
    dynamics = int(model.actuator_dyntype[at])
    if not matches[kind] or gear == 0 or model.actuator_biasprm[at, 0] != 0 or dynamics not in FILTERS:
        notes.refuse(f"actuator {name} is not a motor, position or velocity actuator")
        return joint
    if dynamics:
        notes.lose("activation dynamics are lost: {}", name)
    _note_units(model, at, name, gear * gain if kind == "torque" else 1 / gear, notes)
    _note_ranges(model, at, name, kind, notes)
    kp = (options.kp or gear * gear * stiffness) if kind == "position" else 0.0
    kd = gear * gear * damping if kind == "torque" else options.kd or gear * gear * damping
    limit = options.max_torque or _limit(model, at, joint, gear, gain)
    if limit is None:
        limit = needed_torque(model, joint.name) if kind == "torque" else _unlimited(joint, kp or kd, kind)
        why = "of the robot's weight" if kind == "torque" else "which is more than it needs"
        notes.lose(f"actuator {name} has no largest torque: {limit:.4g} {'N' if joint.slides else 'N·m'}, {why}")
    motor = PDMotor(kind, limit, kp, kd)  # type: ignore[arg-type]
    return replace(joint, motor=motor, swing=limit / 2 if kind == "torque" else joint.swing)


def _note_units(model: Handle, at: int, name: str, factor: float, notes: Notes) -> None:
    if factor != 1:
        notes.lose(f"targets are those of the joint, {factor:g} times MuJoCo's control: {{}}", name)
    for field in ("damping", "dampingpoly", "armature", "delay"):
        if np.any(getattr(model, f"actuator_{field}", np.zeros(model.nu))[at]):
            notes.lose(f"{field.removesuffix('poly')} of actuators is lost: {{}}", name)


_ONE_LIMIT = "torque has the same limit to both sides, where {} is {:g} to {:g}: {{}}"


def _note_ranges(model: Handle, at: int, name: str, kind: str, notes: Notes) -> None:
    """Note the limits that a motor lacks: its targets have none, and its torque has the same to both sides."""
    for field in ("ctrlrange", "forcerange"):
        lower, upper = (float(value) for value in getattr(model, f"actuator_{field}")[at])
        if not getattr(model, f"actuator_{field.removesuffix('range')}limited")[at]:
            continue
        if field == "ctrlrange" and kind != "torque":
            notes.lose(f"targets have no limits, where {field} is {lower:g} to {upper:g}: {{}}", name)
        elif lower != -upper:
            notes.lose(_ONE_LIMIT.format(field, lower, upper), name)
    joint = model.actuator_trnid[at, 0]
    lower, upper = (float(value) for value in model.jnt_actfrcrange[joint])
    if model.jnt_actfrclimited[joint] and lower != -upper:
        notes.lose(_ONE_LIMIT.format("actuatorfrcrange", lower, upper), name)


def _limit(model: Handle, at: int, joint: Joint, gear: float, gain: float) -> float | None:
    """Return the largest torque on the joint; None if the file has no limit."""
    found = []
    if model.actuator_forcelimited[at]:
        found.append(abs(gear) * float(np.abs(model.actuator_forcerange[at]).max()))
    if model.actuator_ctrllimited[at] and not model.actuator_biasprm[at].any():
        found.append(abs(gear * gain) * float(np.abs(model.actuator_ctrlrange[at]).max()))
    if (largest := effort(model, joint.name)) is not None:
        found.append(largest)
    return min(found, default=None)


def _unlimited(joint: Joint, gain: float, kind: str) -> float:
    lower, upper = joint.limits or (-BOUNDLESS_RAD, BOUNDLESS_RAD)
    return abs(gain) * max(upper - lower, 1.0) * (1 if kind == "position" else 20)


def with_swings(joints: list[Joint], notes: Notes) -> list[Joint]:
    """Return the joints with the usual movement of their position motors.

    It is 0.5 rad or 0.02 m, but at most the way to the nearer limit, and at least a tenth of the range.
    """
    if turning := [each for each in joints if not each.slides and max(map(abs, each.limits or (0.0,))) > TURNS_RAD]:
        largest = max(max(map(abs, each.limits or ())) for each in turning)
        line = f"limits up to {largest:g} rad, {largest / (2 * np.pi):.0f} turns, are taken as they are, not as degrees"
        notes.lose(f"{line}: {{}}", *(each.name for each in turning))
    return [_with_swing(joint) for joint in joints]


def _with_swing(joint: Joint) -> Joint:
    if joint.motor is None or getattr(joint.motor, "follows", "position") != "position":
        return joint
    swing = SWING_M if joint.slides else SWING_RAD
    if joint.limits is None:
        return replace(joint, swing=swing)
    lower, upper = joint.limits
    nearer = min(joint.start - lower, upper - joint.start)
    return replace(joint, swing=min(swing, max(nearer, 0.1 * (upper - lower))))


PLACEHOLDER = 50.0
"""Effort, as a multiple of what bears the robot's weight, that stands in files whose author did not know it."""


def effort(model: Handle, name: str) -> float | None:
    """Return the largest effort of a joint in the file, N·m or N; None if it has none."""
    at = joint_number(model, name)
    largest = float(np.abs(model.jnt_actfrcrange[at]).max())
    return largest if model.jnt_actfrclimited[at] and largest > 0 else None


def needed_torque(model: Handle, name: str) -> float:
    """Return half the torque that bears the robot at the farthest point of the limb, as legs share the weight."""
    mujoco = mujoco_library()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    at = joint_number(model, name)
    moved = {int(model.jnt_bodyid[at])}
    for body in range(model.nbody):
        if int(model.body_parentid[body]) in moved:
            moved.add(body)
    geoms = [geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in moved]
    reaches = [np.linalg.norm(data.geom_xpos[geom] - data.xanchor[at]) + model.geom_rbound[geom] for geom in geoms]
    weight = float(model.body_mass.sum()) * 9.81
    return weight if model.jnt_type[at] == 2 else 0.5 * weight * float(max(reaches, default=0.1))


def joint_inertias(source: Source) -> Mapping[str, float]:
    """Return the inertia of each joint, kg m² or kg; a fixed base does not give way to its motors."""
    model = source.model
    dofs = [dof for dof in range(model.nv) if model.jnt_type[model.dof_jntid[dof]] != FREE]
    is_held = source.fixed and model.jnt_type[0] == FREE
    inverse = _inverse_on_a_fixed_base(model) if is_held else model.dof_invweight0
    return {joint_name(model, int(model.dof_jntid[dof])): 1 / float(inverse[dof]) for dof in dofs}


def _inverse_on_a_fixed_base(model: Handle) -> FloatArray:
    """Return `(nv,)`: the inverse inertia of each degree of freedom, 0 for the six of the base."""
    mujoco = mujoco_library()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    return np.concatenate([np.zeros(6), np.diag(np.linalg.inv(matrix[6:, 6:]))])
