"""Inertia that the motor of each joint moves, at the reference angles, if all other joints are free."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.robots.bodies import FREE, joint_name
from gaplab.services.robots.reading import Source, mujoco_library


def joint_inertias(source: Source) -> Mapping[str, float]:
    """Return the inertia of each joint, kg m² or kg; a fixed base does not give way to its motors."""
    model = source.model
    dofs = [dof for dof in range(model.nv) if model.jnt_type[model.dof_jntid[dof]] != FREE]
    is_held = source.fixed and model.jnt_type[0] == FREE
    inverse = _inverse_on_a_fixed_base(model) if is_held else model.dof_invweight0
    return {joint_name(model, int(model.dof_jntid[dof])): 1 / float(inverse[dof]) for dof in dofs}


def _inverse_on_a_fixed_base(model: Any) -> FloatArray:  # noqa: ANN401
    """Return `(nv,)`: the inverse inertia of each degree of freedom, 0 for the six of the base."""
    mujoco = mujoco_library()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    return np.concatenate([np.zeros(6), np.diag(np.linalg.inv(matrix[6:, 6:]))])
