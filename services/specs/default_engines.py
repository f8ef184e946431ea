"""The engine of a spec that names none."""

from gaplab.services.core.robots.base import Robot
from gaplab.services.core.world import World
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine


def default_engine(robot: Robot | type[Robot]) -> str:
    """Return the engine that the robot names, or another of gaplab's own if that one cannot run its world here.

    PyBullet has no wheels for Python 3.12 and later. There, the quadruped's engine is MuJoCo. The resolved spec records
    the choice, so a stored experiment does not depend on it.
    """
    world = (robot.example() if isinstance(robot, type) else robot).world
    named = engines.get(robot.engine)
    if named is None or (named.available() and runs(named, world) and not named.lacks(world)):
        return robot.engine
    others = (name for name, engine in engines.own.items() if engine.available())
    able = (name for name in others if runs(engines[name], world) and not engines[name].lacks(world))
    return next(able, robot.engine)


def runs(engine: type[Engine], world: World) -> bool:
    """Return whether the engine can run a robot's world; one that raises cannot."""
    try:
        return engine.runs(world)
    except Exception:  # noqa: BLE001 - an external engine concerns only the specs that name it
        return False
