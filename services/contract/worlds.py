"""The contracts of an engine, with each robot that it runs, and of a tunable, in a robot that has what it edits."""

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import asdict, replace
from math import isclose
from typing import Any

import numpy as np

from gaplab.services.contract.robots import arm
from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.base import Engine
from gaplab.services.world.motions import Start
from gaplab.services.world.robots import robots
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.tunables.base import Tunable
from gaplab.services.world.world import Material, World


def pairs(plugin: type[Engine]) -> Iterator[tuple[Engine, Robot]]:
    """Yield a new engine with each robot that it runs."""
    for robot in (each.example() for each in robots.values()):
        if plugin.runs(robot.world):
            yield plugin(), robot


def flat(engine: Engine, robot: Robot, world: World | None = None) -> FloatArray:
    """Return all numbers of the trajectory of a robot's known genome as one vector."""
    trajectory = engine.rollout(world or robot.world, robot.motion(robot.known))
    return np.concatenate([np.ravel(trajectory.positions_m), np.ravel(trajectory.orientations)])


def runs_a_robot(plugin: type[Engine]) -> None:
    """Is installed, and runs at least one robot."""
    assert plugin.available(), f"its library is not installed: {plugin.install}"
    assert any(True for _ in pairs(plugin)), f"it runs none of {', '.join(robots)}"


def repeats_itself(plugin: type[Engine]) -> None:
    """Gives the same bits for the same rollout, whatever it ran before."""
    for engine, robot in pairs(plugin):
        first = flat(engine, robot)
        flat(engine, robot, replace(robot.world, material=Material(0.3, 0.1, 0.5)))
        same = np.array_equal(first, flat(engine, robot), equal_nan=True)
        assert same, f"a repeated rollout of the {robot.label} differs"
        fresh = np.array_equal(first, flat(type(engine)(), robot), equal_nan=True)
        assert fresh, f"a rollout of the {robot.label} differs in a new engine"


def observes_a_pose_at_each_time(plugin: type[Engine]) -> None:
    """Returns a position and an orientation for each observed time."""
    for engine, robot in pairs(plugin):
        motion = robot.motion(robot.known)
        trajectory, count = engine.rollout(robot.world, motion), len(motion.observe_s)
        shapes = np.shape(trajectory.positions_m), np.shape(trajectory.orientations)
        assert shapes == ((count, 3), (count, 4)), f"for {count} times of the {robot.label} its shapes are {shapes}"
        assert np.array_equal(trajectory.times_s, motion.observe_s), "its times are not those of `observe_s`"
        finite = np.isfinite(trajectory.positions_m).all()
        assert finite, f"the known genome of the {robot.label} has positions that are not finite"


def runs_many_as_each(plugin: type[Engine]) -> None:
    """Gives the same bits for many rollouts at once and for each alone."""
    for engine, robot in pairs(plugin):
        worlds = [robot.world, replace(robot.world, material=Material(0.5, 0.3, 0.1))]
        motions = [robot.motion(genome) for genome in robot.space.draw(2, np.random.default_rng(0))]
        many = engine.rollouts(worlds, motions)
        for row, motion in enumerate(motions):
            for column, world in enumerate(worlds):
                alone = engine.rollout(world, motion).positions_m
                same = np.array_equal(many.positions_m[row, column], alone, equal_nan=True)
                assert same, f"of many rollouts of the {robot.label}, one differs from the same alone"


def tells_joints_where_it_says_so(plugin: type[Engine]) -> None:
    """Tells angles, speeds and torques of joints if `tells_joints` is true, and the same poses as without."""
    for engine, robot in pairs(plugin) if plugin.tells_joints else ():
        blind = robot.motion(robot.known)
        told = engine.rollout(robot.world, blind.observed_at(blind.observe_s, joints=True))
        joints = (told.angles_rad, told.speeds_rad_s, told.torques_nm)
        shapes = [None if each is None else each.shape for each in joints]
        expected = (len(blind.observe_s), len(robot.world.joints))
        assert shapes == [expected] * 3, f"joints of the {robot.label} have the shapes {shapes}, not {expected}"
        same = np.array_equal(told.positions_m, engine.rollout(robot.world, blind).positions_m, equal_nan=True)
        assert same, f"the {robot.label} moves otherwise if its joints are told"


def begins_where_a_motion_says(plugin: type[Engine]) -> None:
    """Begins with the pose, the velocity and the angles of a motion's start if `sets_starts` is true."""
    for engine, robot in pairs(plugin) if plugin.sets_starts else ():
        before, world = flat(engine, robot), robot.world
        angles = tuple(joint.start + 0.1 for joint in world.joints)
        bent = Start(angles_rad=angles)
        start = bent if world.fixed else replace(bent, position_m=(0.5, 0.0, 2.0), velocity_m_s=(3.0, 0.0, 0.0))
        seen_s = np.array([0.0, 10 * world.time_step_s])
        recorded = engine.record(world, replace(robot.motion(robot.known), start=start), seen_s)
        expected = recorded.poses[:, 0] if world.fixed else [0.5, 0.5 + 3.0 * seen_s[1]]
        assert np.allclose(recorded.poses[:, 0], expected, atol=0.01), f"x of the thrown {robot.label} is wrong"
        told = recorded.angles_rad is None or np.allclose(recorded.angles_rad[0], angles, atol=1e-5)
        assert told, f"the joints of the {robot.label} begin elsewhere"
        assert np.array_equal(before, flat(engine, robot), equal_nan=True), "a start stays for the next rollout"


