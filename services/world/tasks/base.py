"""The contract of a task: how long a rollout lasts, what is fit, and what is read."""

from abc import abstractmethod
from collections.abc import Sequence
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, TypeAlias

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.core.registry import Plugin, listed
from gaplab.services.world.kinematics import product
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.sensing import JOINTS, Bearing, Sensors, feet, in_order, observations
from gaplab.services.world.world import UNTURNED, World


class Task(Plugin):
    """Rates what any robot does.

    Attributes:
        unit: unit of fitness.
        observe_s: `(t,)`, ascending: times at which a trajectory is observed for its fitness; the last one ends it.
        sensors: what is read during a rollout; by default nothing.
        joints: true if it needs the joints of trajectories.
        commanded: true if it needs their commands, which only a controller without a loop has in advance.
        turned: true if it sees a base that begins turned as level at the start.
    """

    unit: ClassVar[str]
    observe_s: FloatArray
    sensors: Sensors = Sensors()
    joints: bool = False
    commanded: ClassVar[bool] = False
    turned: ClassVar[bool] = True

    def prepare(self, world: World) -> None:
        """Learn which robot is rated; called once, before anything is. By default nothing depends on the robot.

        Raises:
            InvalidSpec: the task cannot rate it.
        """

    @abstractmethod
    def fitness(self, trajectory: Trajectory) -> FloatArray:
        """Return `(...)`: the fitness of each trajectory, maximised; nan where the physics failed."""

    def sense(self, trajectory: Trajectory) -> FloatArray:
        """Return `(..., r, s)`: what the sensors say, in their units, of trajectories observed at `sensors.times_s`."""
        return np.empty((*trajectory.positions_m.shape[:-1], len(self.sensors.names)))

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return the unit of fitness and the sensors, for the catalogue."""
        return {"unit": cls.unit, **cls().sensors.details()}


GROUPS = ("base", *(f"{name}s" for name in JOINTS), "contacts")
"""Groups of sensors, in the order of their readings."""

NOISES = MappingProxyType({"tilt": 0.02, "place": 0.005, "angle": 0.002, "speed": 0.05, "torque": 0.05, "contact": 0.5})
"""Usual noises: gaplab's choice, of an inertial sensor, a camera, encoders of 12 bits, motor currents and switches."""

MOST_READINGS = 20_000
"""Most readings of one rollout: twelve angles at 50 Hz for 33 s. A tuning holds those of a thousand rollouts."""


def left_out(description: str) -> Any:  # noqa: ANN401 - as of `Field`
    """Return the field of an option that specs do not have unless it is given: what they say stays as it was."""
    return Field(default=None, exclude_if=lambda value: value is None, description=description)


Groups = Annotated[
    tuple[str, ...],
    BeforeValidator(listed),
    AfterValidator(lambda each: in_order(each, GROUPS, "sensors")),
    Field(min_length=1),
]
Noise = Annotated[Real, Field(gt=0, le=1000)]


class ReadOptions(Frozen):
    """Options of a task that reads sensors; those left out are the task's own."""

    sensors: Groups | None = left_out(
        "what is read, separated by commas: `base`, `angles`, `speeds` and `torques` of the joints with a motor, and "
        "`contacts`, 1 for each foot on the ground, else 0"
    )
    every_s: Annotated[Real, Field(ge=0.001, le=600)] | None = left_out(
        "interval between readings, s; left out: 0.25, of `track` 0.02"
    )
    noise_place: Noise | None = left_out("noise of the place, m; left out: 0.005, that of a camera")
    noise_angle: Noise | None = left_out("noise of each angle, rad; left out: 0.002, that of an encoder of 12 bits")
    noise_speed: Noise | None = left_out("noise of each speed, rad/s; left out: 0.05")
    noise_torque: Noise | None = left_out("noise of each torque, N·m; left out: 0.05")


Sensor: TypeAlias = tuple[str, str, float, float]
"""Name, unit, noise and period of a sensor."""


