"""The contract of an engine: World and Motion in, Trajectory out; and of one that keeps scenes of bodies."""

from abc import abstractmethod
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from threading import RLock
from types import MappingProxyType
from typing import Any, ClassVar, Generic, Protocol, TypeAlias, TypeVar

import numpy as np

from gaplab.schemas.base import Frozen
from gaplab.schemas.plugin import PluginRead
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import EngineUnavailable
from gaplab.services.core.registry import Plugin
from gaplab.services.world.kinematics import observes_base
from gaplab.services.world.motions import Loop, Motion, Recording, Trajectory
from gaplab.services.world.world import ORIGIN, UNTURNED, Body, Capsule, Cylinder, Hull, Joint, PDMotor, Shape, World

Uses: TypeAlias = Callable[[World], bool]


def _bodies(differs: Callable[[Body], bool]) -> Uses:
    return lambda world: any(differs(body) for body in world.bodies)


def _joints(differs: Callable[[Joint], Any]) -> Uses:
    return lambda world: any(differs(joint) for joint in world.joints)


def _motors(differs: Callable[[PDMotor], Any]) -> Uses:
    return _joints(lambda joint: isinstance(joint.motor, PDMotor) and bool(differs(joint.motor)))


def _shapes(kind: type[Shape]) -> Uses:
    return _bodies(lambda body: any(isinstance(part.shape, kind) for part in body.parts))


USES: Mapping[str, Uses] = MappingProxyType(
    {
        "body.center_m": _bodies(lambda body: isinstance(body.shape, tuple) and body.center_m != ORIGIN),
        "body.inertia": _bodies(lambda body: body.inertia is not None),
        "body.parts": _bodies(lambda body: isinstance(body.shape, tuple)),
        "fixed": lambda world: world.fixed,
        "joint.armature": _joints(lambda joint: joint.armature),
        "joint.damping": _joints(lambda joint: joint.damping),
        "joint.dry_friction": _joints(lambda joint: joint.dry_friction),
        "joint.limits": _joints(lambda joint: joint.limits is not None),
        "joint.slides": _joints(lambda joint: joint.slides),
        "gravity_tilt_rad": lambda world: any(world.gravity_tilt_rad),
        "ground_m": lambda world: bool(world.ground_m),
        "joint.start": _joints(lambda joint: joint.start),
        "joint.static_friction": _joints(lambda joint: joint.static_friction),
        "joint.stribeck_speed": _joints(lambda joint: joint.static_friction),
        "joint.turn": _joints(lambda joint: joint.turn != UNTURNED),
        "motor.delay_s": _motors(lambda motor: motor.delay_s),
        "motor.follows": _motors(lambda motor: motor.follows != "position"),
        "motor.kd": _motors(lambda motor: motor.kd),
        "motor.kp": _motors(lambda motor: motor.kp),
        "noise.start_tilt_rad": lambda world: bool(world.noise.start_tilt_rad),
        "observed": lambda world: bool(world.bodies) and not observes_base(world),
        "shape.capsule": _shapes(Capsule),
        "shape.cylinder": _shapes(Cylinder),
        "shape.hull": _shapes(Hull),
        "slope_rad": lambda world: bool(world.slope_rad),
        "start_turn": lambda world: world.start_turn != UNTURNED,
        "surfaces": _bodies(lambda body: bool(body.surface)),
    }
)
"""Whether a world uses a field, by its name in the `honours` of engines."""


ALL_FIELDS = frozenset(
    {
        "material.static_friction",
        "material.dynamic_friction",
        "material.restitution",
        "body.mass_kg",
        "body.shape",
        "motor.position_gain",
        "motor.max_torque_nm",
        "motor.max_speed_rad_s",
        "start_height_m",
        "gravity_m_s2",
        "time_step_s",
        "solver_iterations",
        *USES,
    }
)
"""All fields of a World that an engine can honour."""

USUALLY_IN_PLACE = frozenset(
    {
        "biases",
        "body.mass_kg",
        "ground_m",
        "joint.damping",
        "joint.dry_friction",
        "joint.static_friction",
        "joint.stribeck_speed",
        "motor.delay_s",
        "motor.kd",
        "motor.kp",
        "motor.max_speed_rad_s",
        "motor.max_torque_nm",
        "motor.position_gain",
        "noise",
        "noise.start_tilt_rad",
        "surfaces",
        "time_offset_s",
    }
)
"""Fields that all of gaplab's engines with bodies set in place."""


