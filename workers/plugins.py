"""External plug-ins of claimed work: the versions that a process must have, and those that processes refused."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from time import monotonic

from gaplab.schemas.provenance import Provenance
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.sensitivity import Checked
from gaplab.services.core.errors import PluginDiffers
from gaplab.services.plugins.watching import reload
from gaplab.services.running import execution
from gaplab.services.running.provenance import tell_refused
from gaplab.services.running.versions import provenance, versions_of
from gaplab.services.store.lease import Claim
from gaplab.services.store.session import Store
from gaplab.workers.nodes import Versions, with_plugins

FIRST_S = 30.0
"""First wait before a refused version of a plug-in is tried again; the wait doubles with each refusal."""

LONGEST_S = 600.0

log = logging.getLogger("gaplab.supervisor")


@dataclass(frozen=True)
class _Refusal:
    why: str
    wait_s: float
    until: float


class Plugins:
    """The external plug-ins of a supervisor, as their files are now, and the versions of them that processes refused.

    Experiments that name a refused version wait. A later try may find another process, or the file repaired. `shared`
    are the versions of gaplab and its libraries that a process must have.
    """

    def __init__(self, shared: Versions | None = None, clock: Callable[[], float] = monotonic) -> None:
        self._shared = shared or {}
        self._clock = clock
        self._under = provenance()
        self._refusals: dict[tuple[str, str], _Refusal] = {}

    def present(self) -> tuple[Provenance, Mapping[str, str]]:
        """Return under what work may be claimed now, and why plug-ins are refused, by kind and name."""
        reload()
        self._under = provenance()
        has, now = versions_of(self._under), self._clock()
        refused = {
            plugin: refusal.why
            for (plugin, version), refusal in self._refusals.items()
            if has.get(plugin) == version and now < refusal.until
        }
        return self._under, refused

    def expected(self, spec: ResolvedSpec | Checked) -> Versions:
        """Return the versions that a process must have to compute a spec, as `present` last found them."""
        return with_plugins(self._shared, self._under, spec.model_dump(mode="json"))

    def refuse(self, refused: PluginDiffers) -> None:
        """Remember the versions that a process refused."""
        for plugin, why in refused.differences.items():
            key = plugin, refused.expected[plugin]
            before = self._refusals.get(key)
            wait_s = min(2 * before.wait_s, LONGEST_S) if before else FIRST_S
            self._refusals[key] = _Refusal(why, wait_s, self._clock() + wait_s)

    def hand_back(self, store: Store, claim: Claim, refused: PluginDiffers) -> None:
        """Hand back a repetition that a process refused, and let its experiment tell why it waits.

        Raises:
            StoreUnavailable: the database cannot be used now.
        """
        self.refuse(refused)
        execution.hand_back(store, claim)
        tell_refused(store, claim.experiment_id, *self.present())
        place = {"experiment": claim.experiment_id, "repetition": claim.number}
        log.warning("queued again, for a process has other plug-ins: %s", refused, extra=place)
