"""Versions of this process that numbers depend on: code, Python, libraries, engines, kind of processor."""

import platform
import subprocess
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from pathlib import Path
from typing import Any

from gaplab.arithmetic import chosen
from gaplab.schemas.provenance import Provenance
from gaplab.schemas.resolved import SPEC_VERSION
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.plugins.external import external_plugins, named_in
from gaplab.services.plugins.loading import here

CODE = ("schemas", "services", "workers")
LIBRARIES = ("numpy", "scipy", "cma", "numba")
DISTRIBUTIONS = {"mujoco": ("mujoco-core", "mujoco")}
"""Distributions that may provide a module, if its own name is not the only one."""

ROOT = Path(__file__).parents[2]
CLONE = ROOT.parents[1]
"""Folder of the repository, unless this code was installed elsewhere."""

GIT_S = 5.0
"""Longest wait for git to name the commit; large folders on slow disks take a second."""

Versions = dict[str, str]


@cache
def versions() -> Versions:
    """Return what two processes must share to compute the same numbers, except for external plug-ins."""
    return {
        "gaplab": f"{_version('gaplab')} ({_digest()})",
        "Python": platform.python_version(),
        "machine": platform.machine(),
        **{name: _version(name) for name in LIBRARIES},
        **{each.library: _version(each.library) for each in engines.own.values() if each.library},
    }


def provenance() -> Provenance:
    """Return what this process computes with, for readers of its results."""
    loaded, outside = here(), dict(external_plugins())
    return _software().model_copy(
        update={
            "engines": {name: _engine(name, outside) for name in sorted(engines)},
            "plugins": dict(loaded.contents.digests) if loaded else {},
            "outside": outside,
        }
    )


def plugin_versions() -> Versions:
    """Return the version of each external plug-in of this process, by its kind and name, as in `"robot hexapod"`."""
    outside = external_plugins()
    return _with_libraries(outside, {name: _engine(name, outside) for name in engines})


def named_versions(under: Provenance, spec: Mapping[str, Any]) -> Versions:
    """Return the versions that a provenance has of the external plug-ins that a spec names."""
    found = _with_libraries(under.outside, under.engines)
    return {plugin: found[plugin] for plugin in named_in(spec) if plugin in found}


def _with_libraries(outside: Mapping[str, str], texts: Mapping[str, str]) -> Versions:
    """Return the files of external plug-ins, those of an engine with its library."""
    return {plugin: texts.get(plugin.removeprefix(f"{engines.kind} "), text) for plugin, text in outside.items()}


@cache
def _software() -> Provenance:
    return Provenance(
        gaplab=_version("gaplab"),
        code=_digest(),
        commit=_git("rev-parse", "HEAD"),
        dirty=None if (changed := _git("status", "--porcelain", "--untracked-files=no")) is None else bool(changed),
        python=platform.python_version(),
        libraries={name: _version(name) for name in LIBRARIES} | chosen(),
        engines={},
        architecture=platform.machine(),
        processor=_processor(),
        system=platform.platform(),
        spec_version=SPEC_VERSION,
    )


def _engine(name: str, outside: Mapping[str, str]) -> str:
    """Return a text that changes when the engine's numbers may: its files if it is external, and its library."""
    found = filter(None, (outside.get(f"{engines.kind} {name}"), _library(engines[name])))
    return ", ".join(found) or "of gaplab's own"


def _library(engine: type[Engine]) -> str | None:
    return f"{engine.library} {_version(engine.library)}" if engine.library else None


@cache
def _version(module: str) -> str:
    for name in DISTRIBUTIONS.get(module, (module,)):
        with suppress(PackageNotFoundError):
            return version(name)
    return " ".join(sorted({version(name) for name in _distributions().get(module, ())})) or "none"


_distributions = cache(packages_distributions)
"""The distributions of each module, whose name may differ from its own; finding them takes a quarter of a second."""


@cache
def _digest() -> str:
    """Return a hash of the code, eight letters; the version alone does not identify the checked-out commit."""
    digest = sha256()
    for path in sorted(path for top in CODE for path in (ROOT / top).rglob("*.py")):
        digest.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:8]


def _git(*command: str) -> str | None:
    """Return git's answer about this code; None without git, or if the folder is not the top of a repository."""
    if not (CLONE / ".git").exists():
        return None
    try:
        run = subprocess.run(  # noqa: S603 - commands of ours
            ["git", "-C", str(CLONE), *command],  # noqa: S607 - whichever git there is
            capture_output=True,
            text=True,
            timeout=GIT_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return run.stdout.strip() if run.returncode == 0 else None


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown"
