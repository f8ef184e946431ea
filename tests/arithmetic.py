"""The code that NumPy runs in this process, as it tells itself."""

import ctypes
from pathlib import Path
from typing import Any

import numpy as np


def code_of_numpy() -> Any:
    """The kind of processor whose code OpenBLAS runs."""
    (library,) = (Path(np.__file__).parents[1] / "numpy.libs").glob("*openblas*")
    told = ctypes.CDLL(str(library)).scipy_openblas_get_corename64_
    told.restype = ctypes.c_char_p
    return told().decode()


def told() -> str:
    """The kind of processor whose code OpenBLAS runs, and the sets of instructions of NumPy's own code."""
    used = np.show_config(mode="dicts")["SIMD Extensions"]  # type: ignore[call-overload]
    return f"{code_of_numpy()}, {' '.join([*used['baseline'], *used.get('found', [])])}"
