"""The contract of a controller, with a walking robot and an arm of other motors."""

from collections.abc import Iterator

import numpy as np

from gaplab.services.contract.promises import check_known, check_targets, numbers
from gaplab.services.core.arrays import frozen
from gaplab.services.world.controllers.base import Controller
from gaplab.services.world.motions import Loop
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.sensing import GROUPS
from gaplab.services.world.world import Body, Box, Joint, PDMotor, World

Plugin = type[Controller]

OBSERVE_S = frozen([0.4, 1.0])
TOGETHER = (1, 2, 7, 64)
"""Numbers of loops that act together."""


def arm() -> World:
    """Return an arm on a fixed base, whose three motors follow a position, a speed and a torque."""
    motors = (
        PDMotor("position", max_torque_nm=10.0, kp=50.0, kd=2.0),
        PDMotor("velocity", max_torque_nm=10.0, kd=2.0),
        PDMotor("torque", max_torque_nm=10.0),
    )
    bodies = [Body("base", 1.0, Box((0.1, 0.1, 0.1)))]
    joints = []
    for number, motor in enumerate(motors):
        bodies.append(Body(f"link_{number}", 0.5, Box((0.05, 0.05, 0.2)), (0.0, 0.0, 0.1), collides=False))
        parent, child = bodies[-2].name, bodies[-1].name
        joints.append(
            Joint(f"joint_{number}", parent, child, (0.0, 0.0, 0.2), (0.0, 1.0, 0.0), motor, start=0.3, swing=0.4)
        )
    return World(bodies=tuple(bodies), joints=tuple(joints), start_height_m=0.5, fixed=True)


def prepared(plugin: Plugin) -> Iterator[tuple[Controller, World]]:
    """Yield a new controller for each robot, with the robot."""
    for world in (Quadruped().world, arm()):
        controller = plugin()
        controller.prepare(world, OBSERVE_S)
        yield controller, world


def has_its_known_genome_in_its_space(plugin: Plugin) -> None:
    """Has a known genome within the bounds of its space."""
    for controller, _ in prepared(plugin):
        check_known(controller.known, controller.space)


def drives_every_actuator(plugin: Plugin) -> None:
    """Describes motions with finite targets for every actuator, or loops, all observed at the given times."""
    for controller, world in prepared(plugin):
        for genome in frozen([controller.known, *controller.space.draw(5, np.random.default_rng(0))]):
            motion = controller.motion(genome)
            assert np.array_equal(motion.observe_s, OBSERVE_S), f"observe_s is {motion.observe_s.tolist()}"
            if not isinstance(motion, Loop):
                check_targets(motion, len(world.actuators))


def declares_whether_it_loops(plugin: Plugin) -> None:
    """Declares in `loops` whether its motions are Loops, whose groups of observations exist, in their order."""
    for controller, _ in prepared(plugin):
        motion = controller.motion(controller.known)
        assert isinstance(motion, Loop) == plugin.loops, (
            f"loops is {plugin.loops}, and it returns {type(motion).__name__}"
        )
        if isinstance(motion, Loop):
            ordered = tuple(name for name in GROUPS if name in motion.senses)
            assert motion.senses == ordered, f"senses are {motion.senses}; permitted: names of {GROUPS}, in this order"


def repeats_itself(plugin: Plugin) -> None:
    """Describes the same motion by the same genome, in every process."""
    for (first, world), (second, _) in zip(prepared(plugin), prepared(plugin), strict=True):
        genome = frozen(first.space.draw(1, np.random.default_rng(1))[0])
        answers = [numbers(controller, world, genome[None]) for controller in (first, second, first)]
        assert all(np.array_equal(answers[0], each) for each in answers), "the same genome gives different numbers"


def acts_on_each_row_alone(plugin: Plugin) -> None:
    """Acts on each loop as if it were alone, to the last bit, whatever loops act at the same time."""
    if not plugin.loops:
        return
    for controller, world in prepared(plugin):
        genomes = frozen(controller.space.draw(max(TOGETHER), np.random.default_rng(2)))
        whole = numbers(controller, world, genomes)
        assert np.isfinite(whole).all(), "targets or memories are not finite"
        for count in TOGETHER:
            same = np.array_equal(numbers(controller, world, genomes[:count]), whole[:, :count])
            assert same, f"of {max(TOGETHER)} loops the first {count} differ from {count} alone"
        backwards = numbers(controller, world, genomes[::-1])
        assert np.array_equal(backwards[:, ::-1], whole), "loops differ with their order"
