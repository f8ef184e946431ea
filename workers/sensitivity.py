"""Sensitivity checks in Ray: one at a time, beside the repetitions."""

import logging
from time import monotonic
from typing import TypeAlias

import ray
from ray import ObjectRef
from ray.exceptions import RayError, RayTaskError

from gaplab.schemas.sensitivity import Checked, Sensitivity
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.findings.sensitivity import Effort
from gaplab.services.findings.sensitivity import check as check_tunables
from gaplab.services.plugins.folders import PluginDiffers
from gaplab.services.running import sensitivity
from gaplab.services.running.leases import STALE_AFTER_S
from gaplab.services.running.sensitivity import CheckClaim
from gaplab.services.specs.assembly import subject
from gaplab.services.specs.blame import describe
from gaplab.services.store.lease import Failure
from gaplab.services.store.session import Store
from gaplab.workers.errors import ClusterUnusable
from gaplab.workers.expected import Versions, check_here
from gaplab.workers.nodes import process_for, told
from gaplab.workers.plugins import Plugins
from gaplab.workers.task import Patience, give_back_memory

LOOK_S = 1.0
"""Shortest interval between checks of the queue."""

Result: TypeAlias = "ObjectRef[tuple[Sensitivity, ...] | Failure]"

log = logging.getLogger("gaplab.supervisor")


@ray.remote(num_cpus=0, max_retries=0)
def check(checked: Checked, expected: Versions) -> tuple[Sensitivity, ...] | Failure:
    """Return the effect of each tunable on fitness, or the reason of a failure.

    The task reserves no core: it takes seconds, and its result is useful before hours of physics, not after them.

    Raises:
        ClusterUnusable: this node lacks the expected versions.
        PluginDiffers: this process lacks those of the plug-ins.
    """
    check_here(expected)
    try:
        return check_tunables(subject(checked), SteadyState(), Effort(checked.points, checked.evaluations))
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a plug-in may raise anything
        return Failure(describe(error))
    finally:
        give_back_memory()


class Checks:
    """The sensitivity checks of one supervisor. All methods raise StoreUnavailable; no result is lost then.

    Nodes must have the versions to run them. After `lease_s` without a heartbeat, others may take a check.
    """

    def __init__(
        self,
        store: Store,
        owner: str,
        lease_s: float = STALE_AFTER_S,
        versions: Versions | None = None,
        patience: Patience | None = None,
    ) -> None:
        self._store = store
        self._owner = owner
        self._lease_s = lease_s
        self._plugins = Plugins(versions)
        self._patience = patience or Patience()
        self._run: tuple[CheckClaim, Result] | None = None
        self._begun = 0.0
        self._looked = -LOOK_S

    def step(self) -> None:
        """Store the result of the running check if it has ended, or start a queued check.

        Raises:
            ClusterUnusable: the check's node has other versions; its result is not stored.
        """
        if self._run is not None:
            self._end(*self._run)
        elif monotonic() - self._looked >= LOOK_S:
            self._looked = monotonic()
            self._claim()

    def heartbeat(self) -> None:
        """Renew the claim on the running check, or stop the check if its claim is invalid; requeue lost checks."""
        if self._run is not None and not sensitivity.heartbeat(self._store, [self._run[0]]):
            ray.cancel(self._run[1], force=True)
            self._run = None
        sensitivity.requeue_lost(self._store, stale_after_s=self._lease_s)

    def hand_back(self) -> None:
        """Hand back the unfinished check."""
        if self._run is not None:
            sensitivity.hand_back(self._store, self._run[0])
            self._run = None

    def _claim(self) -> None:
        if (claim := sensitivity.claim(self._store, self._owner, self._plugins.refused())) is not None:
            expected = self._plugins.expected(claim.spec)
            result = check.options(**process_for(expected)).remote(claim.spec, expected)
            self._run, self._begun = (claim, result), monotonic()

    def _end(self, claim: CheckClaim, result: Result) -> None:
        if not ray.wait([result], timeout=0)[0]:
            self._end_hung(claim, result)
            return
        try:
            found: tuple[Sensitivity, ...] | Failure = ray.get(result)
            if isinstance(found, Failure):
                self._fail(claim, found.reason)
            else:
                sensitivity.complete(self._store, claim, found)
        except RayTaskError as error:
            if isinstance(error.cause, ClusterUnusable):
                raise error.cause from error
            self._over(claim, error)
        except RayError as error:
            sensitivity.release(self._store, claim, f"the worker was lost: {type(error).__name__}")
            log.warning("sensitivity check %s: queued again: %s", claim.id, type(error).__name__)
        self._run = None

    def _end_hung(self, claim: CheckClaim, result: Result) -> None:
        if monotonic() - self._begun > self._patience.check_s:
            ray.cancel(result, force=True)
            self._fail(claim, f"it took more than {self._patience.check_s:g} s; its rollouts hang, or are very slow")
            self._run = None

    def _over(self, claim: CheckClaim, error: RayTaskError) -> None:
        """Hand back a check that its process refused because it has other plug-ins; fail any other."""
        if isinstance(error.cause, PluginDiffers):
            self._plugins.refuse(error.cause)
            sensitivity.hand_back(self._store, claim)
            log.warning("sensitivity check %s: queued again: %s", claim.id, error.cause)
        else:
            self._fail(claim, told(error))

    def _fail(self, claim: CheckClaim, reason: str) -> None:
        sensitivity.fail(self._store, claim, reason)
        log.error("sensitivity check %s: failed: %s", claim.id, reason)
