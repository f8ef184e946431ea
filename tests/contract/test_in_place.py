"""Worlds that share what an engine built: each gives the numbers that it gives alone, in whatever order they come."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.base import Engine
from gaplab.services.world.kinematics import about
from gaplab.services.world.motions import Motion
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
    Vector,
    World,
)
from tests.contract.textbook import X, Y, Z, engine

__all__ = ["engine"]

QUARTER = tuple(about(np.array(X), np.array([0.4]))[0].tolist())
CORNERS: list[Vector] = [(x, y, -0.03) for x in (-0.15, 0.15) for y in (-0.1, 0.1)]
TOP: list[Vector] = [(x, 0.0, 0.05) for x in (-0.1, 0.1)]


def _walker() -> World:
    """Two legs and a tail, with something of everything that engines may set in place."""
    trunk = Body("trunk", 3.0, Hull((*CORNERS, *TOP)))
    thighs = [Body(f"thigh{side}", 0.4, Capsule(0.03, 0.15), (0.0, 0.0, -0.1), collides=False) for side in "lr"]
    shin = (Part(Cylinder(0.02, 0.2), (0.0, 0.0, -0.1)), Part(Sphere(0.04), (0.0, 0.0, -0.2)))
    inertia = Inertia((0.002, 0.002, 0.0003), QUARTER)
    shins = [Body(f"shin{side}", 0.3, shin, (0.0, 0.0, -0.12), inertia=inertia, surface="sole") for side in "lr"]
    tail = Body("tail", 0.5, Box((0.1, 0.1, 0.1)))
    hip = PDMotor("position", 30.0, kp=60.0, kd=2.0, delay_s=0.01)
    hips = [Joint(f"hip{s}", "trunk", f"thigh{s}", (0.0, y, 0.0), Y, hip) for s, y in (("l", 0.12), ("r", -0.12))]
    servo = Motor(0.1, 10.0)
    knees = [Joint(f"knee{s}", f"thigh{s}", f"shin{s}", (0.0, 0.0, -0.2), Y, servo, start=0.1) for s in "lr"]
    swing = Joint(
        "swing", "trunk", "tail", (-0.3, 0.0, -0.2), Z, damping=0.1, dry_friction=0.05, slides=True, limits=(-0.1, 0.2)
    )
    return World(
        bodies=(trunk, *thighs, *shins, tail),
        joints=(*hips, *knees, swing),
        start_height_m=0.46,
        surfaces=(("sole", Material(0.9, 0.6)),),
        time_step_s=1 / 240,
    )


WALKER = _walker()
MOTION = Motion(np.linspace(0.0, 1.0, 5), 0.5 * np.cos(np.arange(20)).reshape(5, 4), np.array([0.5, 1.0, 1.25]))


def each_body(world: World, change: Callable[[Body], Body]) -> tuple[Body, ...]:
    return tuple(change(body) for body in world.bodies)


def each_joint(world: World, **changes: Any) -> tuple[Joint, ...]:
    return tuple(replace(joint, **changes) for joint in world.joints)


def each_motor(world: World, **changes: Any) -> tuple[Joint, ...]:
    return tuple(
        replace(joint, motor=replace(joint.motor, **changes))
        if joint.motor is not None and all(hasattr(joint.motor, name) for name in changes)
        else joint
        for joint in world.joints
    )


def heavier(body: Body, factor: float) -> Body:
    inertia = body.inertia
    if inertia is not None:
        x, y, z = inertia.moments_kg_m2
        inertia = replace(inertia, moments_kg_m2=(factor * x, factor * y, factor * z))
    return replace(body, mass_kg=factor * body.mass_kg, inertia=inertia)


IN_PLACE: dict[str, Callable[[World, float], dict[str, Any]]] = {
    "body.center_m": lambda world, f: {
        "bodies": each_body(world, lambda body: replace(body, center_m=(0.01 * f, 0.0, body.center_m[2])))
    },
    "body.inertia": lambda world, f: {
        "bodies": each_body(world, lambda body: replace(body, inertia=body.inertia and heavier(body, f).inertia))
    },
    "body.mass_kg": lambda world, f: {"bodies": each_body(world, lambda body: heavier(body, f))},
    "gravity_m_s2": lambda world, f: {"gravity_m_s2": f * world.gravity_m_s2},
    "gravity_tilt_rad": lambda _, f: {"gravity_tilt_rad": (0.1 * f, -0.05 * f)},
    "ground_m": lambda _, f: {"ground_m": -0.05 * f},  # robots that begin in the ground explode
    "joint.armature": lambda world, f: {"joints": each_joint(world, armature=0.01 * f)},
    "joint.damping": lambda world, f: {"joints": each_joint(world, damping=0.1 * f)},
    "joint.dry_friction": lambda world, f: {"joints": each_joint(world, dry_friction=0.1 * f)},
    "joint.static_friction": lambda world, f: {"joints": each_joint(world, static_friction=0.5 * f)},
    "motor.delay_s": lambda world, f: {"joints": each_motor(world, delay_s=0.02 * f)},
    "motor.kd": lambda world, f: {"joints": each_motor(world, kd=1.5 * f)},
    "motor.kp": lambda world, f: {"joints": each_motor(world, kp=50.0 * f)},
    "motor.max_speed_rad_s": lambda world, f: {"joints": each_motor(world, max_speed_rad_s=f)},
    "motor.max_torque_nm": lambda world, f: {"joints": each_motor(world, max_torque_nm=2.0 * f)},
    "motor.position_gain": lambda world, f: {"joints": each_motor(world, position_gain=0.05 * f)},
    "slope_rad": lambda world, f: {"slope_rad": 0.1 * f},
    "surfaces": lambda _, f: {"surfaces": (("sole", Material(0.5 * f, 0.3 * f, 0.1)),)},
}
"""Changes of a world's fields by a factor, by the name of the edited field."""


