"""Versions of this process that numbers depend on: code, Python, libraries, engines, kind of processor."""

import platform
import subprocess
from collections.abc import Mapping
from contextlib import suppress
from functools import cache, lru_cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from pathlib import Path
from typing import Any

from gaplab.arithmetic import chosen
from gaplab.schemas.provenance import Provenance
from gaplab.schemas.resolved import SPEC_VERSION
from gaplab.services.core.external_plugins import file_of
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.plugins.contents import Contents
from gaplab.services.plugins.external import external_plugins, named_in
from gaplab.services.plugins.watching import present

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
        **{each.library: _version(each.library) for each in engines.values() if each.library and not file_of(each)},
    }


def provenance() -> Provenance:
    """Return what this process computes with, for readers of its results; its plug-ins are those of now."""
    return _provenance(present())


def plugin_versions(contents: Contents) -> Versions:
    """Return the version of each external plug-in of this process, by its kind and name, as in `"robot hexapod"`."""
    libraries = {f"{engines.kind} {name}": _library(each) for name, each in engines.items()}
    found = external_plugins(contents)
    return {plugin: ", ".join(filter(None, (text, libraries.get(plugin)))) for plugin, text in found.items()}


def versions_of(under: Provenance) -> Versions:
    """Return the version that a provenance has of each external plug-in, as `plugin_versions` does."""
    libraries = {f"{engines.kind} {name}": text for name, text in under.engines.items()}
    return {plugin: libraries.get(plugin, text) for plugin, text in under.outside.items()}


def named_versions(under: Provenance, spec: Mapping[str, Any]) -> Versions:
    """Return the versions that a provenance has of the external plug-ins that a spec names."""
    found = versions_of(under)
    return {plugin: found[plugin] for plugin in named_in(spec) if plugin in found}


@lru_cache(maxsize=2)
def _provenance(contents: Contents) -> Provenance:
    return _software().model_copy(
        update={
            "engines": {name: _engine(each, contents) for name, each in sorted(engines.items())},
            "plugins": dict(contents.digests),
            "outside": dict(external_plugins(contents)),
        }
    )


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


def _engine(engine: type[Engine], contents: Contents) -> str:
    """Return a text that changes when the engine's numbers may."""
    if (file := file_of(engine)) is not None:
        return ", ".join(filter(None, (contents.text_of(file) or "none", _library(engine))))
    return _library(engine) or "of gaplab's own"


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
