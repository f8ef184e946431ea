"""The same arithmetic on all x86-64 processors with AVX2: what NumPy and SciPy choose by the processor is fixed.

OpenBLAS, their linear algebra, has other code for processors with AVX-512, and so have NumPy's elementary functions.
Each rounds in its own way, and a search makes large differences of last bits. Both read the environment when they are
imported, so this module is imported before them.
"""

import os
import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

FIXED: Mapping[str, str] = {
    "OPENBLAS_CORETYPE": "Haswell",
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
}
"""Variables that choose code for AVX2. What the environment says already counts instead."""

AVX512: Mapping[str, str] = {"OPENBLAS_CORETYPE": "SkylakeX", "NPY_DISABLE_CPU_FEATURES": ""}
"""Variables that choose code for AVX-512, which results from before the choice may need."""


def fix_arithmetic() -> None:
    """Choose the code for this process, and for those that it starts; nothing on a processor without AVX2."""
    if has("avx2"):
        for name, value in FIXED.items():
            os.environ.setdefault(name, value)


def chosen() -> dict[str, str]:
    """Return the variables that choose the code, as this process has them."""
    return {name: os.environ[name] for name in FIXED if name in os.environ}


@contextmanager
def code_for_avx512() -> Iterator[None]:
    """Choose the code for AVX-512 for processes that are started meanwhile."""
    before = chosen()
    os.environ.update(AVX512)
    try:
        yield
    finally:
        os.environ.update(before)


def has(feature: str) -> bool:
    """Return whether this is an x86-64 processor with a feature like `avx2`, as far as Linux tells."""
    try:
        told = Path("/proc/cpuinfo").read_text()
    except OSError:
        return False
    flags = next((line for line in told.splitlines() if line.startswith("flags")), "")
    return platform.machine() == "x86_64" and feature in flags.split()
