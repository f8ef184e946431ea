"""Events: collected during a transaction, then numbered and written right before its commit.

Numbers come from one row, which stays locked until the commit: a number is visible only with all smaller ones, and a
transaction that is rolled back takes none. Nothing is locked after that row, so it cannot cause a deadlock.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any, cast

from sqlalchemy import Table, bindparam, insert, text, update
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.services.core.arrays import known
from gaplab.services.core.types import Cost, Measured, Probed, Selected, Step, Transferred, Tuned
from gaplab.services.store.clock import now
from gaplab.services.store.models import EventCounterRow, EventRow
from gaplab.services.store.texts import brief

_NOTED = "events"

_COUNT = (
    update(EventCounterRow)
    .values(latest=EventCounterRow.latest + bindparam("more"))
    .returning(EventCounterRow.latest)
    .execution_options(synchronize_session=False)
)
_INSERT = insert(cast("Table", EventRow.__table__)).values(at=now())

_INSERT_ON_POSTGRES = text(
    "INSERT INTO event (number, experiment_id, repetition, kind, body, at) "
    "SELECT :before + place, experiment_id, repetition, kind, CAST(body AS json), clock_timestamp() "
    "FROM unnest(CAST(:experiments AS text[]), CAST(:repetitions AS integer[]), CAST(:kinds AS text[]), "
    "CAST(:bodies AS text[])) WITH ORDINALITY AS noted (experiment_id, repetition, kind, body, place)"
)
"""One INSERT for each row costs five times as much on Postgres, which counts at thousands of steps a second."""


def note(session: Session, kind: EventKind, experiment: str, repetition: int | None = None, /, **body: Any) -> None:  # noqa: ANN401
    """Add an event to the session's transaction, which stores it at its commit.

    The body has a few JSON values, of which long texts are cut; never reality's parameters.
    """
    short = {name: brief(value) if isinstance(value, str) else value for name, value in body.items()}
    values = {"kind": kind.value, "experiment_id": experiment, "repetition": repetition, "body": short}
    session.info.setdefault(_NOTED, []).append(values)


def note_step(session: Session, step: Step, experiment: str, repetition: int) -> None:
    """Add the event of a step."""
    kind, body = _event_of(step)
    note(session, kind, experiment, repetition, iteration=step.iteration, **body)


def write(session: Session) -> None:
    """Number and store the added events; the store calls this right before a commit."""
    if not (noted := session.info.pop(_NOTED, None)):
        return
    session.flush()
    latest = session.execute(_COUNT, {"more": len(noted)}).scalar_one()
    before, connection = latest - len(noted), session.connection()
    if connection.dialect.name == "postgresql":
        connection.execute(_INSERT_ON_POSTGRES, {"before": before} | _columns(noted))
    else:
        rows = [{"number": number, **each} for number, each in enumerate(noted, start=before + 1)]
        connection.execute(_INSERT, rows)


def _columns(noted: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    return {
        "experiments": [each["experiment_id"] for each in noted],
        "repetitions": [each["repetition"] for each in noted],
        "kinds": [each["kind"] for each in noted],
        "bodies": [json.dumps(each["body"]) for each in noted],
    }


def _event_of(step: Step) -> tuple[EventKind, dict[str, Any]]:
    """Return the kind and body of a step's event; the body has results, but no vectors."""
    match step:
        case Selected():
            return EventKind.SELECTED, {}
        case Measured():
            return EventKind.MEASURED, {"fitness": known(step.sample.fitness)}
        case Tuned():
            best = known(step.simulators[0].squared_error) if step.simulators else None
            tuned = {"squared_error": best} if step.cost != Cost() else {}
            return EventKind.TUNED, {"simulators": len(step.simulators)} | tuned
        case Transferred():
            return EventKind.TRANSFERRED, {"simulated_fitness": known(step.fitness)}
        case Probed():
            left_out = {"left_out": True} if step.left_out else {}
            recorded = known(step.recorded)
            return EventKind.PROBED, {"fitness": known(step.fitness), "recorded_fitness": recorded} | left_out
