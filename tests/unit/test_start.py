"""What processes load at their start: a command or a worker that loads what it does not use starts seconds later.

SciPy loads its parts when they are used: `import scipy` costs nothing, and `from scipy import stats` a second.
"""

import subprocess
import sys
from pathlib import Path

import pytest

PARTS = {"scipy.stats", "scipy.special", "scipy.spatial", "scipy.signal", "scipy.linalg"}

UNUSED = {
    "gaplab": {"numpy", "pydantic", "sqlalchemy", "httpx2", "rich", "ray"},
    "gaplab.api.library.running, gaplab.api.library.tuning": {
        *PARTS,
        "fastapi",
        "alembic",
        "matplotlib",
        "pandas",
        "pybullet",
        "mujoco",
        "ray",
    },
    "gaplab.workers.process_tasks": {"scipy", "sqlalchemy", "psycopg", "pybullet", "mujoco", "sapien", "ray"},
    "gaplab.api.commands.cli": {"numpy", "scipy", "sqlalchemy", "psycopg", "fastapi", "ray"},
    "gaplab.api.app": {*PARTS, "alembic", "matplotlib", "plotly", "ray"},
    "gaplab.workers.task": {"scipy", "sqlalchemy", "psycopg", "pybullet", "mujoco", "sapien"},
    "gaplab.services.engines.mujoco, gaplab.services.engines.pybullet, gaplab.services.engines.physx, "
    "gaplab.services.core.tuners.gauss_newton": {*PARTS, "mujoco", "numba", "pybullet", "sapien"},
    "gaplab.workers.supervisor": {*PARTS, "pybullet", "mujoco", "sapien"},
}
"""Libraries by the modules that a process imports first, which leaves them to the few requests that want them."""


@pytest.mark.parametrize("modules", UNUSED)
def test_a_process_starts_without_what_it_may_never_use(modules: str) -> None:
    told = f"import sys, {modules}; print(*sorted({UNUSED[modules]!r} & sys.modules.keys()))"

    loaded = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True).stdout

    assert loaded.split() == []


def test_it_is_found_beside_a_checkout_that_is_called_gaplab(tmp_path: Path) -> None:
    """Python looks there first, and a folder without `__init__.py` is a package unless there is another."""
    (tmp_path / "gaplab").symlink_to(Path(__file__).parents[2])

    program = "from gaplab import Client; print(Client.__module__)"
    found = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)

    assert found.stdout == "gaplab.api.clients.client\n"