def path(engine: Engine, world: World) -> FloatArray:
    seen = engine.rollout(world, MOTION)
    return np.hstack([seen.positions_m, seen.orientations])


def from_scratch(world: World) -> World:
    return replace(world, origin=None, edits=frozenset())


def runs_walker(engine: Engine) -> World:
    """The walker, without what the engine lacks and the test can do without."""
    world = WALKER
    if engine.lacks(world):
        pytest.skip(f"{engine.name} does not honour {', '.join(engine.lacks(world))}")
    return world


@pytest.mark.parametrize("name", IN_PLACE)
def test_a_world_set_in_place_is_the_world_built_from_scratch(engine: Engine, name: str) -> None:
    world = runs_walker(engine)
    if name not in engine.in_place:
        pytest.skip(f"{engine.name} does not set {name} in place")
    edited = [world.edited(name, **IN_PLACE[name](world, factor)) for factor in (0.7, 1.3)]
    before = path(engine, world)

    paths = [path(engine, each) for each in edited]

    assert all(each.built(engine.in_place) == world.built(engine.in_place) for each in edited)
    for each, found in zip(edited, paths, strict=True):
        assert np.isfinite(found).all()
        assert np.array_equal(found, path(type(engine)(), from_scratch(each)))
    assert not np.array_equal(paths[0], paths[1])
    assert np.array_equal(path(engine, world), before)


def test_many_edits_at_once_come_and_go(engine: Engine) -> None:
    world = runs_walker(engine)
    known = [name for name in IN_PLACE if name in engine.honours]
    worlds = [world]
    for number, factor in enumerate((0.8, 0.9, 1.1, 1.2)):
        edited = world
        for name in known[number::2]:
            edited = edited.edited(name, **IN_PLACE[name](edited, factor))
        worlds.append(edited)

    forwards = [path(engine, each) for each in worlds]
    backwards = [path(engine, each) for each in reversed(worlds)][::-1]

    assert np.array_equal(forwards, backwards)
    assert len({each.tobytes() for each in forwards}) == len(worlds)
    for each, found in zip(worlds, forwards, strict=True):
        assert np.array_equal(found, path(type(engine)(), from_scratch(each)))


def test_what_cannot_be_set_in_place_is_built(engine: Engine) -> None:
    world = runs_walker(engine)
    for name in sorted(set(IN_PLACE) & engine.honours - engine.in_place):
        edited = world.edited(name, **IN_PLACE[name](world, 1.2))

        assert edited.built(engine.in_place) == from_scratch(edited)
        assert np.array_equal(path(engine, edited), path(type(engine)(), from_scratch(edited)))
        assert not np.array_equal(path(engine, edited), path(engine, world))
