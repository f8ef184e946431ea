"""Checks of a world that did not come from gaplab's own code: each violation has its place and what is permitted."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Set
from typing import Any

import numpy as np

from gaplab.services.core.errors import Violation
from gaplab.services.world.world import Body, Box, Hull, Inertia, Joint, Material, Motor, PDMotor, Shape, World

MOST_BODIES = 200
"""Largest number of bodies, and of joints, which are fewer."""

LONGEST_NAME = 100

UNIT = 1e-6
"""Largest difference of a unit vector's length from 1."""

TRIANGLE = 1e-9
"""Share by which a moment of inertia may exceed the sum of the other two: rounding."""

SHORTEST_STEP_S = 1e-5

LATEST_S = 10.0
"""Largest delay, offset of time and latency, and largest noise in its unit."""

HIGHEST_M = 1.0
"""Largest height of the ground, up or down: engines take a base that is deeper for one that fell through it."""

SHORTEST_M, LONGEST_M = 1e-6, 1e4
"""Smallest and largest dimension of a shape."""

SMALLEST_HULL_M = 1e-4
"""Smallest length of a hull, which engines compute from its vertices."""

FLAT = 1e-9
"""Thickness of a hull, as a share of its length, at which it has no volume."""

_Check = tuple[str, Any, bool, str]
"""The end of a pointer, the value, whether it is permitted, and what is permitted."""


def world_violations(world: World) -> Iterator[Violation]:
    """Yield every reason why a world, whose values have the types that its fields say, cannot be that of a robot."""
    count = len(world.bodies)
    if not 1 <= count <= MOST_BODIES:
        yield _violation("/bodies", count, f"1 to {MOST_BODIES} bodies")
        return
    surfaces = {"", *(name for name, _ in world.surfaces)}
    for at, body in enumerate(world.bodies):
        yield from _failed(f"/bodies/{at}", _body_checks(body, surfaces))
    for at, joint in enumerate(world.joints):
        yield from _failed(f"/joints/{at}", _joint_checks(joint))
    yield from _failed("", _world_checks(world))
    for at, (name, material) in enumerate(world.surfaces):
        yield from _failed(f"/surfaces/{at}", [_name_check("/0", name), *_material_checks(material, "/1")])
    yield from _name_violations(world)
    yield from _tree_violations(world)


def _failed(place: str, checks: Iterable[_Check]) -> Iterator[Violation]:
    for end, value, good, permitted in checks:
        if not good:
            yield _violation(place + end, value, permitted)


def _violation(pointer: str, value: Any, permitted: str) -> Violation:  # noqa: ANN401 - any value of a world
    field = next((part for part in reversed(pointer.split("/")) if not part.isdigit()), "it")
    return Violation(pointer, value, f"{field} must be {permitted}, not {value!r}", permitted)


def _body_checks(body: Body, surfaces: Set[str]) -> Iterator[_Check]:
    yield _name_check("/name", body.name)
    yield "/mass_kg", body.mass_kg, body.mass_kg > 0, "above 0"
    yield "/surface", body.surface, body.surface in surfaces, "one of the world's surfaces"
    if body.inertia is not None:
        yield from _inertia_checks(body.inertia)
    if not isinstance(body.shape, tuple):
        yield from _shape_checks(body.shape, "/shape")
        yield "/shape", "a hull", body.inertia is not None or not isinstance(body.shape, Hull), "with an inertia"
        return
    for at, part in enumerate(body.shape):
        yield from _shape_checks(part.shape, f"/shape/{at}/shape")
        yield f"/shape/{at}/turn", part.turn, _is_unit(part.turn), "a quaternion of length 1"


def _inertia_checks(inertia: Inertia) -> Iterator[_Check]:
    moments = inertia.moments_kg_m2
    balanced = max(moments) * (1 - TRIANGLE) <= sum(moments) - max(moments)
    yield "/inertia/moments_kg_m2", moments, min(moments) > 0, "above 0, each"
    yield "/inertia/moments_kg_m2", moments, balanced, "such that none exceeds the sum of the other two"
    yield "/inertia/turn", inertia.turn, _is_unit(inertia.turn), "a quaternion of length 1"


def _shape_checks(shape: Shape, place: str) -> Iterator[_Check]:
    if isinstance(shape, Box):
        yield _length_check(f"{place}/size_m", shape.size_m)
    elif isinstance(shape, Hull):
        count = len(shape.points_m)
        ends = np.ptp(np.array(shape.points_m), axis=0) if count else np.zeros(1)
        permitted = f"{SMALLEST_HULL_M:g} to {LONGEST_M:g} m long along the longest axis"
        yield f"{place}/points_m", float(ends.max()), SMALLEST_HULL_M <= ends.max() <= LONGEST_M, permitted
        yield f"{place}/points_m", count, count >= 4, "at least 4 points"
        yield f"{place}/points_m", count, count < 4 or _has_volume(shape), "points that enclose a volume"
    else:
        yield _length_check(f"{place}/radius_m", shape.radius_m)
        yield _length_check(f"{place}/length_m", getattr(shape, "length_m", 1.0))


def _length_check(place: str, length: float | tuple[float, ...]) -> _Check:
    lengths = length if isinstance(length, tuple) else (length,)
    good = min(lengths) >= SHORTEST_M and max(lengths) <= LONGEST_M
    return place, length, good, f"{SHORTEST_M:g} to {LONGEST_M:g}" + (", each" if len(lengths) > 1 else "")


def _has_volume(hull: Hull) -> bool:
    points = np.array(hull.points_m)
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[-1] > FLAT * spread[0])