class ReadingTask(Task):
    """A task whose options say what is read: the observed body, by default its place, and joints.

    Attributes:
        usual: groups that it reads by default.
        usual_every_s: interval of readings by default.
    """

    Options: ClassVar[type[Frozen]] = ReadOptions
    options: ReadOptions
    usual: ClassVar[tuple[str, ...]] = ("base",)
    usual_every_s: ClassVar[float] = 0.25

    def read_during(self, from_s: float, span_s: float) -> None:
        """Read the sensors in each interval after a time, for a span; called once, when the task is made."""
        every_s = self.options.every_s or self.usual_every_s
        self._times_s = frozen(from_s + np.arange(1, np.floor(span_s / every_s + 1e-9) + 1) * every_s)
        ReadingTask.prepare(self, World())

    def prepare(self, world: World) -> None:
        """Set the sensors; they are those of the joints of this robot.

        Raises:
            InvalidSpec: there are too many readings, or contacts of a robot of which another body is observed.
        """
        self._groups, self._world = self.options.sensors or self.usual, world
        if "contacts" in self._groups and world.observed not in ("", world.bodies[0].name if world.bodies else ""):
            message = f"contacts need the motion of the base, and {world.observed} is observed"
            raise InvalidSpec([Violation("/task", "contacts", message, "other sensors, or another observed body")])
        self.joints = self._groups != ("base",)
        self._places = [place for place, joint in enumerate(world.joints) if joint.motor is not None]
        sensors = [each for group in self._groups for each in self._sensors(group, world)]
        names, units, noises, periods = zip(*sensors, strict=True) if sensors else ((), (), (), ())
        times_s = self._times_s if sensors else frozen([])
        self.sensors = Sensors(names, units, frozen(noises), times_s, frozen(periods))
        if self.sensors.size > MOST_READINGS:
            count = f"{self.sensors.size:,} readings of a rollout, {len(times_s)} times {len(sensors)}, are too many"
            message = f"{count}: take a longer `every_s`, or fewer `sensors`"
            raise InvalidSpec([Violation("/task", self.sensors.size, message, f"at most {MOST_READINGS:,}")])

    def base(self) -> Sequence[Sensor]:
        """Return the sensors of the observed body."""
        return [(axis, "m", self.noise("place"), 0.0) for axis in "xyz"]

    def look(self, trajectory: Trajectory) -> FloatArray:
        """Return `(..., r, b)`: what the sensors of `base` say."""
        return np.asarray(trajectory.positions_m)

    def noise(self, of: str) -> float:
        """Return the noise that an option states, or the usual one."""
        return float(getattr(self.options, f"noise_{of}", None) or NOISES[of])

    def sense(self, trajectory: Trajectory) -> FloatArray:
        """Return `(..., r, s)`: what the sensors say; nan of joints that a trajectory does not have."""
        told = [self.look(trajectory) if group == "base" else self._told(trajectory, group) for group in self._groups]
        return told[0] if len(told) == 1 else np.concatenate(told, axis=-1)

    def _told(self, trajectory: Trajectory, group: str) -> FloatArray:
        if group == "contacts":
            return self._contacts(trajectory)
        values: FloatArray | None = getattr(trajectory, JOINTS[group.removesuffix("s")][0])
        if values is None:
            return np.full((*trajectory.positions_m.shape[:-1], len(self._places)), np.nan)
        return np.asarray(values[..., self._places])

    def _contacts(self, trajectory: Trajectory) -> FloatArray:
        turns, start = trajectory.orientations, self._world.start_turn
        if self.turned and start != UNTURNED:  # it was told to be level at the start
            turns = product(turns, np.array(start))
        poses = np.concatenate([trajectory.positions_m, turns], axis=-1)
        if (angles := trajectory.angles_rad) is None:
            return np.full((*poses.shape[:-1], len(feet(self._world))), np.nan)
        if not trajectory.worlds:
            return _touching(self._world, poses, angles)
        each = enumerate(trajectory.worlds)
        return np.stack([_touching(world, poses[..., m, :, :], angles[..., m, :, :]) for m, world in each], axis=-3)

    def _sensors(self, group: str, world: World) -> Sequence[Sensor]:
        if group == "base":
            return self.base()
        if group == "contacts":
            return [(f"contact {foot.name}", "", self.noise("contact"), 0.0) for foot in feet(world)]
        name = group.removesuffix("s")
        units = JOINTS[name][1]
        return [(f"{name} {joint.name}", units[joint.slides], self.noise(name), 0.0) for joint in world.actuators]


def _touching(world: World, poses: FloatArray, angles_rad: FloatArray) -> FloatArray:
    """Return `(..., feet)`: which feet are on the ground of a world, given poses `(..., 7)` of its base, and angles."""
    rows, angles = poses.reshape(-1, 7), angles_rad.reshape(-1, angles_rad.shape[-1])
    seen = observations(world, ["contacts"], Bearing(rows, np.zeros((len(rows), 3)), angles, angles))
    return seen.reshape(*poses.shape[:-1], -1)
