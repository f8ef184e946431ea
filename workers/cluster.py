"""Ray itself: started on this machine, or joined where it runs."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

import ray

from services.settings import Settings

OBJECT_STORE_BYTES = 100 * 2**20
"""Steps are small: nothing here needs a large object store."""


@contextmanager
def cluster(settings: Settings) -> Iterator[int]:
    """A connection to Ray for as long as the context lasts; its value is how many repetitions to give it at once.

    On a Ray of our own, and on a cluster that we may use whole, that is two for each core: while one runs, the next one
    waits at Ray, and no core idles between them.

    A Ray of our own listens on loopback only, has no dashboard, and ends with this process, even if it is killed.

    Args:
        settings: `ray_address` names an existing cluster; `workers` limits the cores.
    """
    if settings.ray_address:
        ray.init(address=settings.ray_address, log_to_driver=False, logging_level=logging.ERROR)
    else:
        ray.init(
            address="local",  # not whatever else may run on this machine
            num_cpus=settings.workers,
            include_dashboard=False,
            log_to_driver=False,
            logging_level=logging.ERROR,
            object_store_memory=OBJECT_STORE_BYTES,
            _node_ip_address="127.0.0.1",
        )
    try:
        limit = settings.workers if settings.ray_address else None
        yield limit or 2 * int(ray.cluster_resources()["CPU"])
    finally:
        ray.shutdown()
