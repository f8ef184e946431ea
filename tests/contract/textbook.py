"""What the textbook tests of engines share: a rig with one joint, and motions of one target."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.world.motions import Loop, Motion
from gaplab.services.world.world import Body, Box, Joint, Sphere, World

G = 9.81
STEP_S = 1 / 240
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
FRAME = Body("frame", 5.0, Box((0.2, 0.2, 0.2)), collides=False)
LOAD = Body("load", 2.0, Box((0.1, 0.2, 0.3)), collides=False)
BALL = World(bodies=(Body("ball", 1.0, Sphere(0.05)),))
EMBODIED = [name for name, engine in engines.items() if engine.available() and engine.runs(BALL)]


@pytest.fixture(params=EMBODIED)
def engine(request: pytest.FixtureRequest) -> Engine:
    return engines[request.param]()


def rig(load: Body = LOAD, gravity_m_s2: float = 0.0, **joint: Any) -> World:
    """A load on one joint of a frame that never moves, high above the ground, observed in place of the frame."""
    values: dict[str, Any] = {"axis": Y, "origin_m": (0.0, 0.0, 0.0), **joint}
    return World(
        bodies=(FRAME, load),
        joints=(Joint("joint", FRAME.name, load.name, **values),),
        start_height_m=5.0,
        gravity_m_s2=gravity_m_s2,
        time_step_s=STEP_S,
        fixed=True,
        observed=load.name,
    )


def block(body: Body, **changes: Any) -> World:
    """One body on the ground."""
    return replace(World(bodies=(body,), time_step_s=STEP_S), **changes)


def held(times_s: Any, *targets: float) -> Motion:
    """Constant targets."""
    return Motion(np.zeros(1), np.array([targets]).reshape(1, -1), times_s)


def changing(times_s: Any, targets: dict[float, float]) -> Motion:
    """Targets of one actuator, by the time from which on they hold."""
    return Motion(np.array(list(targets)), np.array(list(targets.values()))[:, None], times_s)


def angles(engine: Engine, world: World, motion: Motion | Loop) -> FloatArray:
    """Angles of the first joint when the trajectory is observed, after a check that the engine honours the world."""
    honoured(engine, world)
    recorded = engine.record(world, motion, motion.observe_s).angles_rad
    if recorded is None:
        pytest.skip(f"{engine.name} does not tell angles")
    return recorded[:, 0]


def positions(engine: Engine, world: World, motion: Motion | Loop) -> FloatArray:
    """Positions `(t, 3)` of the observed body, after a check that the engine honours the world."""
    honoured(engine, world)
    return engine.rollout(world, motion).positions_m


def honoured(engine: Engine, world: World) -> None:
    """Skip the test if the engine does not honour what the world uses."""
    if lacked := engine.lacks(world):
        pytest.skip(f"{engine.name} does not honour {', '.join(lacked)}")


def times(until_s: float, count: int = 20) -> FloatArray:
    """Times at whole time steps, without 0."""
    return np.rint(np.linspace(0, until_s, count + 1)[1:] / STEP_S) * STEP_S
