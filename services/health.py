"""Whether queued experiments are run, as far as the database tells."""

from sqlalchemy import select

from gaplab.schemas.lifecycle import State
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import costs
from gaplab.services.store.session import Session, Store, snapshot

RECENTLY_S = 600.0
"""Age of a heartbeat up to which the end of its supervisor is news."""

AGAIN_AND_AGAIN = 3
"""Supervisors that died recently, from which on something is wrong with them."""


def warnings(store: Store, silent_s: float) -> tuple[str, ...]:
    """Return sentences about what fails although the database can be read; none if all is well.

    Args:
        store: the database.
        silent_s: seconds without a heartbeat after which a supervisor counts as lost.

    Raises:
        StoreUnavailable: it cannot be read, or has another schema.
    """
    store.check()
    unwritten = (f"nothing has been written since this failed: {store.unwritten}",) if store.unwritten else ()
    return unwritten + _of_supervisors(store, silent_s)


@snapshot
def _of_supervisors(session: Session, silent_s: float) -> tuple[str, ...]:
    """Return sentences about supervisors that are missing, silent, or die again and again."""
    ages = costs.ages(session)
    found = []
    if ages and min(ages) > silent_s:
        found.append(
            f"no supervisor has been heard of for {min(ages):.0f} s, so nothing runs: read its log, and start it again"
        )
    if not ages and _has_work(session):
        found.append("experiments wait, and no supervisor runs them: start `gaplab serve` or `python -m workers serve`")
    if (dead := sum(silent_s < age < RECENTLY_S for age in ages)) >= AGAIN_AND_AGAIN:
        found.append(f"{dead} supervisors died in the last {RECENTLY_S / 60:.0f} minutes: read their log")
    return tuple(found)


def _has_work(session: Session) -> bool:
    unended = select(ExperimentRow.id).where(ExperimentRow.state.in_((State.QUEUED, State.RUNNING))).limit(1)
    return session.scalar(unended) is not None
