"""The law of motors, joints and contacts as compiled code, which MuJoCo calls in each step, from any thread.

Numba compiles it. MuJoCo hands over addresses of its C structures, and its Python API does not tell where their fields
are. So `layout` computes that from `mujoco.introspect`. `law` reads fields that another minor version may move or mean
otherwise, so pyproject.toml permits one minor version of MuJoCo. Numba's values are untyped, hence `Any`.
"""

import ctypes
from ctypes import CDLL, c_int, c_void_p
from functools import cache, partial, reduce
from importlib import import_module
from operator import mul
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gaplab.services.engines.mujoco.law import (
    AHEAD,
    DOFS,
    ROWS,
    STEP,
    SWEEPS,
    apply_impulses,
    coast,
    damp,
    drive,
    drive_torques,
    press,
    stick,
    stop,
    touch,
)
from gaplab.services.world.world import friction_nm

Offsets = dict[str, int]

_SCALARS = {
    "char": ctypes.c_char,
    "mjtBool": ctypes.c_bool,
    "int": ctypes.c_int,
    "float": ctypes.c_float,
    "mjtNum": ctypes.c_double,
    "mjtSize": ctypes.c_int64,
    "size_t": ctypes.c_size_t,
    "uint64_t": ctypes.c_uint64,
    "uintptr_t": ctypes.c_size_t,
}


def layout(name: str) -> tuple[Offsets, int]:
    """Return the offset of each field of a structure, like `mjContact`, and the total size, in bytes."""
    made = _type(name)
    return {field: getattr(made, field).offset for field, _ in made._fields_}, ctypes.sizeof(made)


def _type(kind: Any) -> Any:
    """Return what ctypes has for the name of a type, or for a type of MuJoCo's without a name."""
    match type(kind).__name__:
        case "PointerType":
            return ctypes.c_void_p
        case "ArrayType":
            return reduce(mul, kind.extents, _type(kind.inner_type))
        case "ValueType":
            return _type(kind.name)
        case "AnonymousStructDecl":
            return _struct(kind.fields)
    return _SCALARS.get(kind) or _struct(import_module("mujoco.introspect.structs").STRUCTS[kind].fields)


def _struct(fields: Any) -> type[ctypes.Structure]:
    return type("Struct", (ctypes.Structure,), {"_fields_": [(each.name, _type(each.type)) for each in fields]})


MANY = 1 << 20
"""Length of an array view whose true length the compiled code does not need."""

UNMOVED = 1e-12
"""Squared length of the row of a contact that no joint moves away from the ground."""


class Callbacks(NamedTuple):
    """C functions for MuJoCo's `mjcb_control`, `mjcb_time` and `mjcb_sensor`."""

    law: Any
    clock: Any
    sensor: Any


@cache
def callbacks() -> Callbacks:
    """Return the law, a constant clock, and a sensor of accelerations.

    MuJoCo reads the time at every stage of a step, which takes longer than some stages; the constant clock saves that.
    Compiling takes about two seconds, once in a process.
    Source: https://mujoco.readthedocs.io/en/stable/programming/simulation.html#physics-callbacks
    """
    numba = import_module("numba")
    types = numba.types
    law = numba.cfunc(types.void(types.voidptr, types.voidptr), error_model="numpy")(_law(numba))
    clock = numba.cfunc(types.float64())(lambda: 0.0)
    sensor = numba.cfunc(types.void(types.voidptr, types.voidptr, types.int32))(_sensor(numba))
    return Callbacks(law.ctypes, clock.ctypes, sensor.ctypes)


@cache
def torque_teller() -> Any:
    """Return `drive_torques` with its first argument, compiled."""
    compiled = import_module("numba").njit(error_model="numpy")
    return partial(compiled(drive_torques), compiled(drive))


def _law(numba: Any) -> Any:
    """Compute torques, then forces of joints and contacts, which are added; MuJoCo's solver has no rows left."""
    at, settings_of = layout("mjData")[0], layout("mjModel")[0]["numeric_data"] // 8
    rows_of, forces_of = at["nefc"] // 4, at["qfrc_applied"] // 8
    angles_of, speeds_of = at["qpos"] // 8, at["qvel"] // 8
    accelerations_of = at["qacc_warmstart"] // 8  # those of the last step: MuJoCo copies them there at its end
    view, pointer, compiled = numba.carray, _pointer(numba), numba.njit(error_model="numpy")
    turn, slow, meet = compiled(drive), compiled(damp), compiled(_meet(numba))

    def law(model: Any, data: Any) -> None:
        fields, counts = view(data, MANY, np.int64), view(data, MANY, np.int32)
        known = view(pointer(view(model, MANY, np.int64)[settings_of]), MANY, np.float64)
        dofs = int(known[DOFS])
        forces = view(pointer(fields[forces_of]), dofs, np.float64)
        angles = view(pointer(fields[angles_of]), dofs + int(known[AHEAD]), np.float64)
        speeds = view(pointer(fields[speeds_of]), dofs, np.float64)
        accelerations = view(pointer(fields[accelerations_of]), dofs, np.float64)
        turn(known, forces, angles, speeds, accelerations)
        slow(known, forces, speeds)
        if counts[rows_of] > 0:
            meet(model, data, known, forces, counts[rows_of])
            counts[rows_of] = 0

    return law