def _joint_checks(joint: Joint) -> Iterator[_Check]:
    yield _name_check("/name", joint.name)
    yield "/axis", joint.axis, _is_unit(joint.axis), "a vector of length 1"
    yield "/turn", joint.turn, _is_unit(joint.turn), "a quaternion of length 1"
    for name in ("damping", "dry_friction", "static_friction", "armature"):
        yield f"/{name}", getattr(joint, name), getattr(joint, name) >= 0, "at least 0"
    for name in ("swing", "stribeck_speed"):
        yield f"/{name}", getattr(joint, name), getattr(joint, name) > 0, "above 0"
    if joint.limits is not None:
        lower, upper = joint.limits
        yield "/limits", joint.limits, lower < upper, "the smaller limit, then the larger one"
        yield "/start", joint.start, lower <= joint.start <= upper or lower >= upper, "within the limits"
    if joint.motor is not None:
        yield "/motor/max_torque_nm", joint.motor.max_torque_nm, joint.motor.max_torque_nm > 0, "above 0"
        yield from _motor_checks(joint.motor)


def _motor_checks(motor: Motor | PDMotor) -> Iterator[_Check]:
    if isinstance(motor, Motor):
        yield "/motor/position_gain", motor.position_gain, 0 < motor.position_gain <= 1, "above 0 and at most 1"
        yield "/motor/max_speed_rad_s", motor.max_speed_rad_s, motor.max_speed_rad_s > 0, "above 0"
        return
    for name in ("kp", "kd"):
        yield f"/motor/{name}", getattr(motor, name), getattr(motor, name) >= 0, "at least 0"
    yield "/motor/delay_s", motor.delay_s, 0 <= motor.delay_s <= LATEST_S, f"0 to {LATEST_S:g}"


def _world_checks(world: World) -> Iterator[_Check]:
    permitted = f"{SHORTEST_STEP_S:g} to 0.1"
    yield "/time_step_s", world.time_step_s, SHORTEST_STEP_S <= world.time_step_s <= 0.1, permitted
    yield "/gravity_m_s2", world.gravity_m_s2, world.gravity_m_s2 >= 0, "at least 0"
    yield "/solver_iterations", world.solver_iterations, 1 <= world.solver_iterations <= 1000, "1 to 1000"
    yield "/start_turn", world.start_turn, _is_unit(world.start_turn), "a quaternion of length 1"
    yield "/slope_rad", world.slope_rad, abs(world.slope_rad) < math.pi / 2, "between -π/2 and π/2"
    yield "/ground_m", world.ground_m, abs(world.ground_m) <= HIGHEST_M, f"-{HIGHEST_M:g} to {HIGHEST_M:g}"
    tilts = world.gravity_tilt_rad
    yield "/gravity_tilt_rad", tilts, math.hypot(*tilts) < math.pi / 2, "a rotation by less than π/2"
    late = f"-{LATEST_S:g} to {LATEST_S:g}"
    yield "/time_offset_s", world.time_offset_s, abs(world.time_offset_s) <= LATEST_S, late
    yield from _material_checks(world.material, "/material")
    for name, value in vars(world.noise).items():
        yield f"/noise/{name}", value, 0 <= value <= LATEST_S, f"0 to {LATEST_S:g}"
    tilted = world.noise.start_tilt_rad
    yield "/noise/start_tilt_rad", tilted, not (world.fixed and tilted), "0 where the base never moves"
    names = ["", *(body.name for body in world.bodies)]
    yield "/observed", world.observed, world.observed in names, "empty, or the name of a body"
    thrown = not (world.joints or world.fixed)
    yield "/joints", "no motor", thrown or bool(world.actuators), "joints of which at least one has a motor"


def _material_checks(material: Material, place: str) -> Iterator[_Check]:
    for name in ("static_friction", "dynamic_friction"):
        yield f"{place}/{name}", getattr(material, name), getattr(material, name) >= 0, "at least 0"
    yield f"{place}/restitution", material.restitution, 0 <= material.restitution <= 1, "0 to 1"


def _name_check(end: str, name: str) -> _Check:
    return end, name, 0 < len(name) <= LONGEST_NAME and name.isprintable(), f"1 to {LONGEST_NAME} printable characters"


def _is_unit(vector: Iterable[float]) -> bool:
    return abs(math.hypot(*vector) - 1) <= UNIT


def _name_violations(world: World) -> Iterator[Violation]:
    kinds = {
        "bodies": [body.name for body in world.bodies],
        "joints": [joint.name for joint in world.joints],
        "surfaces": [name for name, _ in world.surfaces],
    }
    for kind, names in kinds.items():
        for name, times in Counter(names).items():
            if times > 1:
                yield _violation(f"/{kind}", name, f"{kind} with unique names")


def _tree_violations(world: World) -> Iterator[Violation]:
    """Return what keeps the joints from joining all bodies into one tree with the first body as its root."""
    names = {body.name for body in world.bodies}
    base = world.bodies[0].name
    carried = Counter(joint.child for joint in world.joints)
    rules: tuple[tuple[str, Callable[[Joint], bool], str], ...] = (
        ("parent", lambda joint: joint.parent in names, "the name of a body"),
        ("child", lambda joint: joint.child in names - {base}, f"the name of a body other than the base {base!r}"),
        ("child", lambda joint: carried[joint.child] == 1, "carried by one joint alone"),
    )
    for at, joint in enumerate(world.joints):
        for field, good, permitted in rules:
            if not good(joint):
                yield _violation(f"/joints/{at}/{field}", getattr(joint, field), permitted)
    reached = {base}
    for _ in world.joints:
        reached |= {joint.child for joint in world.joints if joint.parent in reached}
    for at, body in enumerate(world.bodies):
        if body.name not in reached:
            yield _violation(f"/bodies/{at}", body.name, f"joined to the base {base!r} by joints")
