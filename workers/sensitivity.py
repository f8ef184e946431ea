"""Sensitivity checks at Ray: one at a time, beside the repetitions."""

import logging
from time import monotonic

import ray
from ray import ObjectRef
from ray.exceptions import RayError, RayTaskError

from gaplab.schemas.sensitivity import Checked, Sensitivity
from gaplab.services.core.errors import ClusterUnusable, PluginDiffers
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.sensitivity import Effort
from gaplab.services.core.sensitivity import check as check_tunables
from gaplab.services.running import sensitivity
from gaplab.services.running.execution import STALE_AFTER_S
from gaplab.services.running.sensitivity import CheckClaim
from gaplab.services.specs.assembly import subject
from gaplab.services.store.session import Store
from gaplab.workers.nodes import Versions, check_here
from gaplab.workers.plugins import Plugins

LOOK_S = 0.2
"""Shortest time between two looks for a queued check."""

log = logging.getLogger("gaplab.supervisor")


@ray.remote(num_cpus=0, max_retries=0)
def check(checked: Checked, expected: Versions) -> tuple[Sensitivity, ...]:
    """Return the effect of each tunable on fitness.

    The task reserves no core: it takes seconds, and its result is useful before hours of physics, not after them.

    Raises:
        ClusterUnusable: this node lacks the expected versions.
        PluginDiffers: this process lacks the expected versions of plug-ins.
    """
    check_here(expected)
    return check_tunables(subject(checked), SteadyState(), Effort(checked.points, checked.evaluations))


class Checks:
    """The sensitivity checks of one supervisor.

    Args:
        store: the database.
        owner: the supervisor's name in it.
        lease_s: silence after which the holder of a check loses it to others.
        versions: that a node must have to run them.

    All methods raise StoreUnavailable; nothing is lost by it.
    """

    def __init__(
        self, store: Store, owner: str, lease_s: float = STALE_AFTER_S, versions: Versions | None = None
    ) -> None:
        self._store = store
        self._owner = owner
        self._lease_s = lease_s
        self._plugins = Plugins(versions)
        self._run: tuple[CheckClaim, ObjectRef[tuple[Sensitivity, ...]]] | None = None
        self._looked = -LOOK_S

    def step(self) -> None:
        """Store the check that has ended, or start one that is queued.

        Raises:
            ClusterUnusable: the node that ran it has other versions; nothing of it is stored.
        """
        if self._run is not None:
            self._end(*self._run)
        elif monotonic() - self._looked >= LOOK_S:
            self._looked = monotonic()
            self._claim()

    def heartbeat(self) -> None:
        """Prolong the claim on the running check, or stop the check if it no longer holds; requeue lost checks."""
        if self._run is not None and not sensitivity.heartbeat(self._store, [self._run[0]]):
            ray.cancel(self._run[1], force=True)
            self._run = None
        sensitivity.requeue_lost(self._store, stale_after_s=self._lease_s)

    def hand_back(self) -> None:
        """Hand the unfinished check back to other supervisors."""
        if self._run is not None:
            sensitivity.hand_back(self._store, self._run[0])
            self._run = None

    def _claim(self) -> None:
        _, refused = self._plugins.present()
        if (claim := sensitivity.claim(self._store, self._owner, refused)) is not None:
            self._run = claim, check.remote(claim.spec, self._plugins.expected(claim.spec))

    def _end(self, claim: CheckClaim, result: "ObjectRef[tuple[Sensitivity, ...]]") -> None:
        if not ray.wait([result], timeout=0)[0]:
            return
        try:
            tunables: tuple[Sensitivity, ...] = ray.get(result)
            sensitivity.complete(self._store, claim, tunables)
        except RayTaskError as error:
            if isinstance(error.cause, ClusterUnusable):
                raise error.cause from error
            self._over(claim, error.cause)
        except RayError as error:
            sensitivity.release(self._store, claim, f"the worker was lost: {type(error).__name__}")
            log.warning("sensitivity check %s: queued again: %s", claim.id, type(error).__name__)
        self._run = None

    def _over(self, claim: CheckClaim, cause: BaseException) -> None:
        """Fail the check because its code raised, or hand it back because its process has other plug-ins."""
        if isinstance(cause, PluginDiffers):
            self._plugins.refuse(cause)
            sensitivity.hand_back(self._store, claim)
            log.warning("sensitivity check %s: queued again, for a process has other plug-ins: %s", claim.id, cause)
        else:
            sensitivity.fail(self._store, claim, f"{type(cause).__name__}: {cause}")
            log.error("sensitivity check %s: failed: %s", claim.id, cause)
