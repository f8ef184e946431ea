"""Running repetitions: claim them, record their steps, end them. For supervisors; each function is one transaction.

A claim is a lease. Its holder sends a heartbeat every 5 to 10 seconds, and is taken for lost after 30. Every write
carries the claim and is refused once the lease has gone on to another, or the experiment was cancelled: False, or
absence from `heartbeat`'s answer, tells the holder to drop the repetition.

What a person asks for is obeyed here, so that no holder can forget it: the first delivery after a pause or a stop is
stored, and is the last of its lease.

All of them raise StoreUnavailable while the database cannot be used; each may then be tried again.
"""

from collections.abc import Iterable
from datetime import timedelta

from gaplab.schemas.provenance import Provenance
from gaplab.services.core.types import Step
from gaplab.services.running.versions import provenance
from gaplab.services.store.lease import Checkpoint as Checkpoint
from gaplab.services.store.lease import Claim as Claim
from gaplab.services.store.lease import Delivered as Delivered
from gaplab.services.store.lease import TimedStep as TimedStep
from gaplab.services.store.queries import giving_way, leases, unheard
from gaplab.services.store.session import Store

STALE_AFTER_S = 30.0


def claim(store: Store, owner: str, limit: int, under: Provenance | None = None) -> tuple[Claim, ...]:
    """Up to `limit` queued repetitions for the owner to run, in the order of turns, each with its log.

    Args:
        store: where they are queued.
        owner: who runs them.
        limit: how many at most.
        under: what they are to be computed with; this process's own if left out. An experiment that was begun under
            other engines or plug-ins, another architecture or version of the spec is left alone.
    """
    own = under or provenance()
    return store.write(lambda session: leases.claim(session, owner, limit, own)) if limit > 0 else ()


def heartbeat(store: Store, claims: Iterable[Claim]) -> tuple[Claim, ...]:
    """Those of the claims that still hold; they hold on from now."""
    held = tuple(claims)
    return store.write(lambda session: leases.heartbeat(session, held)) if held else ()


def record(store: Store, claim: Claim, step: Step, *, seconds: float = 0.0) -> bool:
    """Append a step to the repetition's log.

    A step that is there already stays as it is, so that a second delivery changes nothing and is True too.

    Args:
        store: of the claim.
        claim: as it was given out; its own log need not be up to date.
        step: the next one.
        seconds: of work that it took.

    Returns:
        Whether the claim still holds. If not, nothing was written, unless the experiment was asked to pause or stop:
        then the step was, as the last one.

    Raises:
        Conflict: the step is not the next one: some before it are missing.
    """
    return bool(record_all(store, [(claim, (TimedStep(step, seconds),))]))


def record_all(store: Store, deliveries: Iterable[tuple[Claim, Iterable[Delivered]]]) -> tuple[Claim, ...]:
    """Append steps to the logs of many repetitions in one transaction, each as `record` does.

    A checkpoint is kept until its step is there; the next claim has it. One whose step is there already is left out.

    Returns:
        The claims that still hold; of the others nothing was written, but for those whose experiment was asked to pause
        or stop.

    Raises:
        Conflict: as `record`; then nothing at all was written.
    """
    gathered: dict[Claim, list[Delivered]] = {}
    for claim, delivered in deliveries:
        gathered.setdefault(claim, []).extend(delivered)
    return store.write(lambda session: giving_way.record(session, gathered)) if gathered else ()


def complete(store: Store, claim: Claim) -> bool:
    """The repetition is COMPLETED, and with its last one the experiment; False if the claim holds no more.

    Raises:
        Conflict: some of its iterations are missing.
    """
    return bool(complete_all(store, [claim]))


def complete_all(store: Store, claims: Iterable[Claim]) -> tuple[Claim, ...]:
    """Complete many repetitions in one transaction, each as `complete` does.

    Returns:
        The claims that held; the others were left alone.

    Raises:
        Conflict: as `complete`; then nothing at all was written.
    """
    ended = tuple(claims)
    return store.write(lambda session: leases.complete(session, ended)) if ended else ()


def fail(store: Store, claim: Claim, reason: str) -> bool:
    """The repetition is FAILED; the others go on. False if the claim holds no more.

    The experiment is FAILED once all of its repetitions are.
    """
    return store.write(lambda session: leases.fail(session, claim, reason))


def release(store: Store, claim: Claim, reason: str) -> bool:
    """The worker was lost: the repetition is QUEUED again, to go on from its log. False if the claim holds no more.

    One that loses its worker five times without a step in between is FAILED: it is what kills them.
    """
    return store.write(lambda session: leases.release(session, claim, reason))


def hand_back(store: Store, claim: Claim) -> bool:
    """The holder stops in good order: the repetition is QUEUED again, as if it had not been claimed, but for its log.

    False if the claim holds no more.
    """
    return bool(store.write(lambda session: giving_way.hand_back(session, [claim])))


def give_way(store: Store, waiting: Iterable[Claim], under: Provenance | None = None) -> tuple[Claim, ...]:
    """Hand back those of the claims that had better not begin: asked to pause or stop, or it is another's turn.

    Args:
        store: of the claims.
        waiting: claims whose repetition waits for a core; one that runs is never interrupted for another.
        under: as of `claim`.

    Returns:
        Those that were handed back; `claim` gives them out again in their turn.
    """
    held = tuple(waiting)
    if not held:
        return ()
    with store.reading() as session:
        unwanted = giving_way.unwanted(session, held, under or provenance())
    return store.write(lambda session: giving_way.hand_back(session, unwanted)) if unwanted else ()


def hand_back_unheard(store: Store, owner: str, claims: Iterable[Claim]) -> int:
    """Hand back what the owner was given and does not know of, since `claim` did its work and could not say so.

    Args:
        store: of the claims.
        owner: who asks.
        claims: all that the owner knows of.

    Returns:
        How many there were.
    """
    held = tuple(claims)
    return store.write(lambda session: unheard.hand_back(session, owner, held))


def requeue_lost(store: Store, *, stale_after_s: float = STALE_AFTER_S) -> int:
    """QUEUE again, as `release` does, repetitions whose holder was not heard of for so long; how many there were."""
    return store.write(lambda session: leases.requeue_lost(session, timedelta(seconds=stale_after_s)))