def _sensor(numba: Any) -> Any:
    """Copy the accelerations at the end of a step to the readings of sensors, which a rollout returns."""
    at, model_at = layout("mjData")[0], layout("mjModel")[0]
    accelerations_of, readings_of, dofs_of = at["qacc"] // 8, at["sensordata"] // 8, model_at["nv"] // 8
    view, pointer = numba.carray, _pointer(numba)

    def sensor(model: Any, data: Any, _: Any) -> None:
        fields, dofs = view(data, MANY, np.int64), view(model, MANY, np.int64)[dofs_of]
        readings = view(pointer(fields[readings_of]), dofs, np.float64)
        accelerations = view(pointer(fields[accelerations_of]), dofs, np.float64)
        for dof in range(dofs):
            readings[dof] = accelerations[dof]

    return sensor


def _meet(numba: Any) -> Any:
    """Compute the impulses of joints and contacts, and add them as forces on the degrees of freedom."""
    at = layout("mjData")[0]
    bias_of, smooth_of, free_of = at["qfrc_bias"] // 8, at["qfrc_smooth"] // 8, at["qacc_smooth"] // 8
    jacobian_of, inverse_of, before_of = at["efc_J"] // 8, at["efc_AR"] // 8, at["efc_vel"] // 8
    excess_of, frictions_of, impulses_of = at["efc_b"] // 8, at["efc_frictionloss"] // 8, at["efc_force"] // 8
    view, pointer, solve = numba.carray, _pointer(numba), _solve()
    begin, balance, bear, aim, land = (
        numba.njit(error_model="numpy")(each) for each in (coast, press, apply_impulses, _aim(numba), _land(numba))
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
        singles = aim(data, known, before, excess, frictions)
        land(data, known, jacobian, before, excess, frictions)
        inverse = view(pointer(fields[inverse_of]), (rows, rows), np.float64)
        balance(int(known[SWEEPS]), singles, inverse, excess, frictions, impulses)
        bear(step, jacobian, impulses, forces)

    return meet


def _aim(numba: Any) -> Any:
    """Set the bounds of dry friction's impulses, and the target speeds of limits; return the numbers of their rows."""
    at = layout("mjData")[0]
    brakes_of, limits_of, gaps_of = at["nf"] // 4, at["nl"] // 4, at["efc_pos"] // 8
    view, pointer = numba.carray, _pointer(numba)
    end, hold, friction_of = (numba.njit(error_model="numpy")(each) for each in (stop, stick, friction_nm))

    def aim(data: Any, known: Any, before: Any, excess: Any, frictions: Any) -> Any:
        fields, counts = view(data, MANY, np.int64), view(data, MANY, np.int32)
        brakes = int(counts[brakes_of])
        singles = brakes + int(counts[limits_of])
        gaps = view(pointer(fields[gaps_of]), singles, np.float64)
        hold(known, friction_of, before, frictions)
        for row in range(brakes):
            frictions[row] *= known[STEP]
        for row in range(brakes, singles):
            excess[row] -= end(known, gaps[row])
            frictions[row] = np.inf
        return brakes, singles

    return aim


def _land(numba: Any) -> Any:
    """Set the target speeds and the coefficients of contacts."""
    at, (contact, size) = layout("mjData")[0], layout("mjContact")
    count_of, contacts_of, row_of = at["ncon"] // 4, at["contact"] // 8, contact["efc_address"] // 4
    depth_of, friction_of = contact["dist"] // 8, contact["friction"] // 8
    view, pointer, want = numba.carray, _pointer(numba), numba.njit(error_model="numpy")(touch)

    def land(data: Any, known: Any, jacobian: Any, before: Any, excess: Any, frictions: Any) -> None:
        fields = view(data, MANY, np.int64)
        for number in range(view(data, MANY, np.int32)[count_of]):
            here = pointer(fields[contacts_of] + number * size)
            its, row = view(here, MANY, np.float64), view(here, MANY, np.int32)[row_of]
            if row >= 0:
                all_three, coefficients = slice(row, row + ROWS), its[friction_of : friction_of + 5]
                frictions[row] = want(known, -its[depth_of], before[all_three], coefficients, excess[all_three])
                if known[AHEAD] == 0.0 and np.sum(jacobian[row] ** 2) < UNMOVED:
                    frictions[row] = excess[row] = 0.0  # it bears no load, so it has no friction either

    return land


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
