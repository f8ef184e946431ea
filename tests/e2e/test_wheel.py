"""The wheel, as people install it: in an environment of its own, in a folder whose names are the project's."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from zipfile import ZipFile

import httpx2
import pytest

from tests.ports import free_port
from tests.waiting import wait_until

pytestmark = pytest.mark.release

ROOT = Path(__file__).parents[2]
PARTS = ("api", "migrations", "schemas", "services", "src", "workers", "pyproject.toml", "README.md", "LICENSE")
SPEC = {"strategy": "random", "robot": "toy_function", "budget": "smoke", "iterations": 1, "repetitions": 1}
CLASH = "raise ImportError('a module of the folder in which gaplab runs')\n"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from a copy: what a build leaves in its folder would be part of the next one."""
    place = tmp_path_factory.mktemp("wheel")
    source = place / "source"
    source.mkdir()
    for part in PARTS:
        if (ROOT / part).is_dir():
            shutil.copytree(ROOT / part, source / part, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(ROOT / part, source)
    pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(place), str(source))
    (built,) = place.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment that holds the wheel alone, and borrows what it depends on.

    A borrowed folder's own .pth files do not count, so the clone that is installed there stays invisible.
    """
    folder = tmp_path_factory.mktemp("installed") / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    pip("--python", str(folder / "bin" / "python"), "install", "--no-deps", "--no-index", str(wheel))
    (packages,) = folder.glob("lib/python*/site-packages")
    lent = [each for each in sys.path if each.endswith("site-packages")]
    (packages / "lent.pth").write_text("\n".join(lent) + "\n")
    return folder


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A folder with a `schemas.py` and an `api/` of someone else."""
    (tmp_path / "schemas.py").write_text(CLASH)
    (tmp_path / "api").mkdir()
    (tmp_path / "api" / "__init__.py").write_text(CLASH)
    return tmp_path


def pip(*arguments: str) -> None:
    call = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *arguments]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


class User:
    """Somebody who runs what the environment installed, in a folder of their own."""

    def __init__(self, environment: Path, home: Path) -> None:
        self._commands, self._home = environment / "bin", home
        self.url = f"http://127.0.0.1:{free_port()}"
        inherited = {name: value for name, value in os.environ.items() if not name.startswith(("GAPLAB_", "PYTHON"))}
        own = {"GAPLAB_PORT": self.url.rpartition(":")[2], "GAPLAB_URL": self.url, "GAPLAB_WORKERS": "1"}
        self._environment = inherited | own | {"GAPLAB_DATABASE_URL": f"sqlite:///{home / 'gaplab.db'}"}

    def run(self, command: str, *arguments: str) -> str:
        call, where = [self._commands / command, *arguments], {"cwd": self._home, "env": self._environment}
        done = subprocess.run(call, **where, capture_output=True, text=True, timeout=240, check=False)  # type: ignore[call-overload]
        assert done.returncode == 0, done.stdout + done.stderr + self.log()
        return done.stdout

    @contextmanager
    def serving(self) -> Iterator[None]:
        """The service, with its workers."""
        call, where = [self._commands / "gaplab", "serve"], {"cwd": self._home, "env": self._environment}
        with (self._home / "service.log").open("wb") as log:
            service = subprocess.Popen(call, **where, stdout=log, stderr=log)  # type: ignore[call-overload]
        try:
            wait_until(lambda: service.poll() is not None or self._answers(), otherwise=self.log)
            yield
        finally:
            service.terminate()
            code = service.wait(60)
        assert code == 0, self.log()

    def log(self) -> str:
        file = self._home / "service.log"
        return file.read_text() if file.exists() else ""

    def _answers(self) -> bool:
        try:
            return httpx2.get(f"{self.url}/readyz", trust_env=False).status_code == 200
        except httpx2.TransportError:
            return False


@pytest.fixture
def user(environment: Path, home: Path) -> User:
    return User(environment, home)


def test_the_wheel_holds_one_name(wheel: Path) -> None:
    with ZipFile(wheel) as archive:
        names = {name.partition("/")[0] for name in archive.namelist()}

    assert {name for name in names if not name.endswith(".dist-info")} == {"gaplab"}


def test_it_is_found_in_its_environment_and_not_in_the_clone(user: User, environment: Path) -> None:
    found = user.run("python", "-c", "import gaplab.services; print(gaplab.services.__file__)")

    assert Path(found.strip()).is_relative_to(environment)


def test_it_migrates_serves_and_draws_a_figure(user: User, home: Path) -> None:
    (home / "spec.json").write_text(json.dumps(SPEC))

    user.run("python", "-m", "gaplab.migrations")
    with user.serving():
        submitted = json.loads(user.run("gaplab", "submit", "spec.json", "--json"))
        user.run("gaplab", "watch", submitted["id"])
        user.run("gaplab", "figure", "curves", submitted["id"], "-o", "curve.svg")

    assert "<svg" in (home / "curve.svg").read_text()
