"""The contact law as compiled code, which MuJoCo calls in the middle of each step, from any thread, without Python.

Numba compiles it. `mujoco.introspect` describes the layout of MuJoCo's data. Numba's values are untyped, hence `Any`.
"""

from ctypes import CDLL, c_int, c_void_p
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from gaplab.services.engines.mujoco.law import DOFS, ROWS, STEP, SWEEPS, apply_impulses, coast, drive, press, touch
from gaplab.services.engines.mujoco.layout import layout

MANY = 1 << 20
"""Length of an array view whose true length the compiled code does not need."""


@cache
def callbacks() -> tuple[Any, Any]:
    """Return the law and a constant clock, as C functions for `mjcb_control` and `mjcb_time`.

    MuJoCo reads the time at every stage of a step, which takes longer than some stages; the constant clock saves that.
    Compiling takes about two seconds, once in a process.
    Source: https://mujoco.readthedocs.io/en/stable/programming/simulation.html#physics-callbacks
    """
    numba = import_module("numba")
    types = numba.types
    law = numba.cfunc(types.void(types.voidptr, types.voidptr), error_model="numpy")(_law(numba))
    clock = numba.cfunc(types.float64())(lambda: 0.0)
    return law.ctypes, clock.ctypes


def _law(numba: Any) -> Any:
    """Compute torques, then contact forces, which are added to them; MuJoCo's solver has no contacts left."""
    at = layout(import_module("mujoco.introspect.structs"), "mjData")[0]
    time, rows_of, forces_of, angles_of = at["time"] // 8, at["nefc"] // 4, at["qfrc_applied"] // 8, at["qpos"] // 8
    known_of, speeds_of, accelerations_of = at["userdata"] // 8, at["qvel"] // 8, at["qacc"] // 8
    view, pointer, compiled = numba.carray, _pointer(numba), numba.njit(error_model="numpy")
    turn, meet = compiled(drive), compiled(_meet(numba))

    def law(model: Any, data: Any) -> None:
        fields, counts = view(data, MANY, np.int64), view(data, MANY, np.int32)
        known = view(pointer(fields[known_of]), MANY, np.float64)
        dofs = int(known[DOFS])
        forces = view(pointer(fields[forces_of]), dofs, np.float64)
        angles = view(pointer(fields[angles_of]), dofs + 1, np.float64)
        speeds = view(pointer(fields[speeds_of]), dofs, np.float64)
        accelerations = view(pointer(fields[accelerations_of]), dofs, np.float64)
        if view(data, MANY, np.float64)[time] == 0.0:
            for dof in range(dofs):
                accelerations[dof] = 0.0
        turn(known, forces, angles, speeds, accelerations)
        if counts[rows_of] > 0:
            meet(model, data, known, forces, counts[rows_of])
            counts[rows_of] = 0

    return law


def _meet(numba: Any) -> Any:
    """Compute the impulses of all contacts, and add them as forces on the joints."""
    structs = import_module("mujoco.introspect.structs")
    at, (contact, size) = layout(structs, "mjData")[0], layout(structs, "mjContact")
    bias_of, smooth_of, free_of = at["qfrc_bias"] // 8, at["qfrc_smooth"] // 8, at["qacc_smooth"] // 8
    jacobian_of, inverse_of, before_of = at["efc_J"] // 8, at["efc_AR"] // 8, at["efc_vel"] // 8
    excess_of, frictions_of, impulses_of = at["efc_b"] // 8, at["efc_frictionloss"] // 8, at["efc_force"] // 8
    count_of, contacts_of, row_of = at["ncon"] // 4, at["contact"] // 8, contact["efc_address"] // 4
    depth_of, friction_of = contact["dist"] // 8, contact["friction"] // 8
    view, pointer, solve = numba.carray, _pointer(numba), _solve()
    begin, want, balance, bear = (
        numba.njit(error_model="numpy")(each) for each in (coast, touch, press, apply_impulses)
    )

    def meet(model: Any, data: Any, known: Any, forces: Any, rows: int) -> None:
        fields, dofs, step = view(data, MANY, np.int64), len(forces), known[STEP]
        smooth, bias = pointer(fields[smooth_of]), view(pointer(fields[bias_of]), dofs, np.float64)
        for dof in range(dofs):
            view(smooth, dofs, np.float64)[dof] = forces[dof] - bias[dof]
        solve(model, data, pointer(fields[free_of]), smooth, 1)
        free = view(pointer(fields[free_of]), dofs, np.float64)
        jacobian = view(pointer(fields[jacobian_of]), (rows, dofs), np.float64)
        before = view(pointer(fields[before_of]), rows, np.float64)
        excess = view(pointer(fields[excess_of]), rows, np.float64)
        frictions = view(pointer(fields[frictions_of]), rows, np.float64)
        impulses = view(pointer(fields[impulses_of]), rows, np.float64)
        begin(step, jacobian, before, free, excess, impulses)
        for number in range(view(data, MANY, np.int32)[count_of]):
            here = pointer(fields[contacts_of] + number * size)
            its, row = view(here, MANY, np.float64), view(here, MANY, np.int32)[row_of]
            if row >= 0:
                all_three, coefficients = slice(row, row + ROWS), its[friction_of : friction_of + 5]
                frictions[row] = want(known, -its[depth_of], before[all_three], coefficients, excess[all_three])
        inverse = view(pointer(fields[inverse_of]), (rows, rows), np.float64)
        balance(int(known[SWEEPS]), inverse, excess, frictions, impulses)
        bear(step, jacobian, impulses, forces)

    return meet


def _pointer(numba: Any) -> Any:
    """Convert an address to a pointer, in compiled code."""
    types = numba.types

    def typed(_: Any, __: Any) -> Any:
        def generate(context: Any, builder: Any, ___: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))

        return types.voidptr(types.int64), generate

    return numba.extending.intrinsic(typed)


def _solve() -> Any:
    """Return MuJoCo's `mj_solveM(model, data, x, y, n)`: accelerations x caused by forces y."""
    folder = Path(str(import_module("mujoco").__file__)).parent
    library = next(each for each in sorted(folder.iterdir()) if each.name.startswith(("libmujoco", "mujoco.dll")))
    solve = CDLL(str(library)).mj_solveM
    solve.argtypes, solve.restype = [c_void_p] * 4 + [c_int], None
    return solve
