"""Memory layout of MuJoCo's C structures, from `mujoco.introspect`."""

from types import ModuleType
from typing import Any

Offsets = dict[str, int]

_SCALARS = {"char": 1, "mjtBool": 1, "int": 4, "float": 4, "mjtNum": 8, "mjtSize": 8, "size_t": 8, "uint64_t": 8}
_SCALARS["uintptr_t"] = _SCALARS["pointer"] = 8


def layout(structs: ModuleType, name: str) -> tuple[Offsets, int]:
    """Return the offset of each field of a structure, and the total size, in bytes on a 64-bit machine.

    Args:
        structs: the module `mujoco.introspect.structs`.
        name: name of the structure, like `mjContact`.
    """
    offsets, size, _ = _struct(structs, structs.STRUCTS[name].fields)
    return offsets, size


def _struct(structs: ModuleType, fields: Any) -> tuple[Offsets, int, int]:
    offsets: Offsets = {}
    end, alignment = 0, 1
    for field in fields:
        size, unit = _measure(structs, field.type)
        offsets[field.name] = _up(end, unit)
        end, alignment = offsets[field.name] + size, max(alignment, unit)
    return offsets, _up(end, alignment), alignment


def _measure(structs: ModuleType, kind: Any) -> tuple[int, int]:
    """Return size and alignment of a field."""
    if type(kind).__name__ == "PointerType":
        return _SCALARS["pointer"], _SCALARS["pointer"]
    if type(kind).__name__ == "ArrayType":
        size, unit = _measure(structs, kind.inner_type)
        for extent in kind.extents:
            size *= extent
        return size, unit
    if type(kind).__name__ == "AnonymousStructDecl":
        return _struct(structs, kind.fields)[1:]
    if kind.name in _SCALARS:
        return _SCALARS[kind.name], _SCALARS[kind.name]
    return _struct(structs, structs.STRUCTS[kind.name].fields)[1:]


def _up(offset: int, unit: int) -> int:
    return -(-offset // unit) * unit
