"""A watch on Ray, from a thread of its own: a call to a Ray that died or stands still may not return."""

from collections.abc import Callable
from contextlib import suppress
from threading import Event, Thread
from time import monotonic
from typing import Any

import ray
from ray._private import ray_constants

from gaplab.services.core.errors import RayGone

LOOK_S = 1.0
"""Interval between two questions to Ray."""

SILENT_S = 15.0
"""Time without an answer after which Ray counts as dead; a busy machine answers within a second or two."""

_VITAL = {ray_constants.PROCESS_TYPE_GCS_SERVER, ray_constants.PROCESS_TYPE_RAYLET}
"""The processes of Ray without which nothing runs."""


class RayWatch:
    """What Ray says of its nodes, and whether it still says it.

    Args:
        own: whether this process started Ray, so that its parts are processes of ours.
        clock: returns seconds that never go back.
    """

    def __init__(self, *, own: bool, clock: Callable[[], float] = monotonic) -> None:
        self._own = own
        self._clock = clock
        self._here = ray.get_runtime_context().get_node_id()
        self._stopping = Event()
        self._ask()
        self._thread = Thread(target=self._keep_asking, name="watch on Ray", daemon=True)
        self._thread.start()

    def cores(self) -> int:
        """Return the number of cores of all nodes, as of a moment ago.

        Raises:
            RayGone: a part of Ray died on this machine, or Ray does not answer; only a new process gets another.
        """
        if self._own and (dead := [kind for kind, _ in _node().dead_processes() if kind in _VITAL]):
            raise RayGone(f"Ray died on this machine: its {' and '.join(dead)} ended")
        if not self._is_alive:
            raise RayGone("Ray died on this machine")
        if (silence_s := self._clock() - self._answered) > SILENT_S:
            raise RayGone(f"Ray does not answer: it was last heard of {silence_s:.0f} s ago")
        return self._cores

    def stop(self) -> None:
        """End the watch."""
        self._stopping.set()
        self._thread.join(LOOK_S)  # no longer: a question to a dead Ray never ends

    def _keep_asking(self) -> None:
        while not self._stopping.wait(LOOK_S):
            with suppress(Exception):  # whatever a dying Ray raises: no answer
                self._ask()

    def _ask(self) -> None:
        nodes: list[dict[str, Any]] = ray.nodes()
        alive = [node for node in nodes if node["Alive"]]
        self._is_alive = not any(node["NodeID"] == self._here for node in nodes if not node["Alive"])
        self._cores = int(sum(node["Resources"].get("CPU", 0) for node in alive))
        self._answered = self._clock()


def kill_ray() -> None:
    """End the processes of a Ray that this process started and that cannot end itself any more."""
    for _, process in _node().live_processes():
        with suppress(OSError):
            process.kill()


def _node() -> Any:  # noqa: ANN401 - no public type
    return ray._private.worker._global_node
