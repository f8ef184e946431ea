"""The contract of an engine: World and Motion in, Trajectory out, and nothing else matters."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from importlib.util import find_spec
from typing import Any, ClassVar

import numpy as np

from gaplab.schemas.plugin import PluginRead
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.registry import Plugin
from gaplab.services.core.world import Motion, Recording, Trajectory, World

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
    }
)
"""What there is to honour in a World, for an engine that honours it all."""


class Engine(Plugin):
    """A physics engine.

    One instance lives in one process and keeps its world warm between rollouts. A rollout is bit-equal on repeat,
    whatever ran before it. Physics that blows up is a trajectory of nan, never an exception.

    Attributes:
        library: the Python module that it needs, or None; it is imported inside the class.
        install: the line that installs it.
        honours: the World fields that change what it computes, like `material.dynamic_friction`.
        batch: rollouts that one call should ask for, if there is a choice; 1 where a call costs little beside one.
        usual_rollout_s: seconds that a rollout usually takes, to estimate with before any was measured.
    """

    library: ClassVar[str | None] = None
    install: ClassVar[str] = ""
    honours: ClassVar[frozenset[str]]
    batch: ClassVar[int] = 1
    usual_rollout_s: ClassVar[float] = 0.02

    @classmethod
    @abstractmethod
    def runs(cls, world: World) -> bool:
        """Whether the engine can simulate such a world at all."""

    @abstractmethod
    def rollout(self, world: World, motion: Motion) -> Trajectory:
        """The base's trajectory, `(t, 3)`, under the motion from the world's start."""

    def rollouts(self, worlds: Sequence[World], motions: Sequence[Motion]) -> Trajectory:
        """Every motion in every world, `(n motions, m worlds, t, 3)`; all motions are observed at the same times.

        An engine that is faster in batches replaces this loop.
        """
        grid = [[self.rollout(world, motion) for world in worlds] for motion in motions]
        return Trajectory(
            times_s=motions[0].observe_s,
            positions_m=np.array([[each.positions_m for each in row] for row in grid]),
            orientations=np.array([[each.orientations for each in row] for row in grid]),
        )

    def record(self, world: World, motion: Motion, times_s: FloatArray) -> Recording:
        """The very rollout of the motion in the world, looked at at these times besides.

        An engine that can tell the angles of its joints replaces this, which tells of the base alone.

        Args:
            world: as of `rollout`.
            motion: as of `rollout`.
            times_s: `(k,)`, ascending, from 0 to the last observation.
        """
        seen = self.rollout(world, replace(motion, observe_s=times_s))
        poses = np.hstack([seen.positions_m, seen.orientations])
        return Recording(self.rollout(world, motion), times_s, poses, None)

    @classmethod
    def available(cls) -> bool:
        """Whether the engine's library is installed."""
        return cls.library is None or find_spec(cls.library) is not None

    @classmethod
    def describe(cls) -> PluginRead:
        """The engine as the catalogue lists it, with its install line if its library is missing."""
        note = None if cls.available() else f"not installed: {cls.install}"
        return super().describe().model_copy(update={"available": cls.available(), "note": note})

    @classmethod
    def details(cls) -> dict[str, Any]:
        """The World fields that the engine honours."""
        return {"honours": sorted(cls.honours)}
