"""Memory layout of MuJoCo's C structures, from `mujoco.introspect`."""

import ctypes
from functools import reduce
from importlib import import_module
from operator import mul
from typing import Any

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
