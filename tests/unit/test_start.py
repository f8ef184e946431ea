"""What processes load at their start: a command or a worker that loads what it does not use starts seconds later.

SciPy loads its parts when they are used: `import scipy` costs nothing, and `from scipy import stats` a second.
"""

import subprocess
import sys

import pytest

PARTS = {"scipy.stats", "scipy.special", "scipy.spatial", "scipy.signal", "scipy.linalg"}

UNUSED = {
    "gaplab.api.commands.cli": {"numpy", "scipy", "sqlalchemy", "psycopg", "fastapi", "ray"},
    "gaplab.api.app": {*PARTS, "matplotlib", "plotly", "fpdf", "pyarrow", "ray"},
    "gaplab.workers.task": {"scipy", "sqlalchemy", "psycopg", "pybullet", "mujoco", "sapien"},
    "gaplab.services.engines.mujoco": {"scipy.spatial", "mujoco", "numba"},
    "gaplab.services.engines.pybullet": {"scipy.spatial", "pybullet"},
    "gaplab.services.engines.physx": {"scipy.spatial", "sapien"},
    "gaplab.services.core.tuners.gauss_newton": PARTS,
    "gaplab.workers.supervisor": {*PARTS, "pybullet", "mujoco", "sapien"},
}
"""Libraries by the module that a process imports first, which leaves them to the few requests that want them."""


@pytest.mark.parametrize("module", UNUSED)
def test_a_process_starts_without_what_it_may_never_use(module: str) -> None:
    told = f"import sys, {module}; print(*sorted({UNUSED[module]!r} & sys.modules.keys()))"

    loaded = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True).stdout

    assert loaded.split() == []
