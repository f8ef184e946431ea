"""Controllers in a loop, in every engine that closes loops: what they observe, and when their commands arrive."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.engines.base import Engine
from gaplab.services.world.kinematics import about, rotated
from gaplab.services.world.motions import NO_MEMORY, Act, Loop, Motion
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.sensing import GROUPS, names
from gaplab.services.world.world import Body, Box, Joint, PDMotor, Sphere, World
from tests.contract.textbook import STEP_S, G, X, Y, Z, block, engine, honoured, rig, times

__all__ = ["engine"]

ROBOT = Quadruped()
PERIOD_S = 0.05
SEEN_S = np.array([0.5, 1.0])
AT_S: FloatArray = np.asarray(np.arange(21) * PERIOD_S)


@pytest.fixture
def closing(engine: Engine) -> Engine:
    if not engine.closes_loops:
        pytest.skip(f"{engine.name} closes no loops")
    return engine


def loop(act: Act, observe_s: Any = SEEN_S, **values: Any) -> Loop:
    return Loop(
        **{
            "act": act,
            "senses": GROUPS,
            "genome": frozen([]),
            "memory": NO_MEMORY,
            "period_s": PERIOD_S,
            "observe_s": observe_s,
            **values,
        }
    )


class Watching:
    """Holds targets, and keeps what it observes."""

    def __init__(self, *targets: float) -> None:
        self.targets = np.array(targets)
        self.seen: list[Any] = []
        self.at_s: list[float] = []

    def __call__(self, genomes: Any, observations: Any, memories: Any, time_s: Any) -> Any:
        self.seen.append(observations[0].copy())
        self.at_s.append(time_s)
        return np.tile(self.targets, (len(genomes), 1)), memories


class Both:
    """Holds a joint, and keeps the angles that it observes in all worlds."""

    def __init__(self) -> None:
        self.angles: set[float] = set()

    def __call__(self, genomes: Any, observations: Any, memories: Any, time_s: Any) -> Any:
        self.angles |= {round(float(angle), 6) for angle in observations[:, 0]}
        return np.full((len(genomes), 1), 0.1), memories


def group(world: World, sense: str, seen: list[FloatArray]) -> FloatArray:
    """One group of observations `(ticks, …)`."""
    place = GROUPS.index(sense)
    first = len(names(world, GROUPS[:place]))
    return np.array(seen)[:, first : first + len(names(world, (sense,)))]


def feedback(genomes: Any, observations: Any, memories: Any, time_s: Any) -> Any:
    """Each joint follows a wave, by its own gene, and leans against the tilt; a memory counts the calls."""
    actuators = genomes.shape[1]
    wave = 0.3 * np.sin(6.0 * time_s + 6.0 * genomes + 0.1 * memories)
    return wave - 0.1 * observations[:, :actuators] + 0.2 * observations[
        :, 2 * actuators : 2 * actuators + 1
    ], memories + 1


def test_a_loop_that_observes_nothing_is_a_motion(closing: Engine) -> None:
    rows = 0.4 * np.sin(np.arange(21)[:, None] + np.arange(12))
    blind = loop(
        lambda genomes, _, memories, time_s: (rows[[round(time_s / PERIOD_S)] * len(genomes)], memories), senses=()
    )
    ahead = Motion(AT_S, rows, SEEN_S)

    one, other = closing.rollout(ROBOT.world, blind), closing.rollout(ROBOT.world, ahead)

    assert np.array_equal(one.positions_m, other.positions_m)
    assert np.array_equal(one.orientations, other.orientations)


def test_a_controller_is_called_once_in_each_period_from_time_0(closing: Engine) -> None:
    watching = Watching(*[0.0] * 12)

    closing.rollout(ROBOT.world, loop(watching))

    assert watching.at_s == pytest.approx(AT_S)


def test_a_falling_body_observes_tilt_and_turning(closing: Engine) -> None:
    """A spinning top: a torque motor on a heavy flywheel turns a light base the other way."""
    turn = about(np.array([0.6, 0.0, 0.8]), np.array([0.7]))[0]
    bodies = (Body("base", 1.0, Sphere(0.1), collides=False), Body("wheel", 1.0, Sphere(0.1), collides=False))
    spin = Joint("spin", "base", "wheel", (0.0, 0.0, 0.0), Y, PDMotor("torque", 1.0))
    world = replace(
        block(bodies[0]), bodies=bodies, joints=(spin,), start_height_m=9.0, start_turn=tuple(turn.tolist())
    )
    honoured(closing, world)
    watching = Watching(0.004)

    seen = closing.rollout(world, loop(watching, np.arange(1, 21) * PERIOD_S))

    tilt, turning, speeds = (group(world, each, watching.seen) for each in ("tilt", "turning", "speeds"))
    moment, at_s = 0.4 * 0.1**2, AT_S
    assert turning == pytest.approx(np.outer(-0.004 / moment * at_s, Y), abs=0.01)
    assert speeds[:, 0] == pytest.approx(2 * 0.004 / moment * at_s, abs=0.01)
    back = seen.orientations * np.array([-1, -1, -1, 1])
    assert tilt[0] == pytest.approx(rotated(turn * np.array([-1, -1, -1, 1]), np.array([0, 0, -1.0])), abs=1e-6)
    assert tilt[1:] == pytest.approx(rotated(back, np.array([0, 0, -1.0])), abs=1e-5)
    assert np.ptp(tilt, axis=0).max() > 0.1
    assert np.linalg.norm(tilt, axis=1) == pytest.approx(1.0, abs=1e-6)


def test_a_loop_observes_the_biases_of_its_sensors_in_each_of_several_worlds(closing: Engine) -> None:
    world = rig(axis=X, start=0.1, motor=PDMotor("position", 10.0, kp=9.0))
    biased = world.edited("biases", biases=(("angle joint", 0.05), ("speed joint", -0.2)))
    honoured(closing, world)
    watching, both = Watching(0.1), Both()

    closing.rollout(biased, loop(watching))
    closing.rollouts([world, biased], [loop(both)])

    assert group(world, "angles", watching.seen) == pytest.approx(0.15)
    assert group(world, "speeds", watching.seen) == pytest.approx(-0.2)
    assert both.angles == {0.1, 0.15}


def test_on_a_slope_gravity_is_tilted(closing: Engine) -> None:
    world = replace(block(Body("box", 1.0, Box((0.2, 0.2, 0.1)))), start_height_m=0.05, slope_rad=0.2)
    honoured(closing, world)
    watching = Watching()

    closing.rollout(world, loop(watching))

    assert group(world, "tilt", watching.seen) == pytest.approx(
        np.tile([-np.sin(0.2), 0.0, -np.cos(0.2)], (21, 1)), abs=2e-3
    )


def test_angles_and_speeds_are_those_of_the_actuated_joints(closing: Engine) -> None:
    world = rig(axis=X, slides=True, start=0.1, motor=PDMotor("torque", 10.0))
    idle = replace(world.joints[0], name="idle", parent="load", child="tail", motor=None, start=0.3)
    tail = Body("tail", 0.001, Sphere(0.01), collides=False)
    world = replace(world, bodies=(*world.bodies, tail), joints=(idle, *world.joints))
    honoured(closing, world)
    watching = Watching(4.0)

    closing.rollout(world, loop(watching))

    at_s = AT_S
    assert names(world, ("angles", "speeds")) == ("angle joint", "speed joint")
    assert group(world, "speeds", watching.seen)[:, 0] == pytest.approx(4.0 / 2.001 * at_s, rel=0.01, abs=1e-6)
    assert group(world, "angles", watching.seen)[:, 0] == pytest.approx(0.1 + 4.0 / 2.001 / 2 * at_s**2, abs=0.02)


def test_contacts_tell_which_feet_are_down(closing: Engine) -> None:
    bodies = (
        Body("trunk", 1.0, Box((0.4, 0.4, 0.1)), collides=False),
        *(
            Body(f"foot{i}", 0.2, Sphere(0.05), (x, y, -0.2))
            for i, (x, y) in enumerate([(0.2, 0.2), (0.2, -0.2), (-0.2, 0.0)])
        ),
        Body("tail", 0.1, Sphere(0.05), (-0.3, 0.0, 0.2)),
    )
    rigid = PDMotor("position", 1e3, kp=1e3, kd=50.0)
    joints = tuple(Joint(f"to {each.name}", "trunk", each.name, (0.0, 0.0, 0.0), Z, rigid) for each in bodies[1:])
    world = replace(block(bodies[0]), bodies=bodies, joints=joints, start_height_m=0.5)
    honoured(closing, world)
    watching = Watching(0.0, 0.0, 0.0, 0.0)

    closing.rollout(world, loop(watching))

    contacts = group(world, "contacts", watching.seen)
    assert names(world, ("contacts",)) == ("contact foot0", "contact foot1", "contact foot2", "contact tail")
    landing_s = np.sqrt(2 * 0.24 / G)
    falling = landing_s > AT_S
    assert np.all(contacts[falling] == 0)
    assert np.all(contacts[-5:] == [1, 1, 1, 0])


def test_observations_are_late_by_the_latency(closing: Engine) -> None:
    fresh, late = Watching(0.3), Watching(0.3)
    world = rig(motor=PDMotor("torque", 10.0), start=0.2)
    honoured(closing, world)

    closing.rollout(world, loop(fresh, period_s=2 * STEP_S))
    closing.rollout(world, loop(late, period_s=2 * STEP_S, latency_s=6 * STEP_S))

    assert np.array_equal(late.seen[3:], fresh.seen[:-3])
    assert np.array_equal(late.seen[:3], [fresh.seen[0]] * 3)
    assert len(np.unique([row[0] for row in fresh.seen])) == len(fresh.seen)


def test_commands_arrive_late_by_the_delay_of_their_motor(closing: Engine) -> None:
    push = PDMotor("torque", 10.0, delay_s=12 * STEP_S)
    seen = 12 * STEP_S + times(0.5)
    prompt, delayed = rig(motor=replace(push, delay_s=0.0)), rig(motor=push)
    honoured(closing, delayed)

    soon = closing.rollout(prompt, loop(Watching(0.3), seen - 12 * STEP_S)).orientations
    late = closing.rollout(delayed, loop(Watching(0.3), seen)).orientations

    assert np.ptp(soon, axis=0).max() > 0.1
    assert late == pytest.approx(soon, abs=1e-6)


def test_noise_is_added_to_observations_and_targets(closing: Engine) -> None:
    watching, clean = Watching(*[0.1] * 12), Watching(*[0.1] * 12)
    width = len(names(ROBOT.world, GROUPS))
    rng = np.random.default_rng(1)
    heard, trembles = rng.normal(size=(21, width)), 0.2 * rng.normal(size=(21, 12))

    closing.rollout(ROBOT.world, loop(clean))
    closing.rollout(ROBOT.world, loop(watching, observation_noise=heard))
    noisy = closing.rollout(ROBOT.world, loop(Watching(*[0.1] * 12), target_noise=trembles))
    ahead = closing.rollout(ROBOT.world, Motion(AT_S, 0.1 + trembles, SEEN_S))

    assert np.array_equal(np.array(watching.seen), np.array(clean.seen) + heard)
    assert np.array_equal(noisy.positions_m, ahead.positions_m)


def many(count: int) -> list[Loop]:
    genomes = np.random.default_rng(3).random((count, 12))
    senses = ("angles", "speeds", "tilt", "turning", "contacts")
    return [loop(feedback, genome=genome, memory=frozen([0.0]), senses=senses) for genome in genomes]


def test_loops_are_bit_equal_on_repeat_and_in_any_batch(closing: Engine) -> None:
    worlds = [ROBOT.world, replace(ROBOT.world, material=replace(ROBOT.world.material, dynamic_friction=0.4))]
    loops = many(5)

    together = closing.rollouts(worlds, loops)

    for row, each in enumerate(loops):
        for column, world in enumerate(worlds):
            assert np.array_equal(closing.rollout(world, each).positions_m, together.positions_m[row, column])
    fresh = type(closing)().rollouts(worlds[::-1], loops[::-1])
    assert np.array_equal(fresh.positions_m[::-1, ::-1], together.positions_m)
    assert len(np.unique(together.positions_m[:, 0, -1, 0])) == 5


def test_recording_a_loop_changes_nothing_of_it(closing: Engine) -> None:
    each = many(1)[0]

    plain = closing.rollout(ROBOT.world, each)
    recorded = closing.record(ROBOT.world, each, np.arange(51) / 50)

    assert np.array_equal(recorded.trajectory.positions_m, plain.positions_m)
    assert recorded.angles_rad is None or np.ptp(recorded.angles_rad) > 0.1


def test_a_controller_that_says_nan_gives_nan_and_harms_nothing_after_it(closing: Engine) -> None:
    before = closing.rollout(ROBOT.world, many(1)[0])

    lost = closing.rollout(ROBOT.world, loop(Watching(*[np.nan] * 12)))

    assert np.isnan(lost.positions_m).all()
    assert np.array_equal(closing.rollout(ROBOT.world, many(1)[0]).positions_m, before.positions_m)