class Engine(Plugin):
    """A physics engine.

    One instance lives in one process, and keeps its worlds loaded between rollouts. A rollout is bit-equal on repeat,
    whatever ran before. If the simulation diverges, the trajectory is nan; an engine does not raise.

    Attributes:
        library: Python module that the engine needs, imported inside the class; None if there is none.
        install: command that installs the library.
        honours: World fields that affect the results, like `material.dynamic_friction`: names of `ALL_FIELDS`.
        in_place: fields in which worlds may differ and still share what the engine built: names as in `World.edited`.
        closes_loops: true if it runs Loops, not only Motions.
        tells_joints: true if a trajectory has what encoders tell, where its motion's `joints` asks for it.
        sets_starts: true if a motion's `start` says where and how fast it begins.
        batch: preferred number of rollouts in a call; 1 if a call has little overhead.
        usual_rollout_s: usual seconds of a rollout, for estimates before any measurement.
        repeatable: true if a rollout is only computed, so that it may be repeated at any time: for replays, and by
            several repetitions at once. False by default, because an engine may move hardware.
    """

    library: ClassVar[str | None] = None
    install: ClassVar[str] = ""
    honours: ClassVar[frozenset[str]]
    in_place: ClassVar[frozenset[str]] = frozenset()
    closes_loops: ClassVar[bool] = False
    tells_joints: ClassVar[bool] = False
    sets_starts: ClassVar[bool] = False
    batch: ClassVar[int] = 1
    usual_rollout_s: ClassVar[float] = 0.02
    repeatable: ClassVar[bool] = False
    catalogued = ("closes_loops", "tells_joints", "sets_starts")

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        if not self.available():
            raise EngineUnavailable(f"the engine {self.name!r} needs a library: {self.install}")

    @classmethod
    @abstractmethod
    def runs(cls, world: World) -> bool:
        """Return whether the engine can simulate the world."""

    @classmethod
    def exceeded(cls, world: World) -> str | None:  # noqa: ARG003 - for those that have a limit
        """Return which limit of the engine the world exceeds, for the error that says so; None for none."""
        return None

    @classmethod
    def lacks(cls, world: World) -> tuple[str, ...]:
        """Return the names of the fields that the world uses and the engine does not honour, sorted.

        A world uses a field of `USES` if its value differs from that without a name. Fields that every world has, like
        its material, are not among them.
        """
        return tuple(sorted(name for name, uses in USES.items() if name not in cls.honours and uses(world)))

    @abstractmethod
    def rollout(self, world: World, motion: Motion | Loop) -> Trajectory:
        """Return the trajectory of the observed body, `(t, 3)`, under the motion from the start of the world."""

    def rollouts(self, worlds: Sequence[World], motions: Sequence[Motion | Loop]) -> Trajectory:
        """Return every motion in every world, `(n motions, m worlds, t, 3)`; observation times are equal.

        An engine that is faster in batches overrides this loop.
        """
        rows = [[self.rollout(world, motion) for world in worlds] for motion in motions]
        return Trajectory.stacked([Trajectory.stacked(row) for row in rows])

    def record(self, world: World, motion: Motion | Loop, times_s: FloatArray) -> Recording:
        """Return the same rollout, with poses at times `(k,)`, ascending, from 0 to the last observation.

        This default records the base alone. An engine that has joint angles overrides it.
        """
        seen = self.rollout(world, motion.observed_at(times_s))
        poses = np.hstack([seen.positions_m, seen.orientations])
        return Recording(self.rollout(world, motion), times_s, poses, None)

    def stop(self) -> None:
        """Stop the hardware at once, if there is any; called from another thread while a rollout is under way."""

    @classmethod
    def available(cls) -> bool:
        """Return whether the engine's library is installed."""
        return cls.library is None or find_spec(cls.library) is not None

    @classmethod
    def describe(cls) -> PluginRead:
        """Return the catalogue's entry, with the install command if the library is missing."""
        note = None if cls.available() else f"not installed: {cls.install}"
        return super().describe().model_copy(update={"available": cls.available(), "note": note})

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return the World fields that the engine honours, and what else it can do, for the catalogue."""
        return {"honours": sorted(cls.honours), **super().details()}


WARM_SCENES = 4
"""Largest number of cached scenes. Worlds that differ only in material, or in what is set in place, share a scene."""


class Warm(Protocol):
    """A scene that is kept for the next rollout."""

    def close(self) -> None:
        """Release the engine's resources."""


S = TypeVar("S", bound=Warm)


class WarmScenes(Generic[S]):
    """A cache of scenes by world; `build` builds the scene of a world."""

    def __init__(self, build: Callable[[World], S]) -> None:
        self._build = build
        self._scenes: OrderedDict[World, S] = OrderedDict()
        self._latest: tuple[World, S] | None = None

    def __getitem__(self, world: World) -> S:
        if self._latest is not None and self._latest[0] == world:  # a hash would take 25 µs
            return self._latest[1]
        scene = self._scenes.pop(world, None) or self._build(world)
        self._scenes[world] = scene
        while len(self._scenes) > WARM_SCENES:
            self._scenes.popitem(last=False)[1].close()
        self._latest = world, scene
        return scene

    def drop(self, world: World) -> None:
        """Drop a broken scene; the next call rebuilds it."""
        self._latest = None
        self._scenes.pop(world).close()

    def close(self) -> None:
        """Close all scenes."""
        self._latest = None
        while self._scenes:
            self._scenes.popitem()[1].close()


class SceneEngine(Engine, Generic[S]):
    """An engine of worlds with bodies, which keeps one scene for all worlds that are built alike.

    Threads may share it: `_turn` lets one of them at a time use the scenes.
    """

    honours = ALL_FIELDS
    repeatable = True
    closes_loops = tells_joints = sets_starts = True

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        self._scenes, self._turn = WarmScenes(self._build), RLock()

    @abstractmethod
    def _build(self, world: World) -> S:
        """Build the scene of a world."""

    @classmethod
    def runs(cls, world: World) -> bool:
        """Return whether the world has bodies, and exceeds no limit of the engine."""
        return bool(world.bodies) and cls.exceeded(world) is None

    def close(self) -> None:
        """Close all scenes."""
        with self._turn:
            self._scenes.close()
