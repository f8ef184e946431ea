"""Versions that all nodes of a cluster must share, so that a repetition has the same numbers on each of them."""

import platform

import ray
from ray.exceptions import RayError
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from gaplab.services.core.errors import ClusterUnusable, PluginBroken
from gaplab.services.plugins import folders
from gaplab.services.running.versions import Versions as Versions
from gaplab.services.running.versions import versions as versions

ANSWER_S = 60.0
"""Longest wait for a node to start a process and name its versions."""


def check_here(expected: Versions) -> None:
    """Check that this process has the supervisor's versions.

    Raises:
        ClusterUnusable: it lacks them, or an external plug-in is broken here; the message says which.
    """
    try:
        found = _versions_here()
    except PluginBroken as error:
        msg = f"the node {platform.node()} cannot use a plug-in that the supervisor has: {error}"
        raise ClusterUnusable(msg) from error
    _compare(platform.node(), found, expected)


def check_nodes() -> None:
    """Check that every node of the cluster has this process's versions.

    Raises:
        ClusterUnusable: one has other versions, or no gaplab at all.
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
    return _versions_here()


def _versions_here() -> Versions:
    """Return the versions of this process, after finding its plug-ins, which Ray's processes have not done yet."""
    folders.find()
    return versions()


def _compare(node: str, found: Versions, expected: Versions) -> None:
    wrong = [name for name in expected if found.get(name) != expected[name]]
    if wrong:
        theirs, ours = (", ".join(f"{name} {has.get(name, 'none')}" for name in wrong) for has in (found, expected))
        msg = (
            f"the node {node} has {theirs} where the supervisor has {ours}: install the same on all nodes, "
            "or start the supervisor again if files were changed since it started"
        )
        raise ClusterUnusable(msg)


def _last_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__
