"""What the nodes of a cluster must have in common, so that a repetition has the same numbers on each of them."""

import platform
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import ray
from ray.exceptions import RayError
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from services.core.errors import ClusterUnusable
from services.engines import engines

CODE = ("schemas", "services", "workers")
LIBRARIES = ("numpy", "scipy", "cma")
ANSWER_S = 60.0
"""How long a node may take to start a process and to say what it has."""

Versions = dict[str, str]


@cache
def versions() -> Versions:
    """What numbers depend on, as it is here: this code, Python, the libraries, the engines, the kind of processor."""
    needed = (*LIBRARIES, *(each.library for each in engines.values() if each.library))
    return {
        "gaplab": f"{_version('gaplab')} ({_digest()})",
        "Python": platform.python_version(),
        "machine": platform.machine(),
        **{name: _version(name) for name in needed},
    }


def check_here(expected: Versions) -> None:
    """Do nothing if this process has what the supervisor has.

    Raises:
        ClusterUnusable: it has not; the message says what.
    """
    _compare(platform.node(), versions(), expected)


def check_nodes() -> None:
    """Do nothing if every node of the cluster has what this process has.

    Raises:
        ClusterUnusable: one has not, or it does not have gaplab at all.
    """
    alive = [node for node in ray.nodes() if node["Alive"]]
    only = [NodeAffinitySchedulingStrategy(node["NodeID"], soft=False) for node in alive]
    answers = [_versions_of_node.options(scheduling_strategy=each).remote() for each in only]
    for answer, node in zip(answers, alive, strict=True):
        name = f"{node['NodeManagerHostname']} ({node['NodeManagerAddress']})"
        try:
            found = ray.get(answer, timeout=ANSWER_S)
        except RayError as error:
            msg = f"the node {name} cannot run gaplab, which every node needs: {_last_line(error)}"
            raise ClusterUnusable(msg) from error
        _compare(name, found, versions())


@ray.remote(num_cpus=0, max_retries=0)
def _versions_of_node() -> Versions:
    return versions()


def _compare(node: str, found: Versions, expected: Versions) -> None:
    wrong = [name for name in expected if found.get(name) != expected[name]]
    if wrong:
        theirs, ours = (", ".join(f"{name} {has.get(name, 'none')}" for name in wrong) for has in (found, expected))
        msg = f"the node {node} has {theirs} where the supervisor has {ours}: install the same on all nodes"
        raise ClusterUnusable(msg)


def _version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return "none"


def _digest() -> str:
    """Eight letters that change with the code: a version alone does not say which commit is checked out."""
    root, digest = Path(__file__).parents[1], sha256()
    for path in sorted(path for top in CODE for path in (root / top).rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:8]


def _last_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__
