"""What a world does: commands of a controller, in advance or in a loop, and what is observed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any, TypeAlias

import numpy as np

from gaplab.services.core.arrays import FloatArray, Genome, frozen, no_readings
from gaplab.services.world.world import Quaternion, Vector, World

Act: TypeAlias = Callable[[FloatArray, FloatArray, FloatArray, float], tuple[FloatArray, FloatArray]]
"""Genomes `(n, g)`, observations `(n, s)`, memories `(n, m)` and seconds to targets `(n, a)` and memories `(n, m)`.

Each row of the results depends on the same row of the arguments alone, to the last bit, whatever n is.
"""


Tilt: TypeAlias = tuple[float, float]
LEVEL: Tilt = (0.0, 0.0)


@dataclass(frozen=True)
class Start:
    """How a robot is at time 0: a part that is None is as the world has it, at rest.

    Attributes:
        position_m: of the base's frame.
        turn: rotation of the base, as x, y, z, w.
        velocity_m_s: of the base's frame, along the axes of the world.
        turning_rad_s: angular velocity of the base, in its own frame.
        angles_rad: angle of each joint, in the world's order; m for a joint that slides.
        speeds_rad_s: speed of each joint, likewise.
    """

    position_m: Vector | None = None
    turn: Quaternion | None = None
    velocity_m_s: Vector | None = None
    turning_rad_s: Vector | None = None
    angles_rad: tuple[float, ...] | None = None
    speeds_rad_s: tuple[float, ...] | None = None


@dataclass(frozen=True, eq=False)
class Motion:
    """Actuator targets over time, constant between changes.

    Attributes:
        times_s: `(k,)`, ascending from 0: times at which targets change.
        targets: `(k, a)`: targets from each time on, in the unit of what each motor follows: rad for a servo's hinge.
        observe_s: `(t,)`, ascending: times of observation; the last one ends the rollout.
        start_tilt_rad: rotation of the base at time 0, about x and y of the world.
        every_s: interval at which a smooth curve was sampled; 0 if targets step.
        start: how the robot is at time 0; None if it is as the world has it.
        joints: true if the trajectory has what encoders tell, too.
        until_s: time after which sensors say nothing: all readings are 0 then, in every simulator.
        read: joints whose angle at the start is what their encoder said of it, bias and all.
    """

    times_s: FloatArray
    targets: FloatArray
    observe_s: FloatArray
    start_tilt_rad: Tilt = LEVEL
    every_s: float = 0.0
    start: Start | None = None
    joints: bool = False
    until_s: float = inf
    read: tuple[str, ...] = ()

    def observed_at(self, times_s: FloatArray, joints: bool | None = None) -> "Motion":
        """Return the same motion, observed at other times `(t,)`; None tells joints if the motion itself does."""
        return replace(self, observe_s=times_s, joints=self.joints if joints is None else joints)


@dataclass(frozen=True, eq=False)
class Loop:
    """A controller in a loop: once in each period, it observes and sets the targets of the actuators.

    Attributes:
        act: function that all loops of a call share: see Act.
        senses: groups of `sensing.GROUPS` that it observes, in that order.
        genome: `(g,)`: its row of the genomes.
        memory: `(m,)`: its memory at time 0.
        period_s: time between two calls of `act`, the first at time 0, rounded to whole time steps.
        observe_s: `(t,)`, ascending: times at which the trajectory is observed; the last one ends the rollout.
        observation_noise: `(ticks, s)`: what is added to its observations, by call of `act`; empty: nothing.
        target_noise: `(ticks, a)`: what is added to its targets, likewise.
        latency_s: age of its observations.
        start_tilt_rad: rotation of the base at time 0, about x and y of the world.
        start: how the robot is at time 0; None if it is as the world has it.
        joints: true if the trajectory has what encoders tell, too.
    """

    act: Act
    senses: tuple[str, ...]
    genome: Genome
    memory: FloatArray
    period_s: float
    observe_s: FloatArray
    observation_noise: FloatArray = field(default_factory=no_readings)
    target_noise: FloatArray = field(default_factory=no_readings)
    latency_s: float = 0.0
    start_tilt_rad: Tilt = LEVEL
    start: Start | None = None
    joints: bool = False

    def observed_at(self, times_s: FloatArray, joints: bool | None = None) -> "Loop":
        """Return the same loop, observed at other times `(t,)`; None tells joints if the loop itself does."""
        return replace(self, observe_s=times_s, joints=self.joints if joints is None else joints)

    @property
    def ticks(self) -> int:
        """Return the number of calls of `act` in a rollout."""
        return int(np.floor(float(self.observe_s[-1]) / self.period_s + 1e-6)) + 1


def commands_at(motion: Motion | Loop, times_s: FloatArray) -> FloatArray | None:
    """Return the targets `(t, a)` at times `(t,)`; None if they depend on what the controller observes."""
    if isinstance(motion, Loop):
        return None
    return np.asarray(motion.targets[np.searchsorted(motion.times_s, times_s + 1e-9, side="right") - 1])


def open_loop(motion: Motion | Loop) -> Motion:
    """Return a motion whose targets are known in advance.

    Raises:
        TypeError: it is a loop, whose targets depend on what it observes.
    """
    if isinstance(motion, Loop):
        raise TypeError("a loop has no targets before it observes")
    return motion


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The observed motion of the base, or of the world's observed body.

    Attributes:
        times_s: `(t,)`: the motion's `observe_s`.
        positions_m: `(..., t, 3)`: positions of the base's frame; leading axes are motions × worlds. All nan where the
            physics failed.
        orientations: `(..., t, 4)`: orientations of the base, as quaternions x, y, z, w.
        angles_rad: `(..., t, joints)`: angles of the joints in the world's order, with every full turn, m for a joint
            that slides; None, as the next two, unless the motion's `joints` asks for them.
        speeds_rad_s: `(..., t, joints)`: their speeds.
        torques_nm: `(..., t, joints)`: torques of their motors in the time step before; 0 at time 0.
        commands: `(..., t, a)`: targets that the controller asks for; axes of size 1 stand for any size; None, too, if
            they are not known in advance.
        worlds: that of each item of the axis before t; empty: all are the robot's own.
    """

    times_s: FloatArray
    positions_m: FloatArray
    orientations: FloatArray
    angles_rad: FloatArray | None = None
    speeds_rad_s: FloatArray | None = None
    torques_nm: FloatArray | None = None
    commands: FloatArray | None = None
    worlds: Sequence[World] = field(default=(), kw_only=True)

    def mapped(
        self, change: Callable[..., FloatArray], *others: "Trajectory", times_s: FloatArray | None = None
    ) -> "Trajectory":
        """Return the trajectory with each of its arrays changed, and perhaps other times; None stays None.

        `change` gets the array of each of the others, too.
        """
        changed: dict[str, Any] = {
            name: change(*(getattr(each, name) for each in (self, *others)))
            for name in ("positions_m", "orientations", "angles_rad", "speeds_rad_s", "torques_nm", "commands")
            if getattr(self, name) is not None
        }
        return Trajectory(self.times_s if times_s is None else times_s, **changed)

    @classmethod
    def stacked(cls, trajectories: Sequence["Trajectory"], axis: int = 0) -> "Trajectory":
        """Return trajectories of the same times as one, along a new axis."""
        first, *others = trajectories
        return first.mapped(lambda *each: np.stack(each, axis=axis), *others)


@dataclass(frozen=True, eq=False)
class Recording:
    """A rollout with additional observations and joint angles.

    Attributes:
        trajectory: trajectory, bit-equal to that of the plain rollout.
        times_s: `(k,)`: times of observation.
        poses: `(k, 7)`: positions and quaternions x, y, z, w of the base's frame; nan where the physics failed.
        angles_rad: `(k, joints)`, in the world's order, with every full turn; m for a joint that slides; None if the
            engine does not provide them.
        torques_nm: `(k, joints)`: torques of the motors in the time step before; None if the engine does not provide
            them.
    """

    trajectory: Trajectory
    times_s: FloatArray
    poses: FloatArray
    angles_rad: FloatArray | None
    torques_nm: FloatArray | None = None


NO_MEMORY = frozen([])
"""The memory of a controller without one."""
