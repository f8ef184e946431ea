"""Ray: started on this machine in a private folder, or joined as an existing cluster, and watched.

The watch has a thread of its own, because a call to a Ray that died or stands still may not return.
"""

import logging
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Event, Thread
from time import monotonic, time
from types import ModuleType
from typing import Any

import ray
from ray._private import parameter, ray_constants
from ray.exceptions import RayError

from gaplab.arithmetic import chosen
from gaplab.services.settings import Settings
from gaplab.workers.errors import ClusterUnusable, RayGone
from gaplab.workers.expected import Versions, versions
from gaplab.workers.nodes import check_nodes

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None  # type: ignore[assignment]

PREFIX = "gaplab-ray-"

LONGEST_PARENT = 22
"""Characters of the parent's path: the path of a socket has at most 107, and Ray and the folders' names take 85.

Source: man 7 unix.
"""

STARTING_S = 60.0
"""Age before which a folder without a holder may be one that is just being made."""


@contextmanager
def ray_folder(wanted: Path | None = None) -> Iterator[Path]:
    """Yield a place for Ray in a new folder that only this user can enter, and remove both when the context ends.

    It is in the `wanted` one; left out: in RAY_TMPDIR, or the folder for temporary files. Ray lets all users of the
    machine write into the place itself, and so connect to its sockets. Folders of processes that were killed are
    removed at the next start.

    Raises:
        ClusterUnusable: this user cannot make one there.
    """
    try:
        parent = wanted or Path(os.environ.get("RAY_TMPDIR") or tempfile.gettempdir()).absolute()
        if len(str(parent)) > LONGEST_PARENT:  # too long for the sockets
            parent = Path("/tmp")  # noqa: S108 - the folder in it is private
        _sweep(parent)
        folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=parent))  # with mode 0700
    except OSError as error:
        msg = f"Ray needs a folder for its files; let RAY_TMPDIR name a short one that you may write: {error}"
        raise ClusterUnusable(msg) from error
    held = _hold(folder)
    try:
        yield folder / "r"
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if held is not None:
            os.close(held)


def _sweep(parent: Path) -> None:
    """Remove the folders of this user whose process has ended."""
    for folder in parent.glob(f"{PREFIX}*"):
        with suppress(OSError):
            found = folder.lstat()
            if found.st_uid != os.geteuid() or time() - found.st_mtime < STARTING_S:
                continue
            if (held := _hold(folder)) is not None:
                shutil.rmtree(folder, ignore_errors=True)
                os.close(held)


def _hold(folder: Path) -> int | None:
    """Lock the folder for as long as this process lives, and return the descriptor; None if another holds it."""
    if fcntl is None:
        return None
    descriptor = os.open(folder / "lock", os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o600)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        return None
    return descriptor


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


OBJECT_STORE_BYTES = 100 * 2**20
"""Steps are small: nothing here needs a large object store."""


@dataclass(frozen=True)
class Cluster:
    """A Ray that was started or joined.

    Attributes:
        workers: largest number of repetitions at once; None for two for each core.
        versions: versions that a process must have to run a repetition. Even a Ray on this machine starts processes
            later, and files may be edited meanwhile.
        watch: watch on Ray.
    """

    workers: int | None
    versions: Versions
    watch: RayWatch

    def capacity(self) -> int:
        """Return the number of repetitions to submit to Ray at once; it changes as nodes join or leave.

        There are two for each core: while one runs, the next one waits in Ray, so no core idles between them. There are
        two without any core: a demand that an autoscaler sees.

        Raises:
            RayGone: this process can run nothing any more.
        """
        cores = self.watch.cores()
        return self.workers or 2 * max(1, cores)


@contextmanager
def cluster(settings: Settings) -> Iterator[Cluster]:
    """Open a connection to Ray for as long as the context lasts.

    A Ray that this process starts listens on loopback only, has no dashboard, keeps its files in a private folder, and
    ends with the process.

    Args:
        settings: `ray_address` names an existing cluster; `workers` limits the cores of a Ray of our own, and how many
            repetitions run at once on a cluster.

    Raises:
        ClusterUnusable: Ray does not start, the cluster cannot be joined, a node has other versions, or authentication
            is switched off.
    """
    logging.getLogger("ray").setLevel(logging.ERROR)
    with _joined(settings.ray_address) if settings.ray_address else _started(settings.workers):
        watch = RayWatch(own=settings.ray_address is None)
        try:
            yield Cluster(settings.workers if settings.ray_address else None, versions(), watch)
        finally:
            watch.stop()


@contextmanager
def _started(cores: int | None) -> Iterator[None]:
    with ray_folder() as folder:
        try:
            _start(cores, folder)
            yield
        except RayGone:
            kill_ray()  # a shutdown would wait for what does not answer
            raise
        except BaseException:
            ray.shutdown()
            raise
        ray.shutdown()


@contextmanager
def _joined(address: str) -> Iterator[None]:
    try:
        _join(address)
        yield
    finally:
        ray.shutdown()


def _start(cores: int | None, folder: Path) -> None:
    if os.environ.get("RAY_AUTH_MODE") == "disabled":  # Ray reads it when it is imported
        msg = "RAY_AUTH_MODE is 'disabled': anyone who reaches a Ray without a token can run any code; unset it"
        raise ClusterUnusable(msg)
    without_monitors = partial(parameter.RayParams, no_monitor=True, include_log_monitor="")
    with _replaced(ray_constants, ENABLE_RAY_CLUSTER=False), _replaced(parameter, RayParams=without_monitors):
        try:
            ray.init(
                address="local",  # not another Ray on this machine
                num_cpus=cores,
                include_dashboard=False,
                log_to_driver=False,
                configure_logging=False,
                object_store_memory=OBJECT_STORE_BYTES,
                _node_ip_address="127.0.0.1",
                _temp_dir=str(folder),
            )
        except Exception as error:  # Ray raises it bare where a part of it does not start in time
            raise ClusterUnusable(f"Ray did not start on this machine: {error}") from error


@contextmanager
def _replaced(module: ModuleType, **values: object) -> Iterator[None]:
    """Give variables of a module of Ray other values within the context, where Ray has no setting for them.

    On Linux, Ray replaces 127.0.0.1 by an address that other machines reach, and listens there. The only setting
    against that is RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER, which Ray reads into ENABLE_RAY_CLUSTER when it is imported.

    The monitors of its autoscaler and of its logs have nothing to do here: no node is added, and no log is shown.
    `ray start` has options for both; `ray.init` passes none on to the class RayParams.
    """
    before = {name: getattr(module, name) for name in values}
    vars(module).update(values)
    try:
        yield
    finally:
        vars(module).update(before)


def _join(address: str) -> None:
    try:
        ray.init(address=address, log_to_driver=False, configure_logging=False, runtime_env={"env_vars": chosen()})
    except (ConnectionError, ValueError, RuntimeError, RayError) as error:  # away; no node here; versions; token
        msg = f"the Ray cluster at {address} cannot be joined (docs/scale.md says how): {error}"
        raise ClusterUnusable(msg) from error
    check_nodes()
