"""Robots from files: their world, usual controller and usual task are data, without code."""

from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core import robot_library
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.core.robot_files import RobotFile
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.core.tunables.defaults import usual_tunables


class ImportedOptions(Frozen):
    """Options of `robot_file`."""

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

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
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
        self.perform_as_usual()

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
