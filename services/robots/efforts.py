"""The largest effort of a joint: the file's, and what the robot's weight needs."""

from typing import Any

import numpy as np

from gaplab.services.robots.bodies import joint_number
from gaplab.services.robots.reading import mujoco_library

PLACEHOLDER = 50.0
"""Effort, as a multiple of what bears the robot's weight, that stands in files whose author did not know it."""


def effort(model: Any, name: str) -> float | None:  # noqa: ANN401
    """Return the largest effort of a joint in the file, N·m or N; None if it has none."""
    at = joint_number(model, name)
    largest = float(np.abs(model.jnt_actfrcrange[at]).max())
    return largest if model.jnt_actfrclimited[at] and largest > 0 else None


def needed_torque(model: Any, name: str) -> float:  # noqa: ANN401
    """Return half the torque that bears the robot at the farthest point of the limb, as legs share the weight."""
    mujoco = mujoco_library()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    at = joint_number(model, name)
    moved = {int(model.jnt_bodyid[at])}
    for body in range(model.nbody):
        if int(model.body_parentid[body]) in moved:
            moved.add(body)
    geoms = [geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in moved]
    reaches = [np.linalg.norm(data.geom_xpos[geom] - data.xanchor[at]) + model.geom_rbound[geom] for geom in geoms]
    weight = float(model.body_mass.sum()) * 9.81
    return weight if model.jnt_type[at] == 2 else 0.5 * weight * float(max(reaches, default=0.1))
