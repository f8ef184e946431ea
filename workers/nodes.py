"""The nodes of a cluster, each of which must have the versions of this process, and their processes."""

from typing import Any

import ray
from ray.exceptions import RayError, RayTaskError
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from gaplab.services.specs.blame import describe
from gaplab.workers.errors import ClusterUnusable
from gaplab.workers.expected import Versions, compare, plugins_of, versions

ANSWER_S = 60.0
"""Longest wait for a node to start a process and name its versions."""

IMPORTED = "GAPLAB_PLUGINS_IMPORTED"
"""Variable of a process that imports external plug-ins; Ray gives a task only a process with the same variables."""


def process_for(expected: Versions) -> dict[str, Any]:
    """Return Ray's options for a task, and actors that it starts, in processes of these plug-ins and no others."""
    plugins = plugins_of(expected)
    return {"runtime_env": {"env_vars": {IMPORTED: plugins}}} if plugins else {}


def check_nodes() -> None:
    """Check that every node of the cluster has this process's versions of gaplab and its libraries.

    Raises:
        ClusterUnusable: one has other versions, or gaplab is not installed on it.
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
        compare(name, found, versions())


def _versions_here() -> Versions:
    return versions()


_versions_of_node = ray.remote(num_cpus=0, max_retries=0)(_versions_here)  # which Ray sends by its name


def _last_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__


def told(error: RayTaskError) -> str:
    """Return the sentence of an error that a task raised; one that could not be sent is a text already."""
    return describe(error.cause if isinstance(error.cause, Exception) else error)
