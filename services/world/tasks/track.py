"""A task of any robot with motors: to do what it is told."""

from typing import Annotated

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.sensing import biases
from gaplab.services.world.tasks.base import ReadingTask, ReadOptions
from gaplab.services.world.world import World

RATED_EVERY_S = 0.02
"""Interval between the errors whose mean square is the fitness: that of most logs of arms."""


class TrackOptions(ReadOptions):
    """Options of the task `track`."""

    settling_s: Annotated[Real, Field(ge=0, le=600)] = Field(default=0.0, description="seconds before fitness counts")
    counted_s: Annotated[Real, Field(gt=0, le=600)] = Field(
        default=2.0, description="seconds in which fitness counts; the cost of a rollout grows with it"
    )


class Track(ReadingTask):
    """Minus the root mean square of angle − command, over the hinges that follow positions, in the counted time.

    An angle is what the encoder reads.

    By default the sensors are the angles of all joints with a motor, at 50 Hz.
    """

    name = "track"
    unit = "rad"
    Options = TrackOptions
    options: TrackOptions
    usual = ("angles",)
    usual_every_s = RATED_EVERY_S
    commanded = True

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        given = self.options
        counted_s = np.arange(np.floor(given.counted_s / RATED_EVERY_S + 1e-9) + 1) * RATED_EVERY_S
        short = given.counted_s - counted_s[-1] > 1e-9
        self.observe_s = frozen(given.settling_s + np.append(counted_s, [given.counted_s] if short else []))
        self.read_during(given.settling_s, given.counted_s)

    def prepare(self, world: World) -> None:
        """Learn which joints follow positions.

        Raises:
            InvalidSpec: none does.
        """
        super().prepare(world)
        self.joints = True
        followers = [
            (place, target)
            for target, (place, joint) in enumerate(zip(self._places, world.actuators, strict=True))
            if joint.follows == "position" and not joint.slides
        ]
        if not followers:
            message = "the task track compares angles with commands, and no hinge of this robot follows positions"
            raise InvalidSpec([Violation("/task", self.name, message, "a robot with such motors, or another task")])
        self._angles, self._targets = map(list, zip(*followers, strict=True))
        self._encoders = [f"angle {world.joints[place].name}" for place in self._angles]

    def fitness(self, trajectory: Trajectory) -> FloatArray:
        """Return `(...)`: minus the root mean square error, rad."""
        angles, commands = trajectory.angles_rad, trajectory.commands
        if angles is None or commands is None:
            return np.full(trajectory.positions_m.shape[:-2], np.nan)
        errors = angles[..., self._angles] - commands[..., self._targets]
        if any(world.biases for world in trajectory.worlds):
            errors += np.array([biases(world, self._encoders) for world in trajectory.worlds])[:, None]
        return np.asarray(-np.sqrt((errors * errors).mean(axis=(-2, -1))))
