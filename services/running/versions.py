"""Versions of this process that numbers depend on: code, Python, libraries, engines, kind of processor."""

import platform
import subprocess
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from pathlib import Path

from gaplab.schemas.provenance import Provenance
from gaplab.services.core.external_plugins import file_of
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.plugins.external import external_plugins
from gaplab.services.plugins.folders import digest, digest_of, digests
from gaplab.services.store.models import SPEC_VERSION

CODE = ("schemas", "services", "workers")
LIBRARIES = ("numpy", "scipy", "cma", "numba")
DISTRIBUTIONS = {"mujoco": ("mujoco-core", "mujoco")}
"""Distributions that may provide a module, if its own name is not the only one."""

ROOT = Path(__file__).parents[2]
GIT_S = 5.0
"""Longest wait for git to name the commit; large folders on slow disks take a second."""

Versions = dict[str, str]


@cache
def versions() -> Versions:
    """Return the versions that two processes must share to compute the same numbers."""
    return {
        "gaplab": f"{_version('gaplab')} ({_digest()})",
        "Python": platform.python_version(),
        "machine": platform.machine(),
        "plug-ins": digest(),
        **{name: _version(name) for name in LIBRARIES},
        **{each.library: _version(each.library) for each in engines.values() if each.library},
    }


@cache
def provenance() -> Provenance:
    """Return the software and the machine of this process, for readers of its results."""
    return Provenance(
        gaplab=_version("gaplab"),
        code=_digest(),
        commit=_git("rev-parse", "HEAD"),
        dirty=None if (changed := _git("status", "--porcelain", "--untracked-files=no")) is None else bool(changed),
        python=platform.python_version(),
        libraries={name: _version(name) for name in LIBRARIES},
        engines={name: _engine(each) for name, each in sorted(engines.items())},
        architecture=platform.machine(),
        processor=_processor(),
        system=platform.platform(),
        spec_version=SPEC_VERSION,
        plugins=digests(),
        outside=external_plugins(),
    )


def _engine(engine: type[Engine]) -> str:
    """Return a text that changes whenever the engine's numbers may change."""
    library = f"{engine.library} {_version(engine.library)}" if engine.library else None
    if (file := file_of(engine)) is not None:
        return f"{file} {digest_of(file)}" + (f", {library}" if library else "")
    return library or "of gaplab's own"


@cache
def _version(module: str) -> str:
    for name in DISTRIBUTIONS.get(module, (module,)):
        with suppress(PackageNotFoundError):
            return version(name)
    return " ".join(sorted({version(name) for name in _distributions().get(module, ())})) or "none"


@cache
def _distributions() -> Mapping[str, list[str]]:
    """Return the distributions of each module, whose name may differ from its own; this takes a quarter of a second."""
    return packages_distributions()


@cache
def _digest() -> str:
    """Return a hash of the code, eight letters; the version alone does not identify the checked-out commit."""
    digest = sha256()
    for path in sorted(path for top in CODE for path in (ROOT / top).rglob("*.py")):
        digest.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:8]


def _git(*command: str) -> str | None:
    """Return git's answer about this code; None without git, or if the folder is not the top of a repository."""
    if not (ROOT.parent / ".git").exists():
        return None
    try:
        run = subprocess.run(  # noqa: S603 - commands of ours
            ["git", "-C", str(ROOT.parent), *command],  # noqa: S607 - whichever git there is
            capture_output=True,
            text=True,
            timeout=GIT_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return run.stdout.strip() if run.returncode == 0 else None


def _processor() -> str:
    """Return the kind of the processor, as Linux names it; elsewhere, as Python does."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown"
