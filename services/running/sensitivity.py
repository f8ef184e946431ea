"""Sensitivity checks: submitted and looked at through the API, claimed and ended by supervisors.

Each function is one transaction, and raises StoreUnavailable while the database cannot be used. A claim is a lease as
in `gaplab.services.running.execution`: False tells its holder to drop the check.
"""

from collections.abc import Sequence
from datetime import timedelta

from gaplab.schemas.sensitivity import Checked, Sensitivity, SensitivityRead, SensitivitySpec
from gaplab.services.core.sensitivity import Effort
from gaplab.services.experiments.limits import FREELY, Admission, Once, once
from gaplab.services.running.execution import STALE_AFTER_S
from gaplab.services.running.versions import outside
from gaplab.services.specs.resolution import resolve_sensitivity, unit
from gaplab.services.store.lease import CheckClaim as CheckClaim
from gaplab.services.store.models import SensitivityRow
from gaplab.services.store.queries import sensitivity
from gaplab.services.store.session import Store


def submit(store: Store, spec: SensitivitySpec) -> SensitivityRead:
    """The check of these settings: QUEUED, unless it is there already and has not FAILED.

    Raises:
        InvalidSpec: with everything that is wrong with them.
    """
    return admit(store, spec, FREELY).answer


def admit(store: Store, spec: SensitivitySpec, admitted: Admission) -> Once[SensitivityRead]:
    """Submit the check, once for each idempotency key.

    Raises:
        InvalidSpec: with everything that is wrong with them.
        KeyReused: the key stands for another request.
    """
    checked = resolve_sensitivity(spec)
    return once(
        store, admitted, spec, SensitivityRead, lambda session: _read(sensitivity.queue(session, checked, outside()))
    )


def read(store: Store, id: str) -> SensitivityRead:  # noqa: A002 - as the API says
    """The check, with what it found once it is COMPLETED.

    Raises:
        NotFound: no such check.
    """
    with store.reading() as session:
        return _read(sensitivity.get(session, id))


def claim(store: Store, owner: str) -> CheckClaim | None:
    """The oldest queued check, for the owner to run; None if there is none."""
    return store.write(lambda session: sensitivity.claim(session, owner))


def heartbeat(store: Store, claim: CheckClaim) -> bool:
    """The claim holds on from now; False if it holds no more."""
    return store.write(lambda session: sensitivity.heartbeat(session, claim))


def complete(store: Store, claim: CheckClaim, found: Sequence[Sensitivity]) -> bool:
    """The check is COMPLETED; False if the claim holds no more."""
    return store.write(lambda session: sensitivity.complete(session, claim, found))


def fail(store: Store, claim: CheckClaim, reason: str) -> bool:
    """The check is FAILED, and no experiment with it; False if the claim holds no more."""
    return store.write(lambda session: sensitivity.fail(session, claim, reason))


def release(store: Store, claim: CheckClaim, reason: str) -> bool:
    """The worker was lost: the check is QUEUED again, or FAILED at the fifth time; False if the claim holds no more."""
    return store.write(lambda session: sensitivity.release(session, claim, reason))


def hand_back(store: Store, claim: CheckClaim) -> bool:
    """The holder stops in good order: the check is QUEUED again; False if the claim holds no more."""
    return store.write(lambda session: sensitivity.hand_back(session, claim))


def requeue_lost(store: Store, *, stale_after_s: float = STALE_AFTER_S) -> int:
    """QUEUE again checks whose holder was not heard of for so long; how many there were."""
    return store.write(lambda session: sensitivity.requeue_lost(session, timedelta(seconds=stale_after_s)))


def _read(row: SensitivityRow) -> SensitivityRead:
    spec = Checked.model_validate(row.spec)
    return SensitivityRead(
        id=row.id,
        state=row.state,
        spec=spec,
        rollouts=Effort(spec.points, spec.evaluations).rollouts(len(spec.tunables)),
        unit=unit(spec),
        tunables=sensitivity.findings(row),
        warnings=sensitivity.warnings(row),
        reason=row.error,
        created_at=row.created_at,
        started_at=row.started_at,
        ended_at=row.ended_at,
    )
