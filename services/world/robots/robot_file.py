"""Robots from files: their world, usual controller and usual task are data, and their usual tunables follow from it."""

import re
from collections import Counter

from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.world import robot_library
from gaplab.services.world.robot_files import RobotFile
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.tunables.base import LONGEST_PATTERN
from gaplab.services.world.world import Motor, World

_SPECIAL = re.compile(r"[()\[\]*?,=]")
"""Characters that mean something in a label or in a pattern."""


def usual_tunables(world: World) -> tuple[str, ...]:
    """Return the labels of three or four tunables that usually explain a reality gap of a robot.

    A robot that moves about has the friction of what most of its limbs end in, and the mass of its base, which stands
    for the payload. One on a fixed base has the mass of its tool, the observed body, and the dry friction of its
    joints. Both have:

    - the response of their motors: the gain of most of them, the damping of those that follow speeds, the largest
      torque of those that follow torques,
    - the damping of their joints, which no data sheet has.
    """
    if not world.bodies or (world.fixed and not world.joints):
        return ()
    damping = ("joint_damping",) if world.joints else ()
    if not world.fixed:
        return (_friction(world), _mass(world.bodies[0].name), *_response(world), *damping)
    tool = world.observed if world.observed not in {"", world.bodies[0].name} else world.bodies[-1].name
    return (_mass(tool), *_response(world), *damping, "joint_friction")


def _friction(world: World) -> str:
    """Return the label of the friction of most bodies that touch the ground and carry no other: feet, or wheels."""
    parents = {joint.parent for joint in world.joints}
    ends = [each for each in world.bodies if each.name not in parents and each.touches]
    surfaces = Counter(each.surface for each in ends).most_common(1)
    own = surfaces and surfaces[0][0] in dict(world.surfaces)
    return f"dynamic_friction({_pattern(surfaces[0][0])})" if own else "dynamic_friction"


def _response(world: World) -> tuple[str, ...]:
    """Return the label of the tunable that decides how most motors respond, like `kp`; empty without motors."""
    motors = [joint.motor for joint in world.actuators]
    if not motors:
        return ()
    kinds = ["gain" if motor is None or isinstance(motor, Motor) else motor.follows for motor in motors]
    labels = {"gain": "motor_gain", "position": "kp", "velocity": "kd", "torque": "max_torque"}
    return (labels[max(labels, key=kinds.count)],)


def _mass(body: str) -> str:
    return f"mass({_pattern(body)})"


def _pattern(name: str) -> str:
    """Return a name with ? for what a label cannot contain, and * for what is too long."""
    pattern = _SPECIAL.sub("?", name)
    return pattern if len(pattern) <= LONGEST_PATTERN else pattern[: LONGEST_PATTERN - 1] + "*"


class ImportedOptions(Frozen):
    """Options of the robot `robot_file`."""

    sha256: str = Field(default="", max_length=64, description="hash of the robot file")
    name: str = Field(default="", max_length=60, description="name of the robot, for people")


class Imported(Robot):
    """A robot from a file that was imported from URDF or MJCF, or written by hand.

    A spec names it by the name that it was stored under, like `"robot": "a1"`; the stored spec has its hash.
    """

    name = robot_library.IMPORTED
    source = "The file that `gaplab robot import` read; docs/robots.md"
    engine = "pybullet"
    Options = ImportedOptions
    options: ImportedOptions

    def build(self) -> None:
        """Set what the file has.

        Raises:
            InvalidSpec: no file with this hash is known here.
        """
        file = robot_library.robot_file(self.options.sha256)
        if file is None:
            named = f"the robot {self.options.name!r}" if self.options.name else "the robot"
            message = (
                f"{named} with the hash {self.options.sha256!r} is not stored here; add its file: gaplab robot add"
            )
            raise InvalidSpec([Violation("/robot/options/sha256", self.options.sha256, message, "the hash of a robot")])
        self.label, self.world = file.name, file.world
        self.usual_controller, self.usual_task = file.usual_controller, file.usual_task
        self.usual_tunables = usual_tunables(self.world)

    @classmethod
    def example(cls) -> "Imported":
        """Return the quadruped, as a file would have it."""
        robot = Quadruped()
        assert robot.usual_controller is not None
        assert robot.usual_task is not None
        file = RobotFile(
            name=robot.name, usual_controller=robot.usual_controller, usual_task=robot.usual_task, world=robot.world
        )
        robot_library.learn([file.text])
        return cls(ImportedOptions(sha256=file.sha256, name=file.name))
