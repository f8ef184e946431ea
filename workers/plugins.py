"""External plug-ins of claimed work: the versions that a process must have, and those that processes refused."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.sensitivity import Checked
from gaplab.services.plugins.folders import PluginDiffers
from gaplab.services.running import execution
from gaplab.services.running.provenance import tell_refused
from gaplab.services.running.versions import provenance
from gaplab.services.store.lease import Claim
from gaplab.services.store.session import Store
from gaplab.workers.expected import Versions, with_plugins

FIRST_S = 30.0
"""First wait before a refused plug-in is tried again; the wait doubles with each refusal."""

LONGEST_S = 600.0

log = logging.getLogger("gaplab.supervisor")


@dataclass(frozen=True)
class _Refusal:
    why: str
    wait_s: float
    until: float


class Plugins:
    """The external plug-ins of a supervisor, and those that processes refused because they have other versions.

    Experiments that name a refused one wait. A later try may find another process, or the file repaired. `shared` are
    the versions of gaplab and its libraries that a process must have.

    Attributes:
        under: what this supervisor computes with.
    """

    def __init__(self, shared: Versions | None = None, clock: Callable[[], float] = monotonic) -> None:
        self.under = provenance()
        self._shared = shared or {}
        self._clock = clock
        self._refusals: dict[str, _Refusal] = {}

    def refused(self) -> dict[str, str]:
        """Return why plug-ins are refused now, by kind and name."""
        now = self._clock()
        return {plugin: refusal.why for plugin, refusal in self._refusals.items() if now < refusal.until}

    def expected(self, spec: ResolvedSpec | Checked) -> Versions:
        """Return the versions that a process must have to compute a spec."""
        return with_plugins(self._shared, self.under, spec.model_dump(mode="json"))

    def refuse(self, refused: PluginDiffers) -> None:
        """Remember what a process refused."""
        for plugin, why in refused.differences.items():
            before = self._refusals.get(plugin)
            wait_s = min(2 * before.wait_s, LONGEST_S) if before else FIRST_S
            self._refusals[plugin] = _Refusal(why, wait_s, self._clock() + wait_s)

    def hand_back(self, store: Store, claim: Claim, refused: PluginDiffers) -> None:
        """Hand back a repetition that a process refused, and let its experiment tell why it waits.

        Raises:
            StoreUnavailable: the database cannot be used now.
        """
        self.refuse(refused)
        execution.hand_back(store, claim)
        tell_refused(store, claim.experiment_id, self.under, self.refused())
        place = {"experiment": claim.experiment_id, "repetition": claim.number}
        log.warning("queued again, for a process has other plug-ins: %s", refused, extra=place)
