"""Leases that end in good order before their repetition does: it was asked for, or somebody else's turn has come."""

from collections.abc import Iterable, Mapping, Sequence

from sqlalchemy import case, literal, select, update
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import ASKED, Ending, State
from gaplab.schemas.provenance import Provenance
from gaplab.services.store.clock import now
from gaplab.services.store.lease import Claim, Delivered
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries import attempts, steps
from gaplab.services.store.queries.experiments import lock
from gaplab.services.store.queries.provenance import permitted
from gaplab.services.store.queries.settling import settle
from gaplab.services.store.queries.steps import any_of
from gaplab.services.store.queries.turns import ahead

_ENDING = {State.PAUSING: Ending.PAUSED, State.STOPPING: Ending.STOPPED}


def record(session: Session, deliveries: Mapping[Claim, Sequence[Delivered]]) -> tuple[Claim, ...]:
    """Append steps as `steps.record` does; the claims that go on.

    A delivery to an experiment that was asked to pause or stop is stored, and ends its lease: the step that was under
    way is over, and nothing after it is kept. A checkpoint is no step: work goes on to the step's end.
    """
    asked = _asked(session, deliveries)
    before = _lengths(session, [each for each in deliveries if each.experiment_id in asked])
    held = steps.record(session, deliveries)
    after = _lengths(session, [each for each in held if each.experiment_id in asked])
    leaving = [
        each for each in held if after.get(each, 0) > before.get(each, 0)
    ]  # a second delivery brings no new step
    _give_back(session, leaving, asked)
    return tuple(each for each in held if each not in leaving)


def unwanted(session: Session, waiting: Sequence[Claim], under: Provenance) -> tuple[Claim, ...]:
    """Those of the claims, none of which has begun its work, that had better be given back now.

    Args:
        session: of a transaction.
        waiting: the claims.
        under: what their holder computes with, and so whatever it would claim in their place.
    """
    row, experiments = ExperimentRow, sorted({each.experiment_id for each in waiting})
    over = session.scalars(select(row.id).where(row.id.in_(experiments), row.state.in_(ASKED))).all()
    gone = {*over, *ahead(session, experiments, permitted(session, under))}
    return tuple(each for each in waiting if each.experiment_id in gone)


def hand_back(session: Session, claims: Sequence[Claim]) -> tuple[Claim, ...]:
    """QUEUED again as if they had not been claimed; those of the claims that held."""
    experiments = sorted({each.experiment_id for each in claims})
    lock(session, experiments)
    row = ExperimentRow
    states = session.execute(select(row.id, row.state).where(row.id.in_(experiments)))
    return _give_back(session, claims, dict(states.all()), begun=False)


def _asked(session: Session, claims: Iterable[Claim]) -> dict[str, State]:
    """The experiments of these claims whose steps under way are to be their last; they are locked from now on.

    Whoever locks an experiment does it before its repetitions; hence the look at the experiments alone.
    """
    row = ExperimentRow
    wanted = select(row.id, row.state).where(row.id.in_({each.experiment_id for each in claims}), row.state.in_(ASKED))
    if found := session.scalars(wanted).all():
        lock(session, found)
        return dict(session.execute(wanted).all())
    return {}


def _lengths(session: Session, claims: Sequence[Claim]) -> dict[Claim, int]:
    """How many steps the log of each claim's repetition has."""
    if not claims:
        return {}
    row = RepetitionRow
    found = dict(session.execute(select(row.id, row.steps).where(row.id.in_([c.repetition_id for c in claims]))).all())
    return {each: found[each.repetition_id] for each in claims}


def _give_back(
    session: Session, claims: Sequence[Claim], states: Mapping[str, State], *, begun: bool = True
) -> tuple[Claim, ...]:
    """QUEUED again; those of the claims that held.

    What was `begun` counts as an attempt, and is COMPLETED if its last step was the last of all.
    """
    if not claims:
        return ()
    row = RepetitionRow
    whole = select(ExperimentRow.iterations).where(ExperimentRow.id == row.experiment_id).scalar_subquery()
    done = (row.iterations_done >= whole) & literal(begun)
    given = session.execute(
        update(row)
        .where(any_of(claims), row.state == State.RUNNING)
        .values(
            state=case((done, State.COMPLETED), else_=State.QUEUED),
            ended_at=case((done, now()), else_=None),
            owner=None,
            attempts=row.attempts - int(not begun),
        )
        .returning(row.id, row.state)
    )
    became = dict(given.all())
    for ending in Ending:
        ids = [each.repetition_id for each in claims if _ending(each, became, states) is ending]
        if ids:
            attempts.end(session, ids, ending)
    settle(session, sorted({each.experiment_id for each in claims}))
    return tuple(each for each in claims if each.repetition_id in became)


def _ending(claim: Claim, became: Mapping[int, State], states: Mapping[str, State]) -> Ending | None:
    if claim.repetition_id not in became:
        return None
    if became[claim.repetition_id] is State.COMPLETED:
        return Ending.COMPLETED
    return _ENDING.get(states[claim.experiment_id], Ending.HANDED_BACK)