def honours_what_it_says(plugin: type[Engine]) -> None:
    """Changes its trajectories with the coefficients that it honours, and with no others."""
    for name, value in (("static_friction", 1.37), ("dynamic_friction", 0.41), ("restitution", 0.53)):
        changed = [robot.label for engine, robot in pairs(plugin) if _changes(engine, robot, **{name: value})]
        if f"material.{name}" in plugin.honours:
            assert changed, f"`honours` has material.{name}, which changes no trajectory"
        else:
            assert not changed, f"`honours` lacks material.{name}, which changes a rollout of the {changed[0]}"


def _changes(engine: Engine, robot: Robot, **coefficients: float) -> bool:
    world = replace(robot.world, material=replace(robot.world.material, **coefficients))
    return not np.array_equal(flat(engine, robot), flat(engine, robot, world), equal_nan=True)


DETAILS = {"field", "unit", "lower", "upper", "least", "greatest"}
OF_NO_FIELD = ("origin", "edits")
"""Places of a world in which `World.edited` remembers what was edited."""


def subject(plugin: type[Tunable]) -> tuple[Tunable, World]:
    """Return a new tunable, and the first robot that has what it edits."""
    tunable = plugin()
    world = next((world for world in _worlds() if tunable.lack(world) is None), None)
    if world is None:
        lack, _ = tunable.lack(Quadruped().world) or ("", ())
        raise AssertionError(f"neither an arm nor {', '.join(robots)} has what it edits: {lack}")
    return tunable, world


def _worlds() -> Iterator[World]:
    """Yield the quadruped, an arm, and then an example of every robot."""
    yield Quadruped().world
    yield arm()
    for robot in robots.values():
        yield robot.example().world


def reads_back_what_it_wrote(plugin: type[Tunable]) -> None:
    """Reads back the value that it wrote; if it is relative, the value that changes nothing."""
    tunable, world = subject(plugin)
    value = tunable.lower + 0.6 * (tunable.upper - tunable.lower)
    expected = tunable.read(world) if tunable.relative else value
    read = tunable.read(tunable.edit(world, value))
    assert isclose(read, expected, rel_tol=1e-12), f"it wrote {value} and reads {read}, not {expected}"


def changes_nothing_by_the_value_that_it_reads(plugin: type[Tunable]) -> None:
    """Changes nothing if it writes the value that it reads."""
    tunable, world = subject(plugin)
    assert tunable.edit(world, tunable.read(world)) == world, (
        f"it reads {tunable.read(world)}, and writing that changes it"
    )


def edits_its_field_alone(plugin: type[Tunable]) -> None:
    """Edits the field of the world that it declares, and no other but those of `also`."""
    tunable, world = subject(plugin)
    before = flattened(asdict(world))
    after = flattened(asdict(tunable.edit(world, _another(tunable, tunable.read(world)))))
    places = [place for place in before | after if place.split(".")[0] not in OF_NO_FIELD]
    changed = sorted({_field(place) for place in places if before.get(place) != after.get(place)})
    permitted = {tunable.field.rpartition(".")[2], *tunable.also}
    same = bool(changed) and all(permitted & set(field.split(".")) for field in changed)
    assert same, f"it declares the field {tunable.field!r}, and changes {', '.join(changed) or 'nothing'}"


def leaves_the_given_world(plugin: type[Tunable]) -> None:
    """Leaves the world that it was given unchanged."""
    tunable, world = subject(plugin)
    same = deepcopy(world)
    tunable.edit(world, _another(tunable, tunable.read(world)))
    assert world == same, "it changes the given world; return a copy by dataclasses.replace"


def is_built_as_it_says(plugin: type[Tunable]) -> None:
    """Edits a world that engines would build as it is, if they set nothing in place."""
    tunable, world = subject(plugin)
    edited = tunable.edit(world, _another(tunable, tunable.read(world)))
    assert edited.built(frozenset()) == edited.kind, "an engine would build another world; use World.edited, or replace"


def has_bounds_that_mean_something(plugin: type[Tunable]) -> None:
    """Has bounds that ascend, within the limits of meaningful values."""
    tunable = plugin()
    bounds = (tunable.least, tunable.lower, tunable.upper, tunable.greatest)
    ascend = bounds[0] <= bounds[1] < bounds[2] <= bounds[3]
    assert ascend, f"least, lower, upper and greatest must ascend, and are {bounds}"


def has_the_details_of_every_tunable(plugin: type[Tunable]) -> None:
    """Has the details of every tunable in the catalogue."""
    details = plugin.describe().details
    assert set(details) == DETAILS, f"its details are {sorted(details)}"


def flattened(value: Any, prefix: str = "") -> dict[str, Any]:  # noqa: ANN401 - nested
    """Return every leaf of a nested value by its dotted place."""
    if isinstance(value, dict):
        items = list(value.items())
    elif isinstance(value, tuple | list):
        items = list(enumerate(value))
    else:
        return {prefix.removeprefix("."): value}
    return {place: leaf for name, each in items for place, leaf in flattened(each, f"{prefix}.{name}").items()}


def _field(place: str) -> str:
    return ".".join(part for part in place.split(".") if not part.isdigit())


def _another(tunable: Tunable, value: float) -> float:
    return tunable.lower if value != tunable.lower else tunable.upper
