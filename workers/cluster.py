"""Ray: started on this machine, or joined as an existing cluster."""

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import ModuleType

import ray
from ray._private import parameter, ray_constants
from ray.exceptions import RayError

from gaplab.arithmetic import chosen
from gaplab.services.core.errors import ClusterUnusable, RayGone
from gaplab.services.settings import Settings
from gaplab.workers.nodes import Versions, check_nodes, versions
from gaplab.workers.output import limit_files
from gaplab.workers.ray_folder import ray_folder
from gaplab.workers.watch import RayWatch, kill_ray

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
    limit_files()
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
