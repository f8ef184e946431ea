"""The MuJoCo engine: worlds are grouped by what is compiled, and the rollouts of a group run in one call."""

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Annotated

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.base import ALL_FIELDS, USUALLY_IN_PLACE, Engine
from gaplab.services.engines.mujoco.scene import MuJoCoScene
from gaplab.services.engines.stepping import WarmScenes, consecutive, recording
from gaplab.services.world.motions import Loop, Motion, Recording, Trajectory
from gaplab.services.world.world import World


class MuJoCoOptions(Frozen):
    """Options of the engine `mujoco`."""

    threads: Annotated[int, Field(ge=1, le=256)] = Field(
        default=1, description="threads that share the rollouts of a call; the numbers do not depend on it"
    )


class MuJoCo(Engine):
    """MuJoCo's rigid bodies in batches, with motors and contacts that follow the same law as PyBullet's.

    A contact that slides has dynamic friction, any other static friction. Restitution acts on impacts faster than the
    speed that gravity adds in two steps. Deterministic within one version and architecture, for any number of threads.
    """

    name = "mujoco"
    source = "https://mujoco.org, version 4.0; docs/engines.md"
    library = "mujoco"
    usual_rollout_s = 0.002
    install = "pip install 'gaplab[mujoco]'"
    Options = MuJoCoOptions
    options: MuJoCoOptions
    honours = ALL_FIELDS
    in_place = USUALLY_IN_PLACE | {
        "body.center_m",
        "body.inertia",
        "gravity_m_s2",
        "joint.armature",
        "joint.limits",
        "motor.follows",
        "slope_rad",
    }
    closes_loops = True
    repeatable = True

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        mujoco = import_module("mujoco")
        self._scenes = WarmScenes(lambda world: MuJoCoScene(mujoco, world, self.options.threads))

    @classmethod
    def runs(cls, world: World) -> bool:
        """Return whether the world has bodies."""
        return bool(world.bodies)

    @classmethod
    def available(cls) -> bool:
        """Return whether MuJoCo is installed, and Numba, which compiles the contact law."""
        return super().available() and find_spec("numba") is not None

    def rollout(self, world: World, motion: Motion | Loop) -> Trajectory:
        """Return the trajectory of the observed body, `(t, 3)`; times are rounded to whole time steps."""
        poses = self._scenes[world.built(self.in_place)].poses([world], [motion])[0, 0]
        return Trajectory(motion.observe_s, poses[:, :3], poses[:, 3:])

    def rollouts(self, worlds: Sequence[World], motions: Sequence[Motion | Loop]) -> Trajectory:
        """Return every motion in every world; worlds that differ only in place share calls of MuJoCo."""
        poses = np.empty((len(motions), len(worlds), len(motions[0].observe_s), 7))
        left = list(range(len(worlds)))
        while left:
            built = worlds[left[0]].built(self.in_place)
            alike = [column for column in left if worlds[column].built(self.in_place) == built]
            here = consecutive(alike)
            poses[:, here] = self._scenes[built].poses([worlds[column] for column in alike], motions)
            left = [column for column in left if column not in alike]
        return Trajectory(motions[0].observe_s, poses[..., :3], poses[..., 3:])

    def record(self, world: World, motion: Motion | Loop, times_s: FloatArray) -> Recording:
        """Return the same rollout with joint angles and torques."""
        return recording(motion, times_s, *self._scenes[world.built(self.in_place)].record(world, motion, times_s))

    def close(self) -> None:
        """End all threads."""
        self._scenes.close()
