"""Answers to requests. Each is checked, and kept: it counts, or it is a conflict that a person decides."""

from collections.abc import Sequence
from typing import Any

from gaplab.schemas.events import EventKind
from gaplab.schemas.measurements import AnswerRead, AnswerState, MeasurementSpec, RequestState, Table
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.traces import TraceRead, TracesRead
from gaplab.services.core.errors import Conflict, InvalidSpec, Violation
from gaplab.services.experiments.idempotency import Once, once
from gaplab.services.experiments.limits import Admission
from gaplab.services.measuring.doubts import doubts
from gaplab.services.measuring.views import view_answer
from gaplab.services.measuring.waiting import record_answer
from gaplab.services.specs.measured import lack_violations, readings_violations, unit_violations
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import discrepancy_of, spec_of
from gaplab.services.store.clock import moment
from gaplab.services.store.models import AnswerRow, ExperimentRow, RepetitionRow, RequestRow
from gaplab.services.store.queries import attachments, requests
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import new_id
from gaplab.services.store.queries.requests import become
from gaplab.services.store.session import Session, Store
from gaplab.services.store.statements import storable
from gaplab.services.world.robot_library import label_of

UNKNOWN = "unknown"
"""Operator of an answer that names none, and whose take is not the latest one."""


def answer(
    store: Store, id_: str, spec: MeasurementSpec, admitted: Admission, traces: TracesRead | None = None
) -> Once[AnswerRead]:
    """Store an answer to a request; it counts if the request is still needed and nobody else holds it.

    An answer that came late counts unless somebody else took or answered the request meanwhile. Then it is kept as a
    conflict. The answer that counts, sent twice, is stored once, also if parts of it are left out the second time. With
    another value, reading, note, attachment or operator it is a conflict too.

    Raises:
        NotFound: the request does not exist.
        InvalidSpec: the values do not fit the request; every violation is named.
        Conflict: the request is no longer needed, or its traces are doubtful and not confirmed.
    """

    def work(session: Session) -> AnswerRead:
        return _answer(session, id_, spec, traces, admitted.token)

    return once(store, admitted, spec, AnswerRead, work, of=id_)


def _answer(
    session: Session, id_: str, spec: MeasurementSpec, traces: TracesRead | None, token: str | None
) -> AnswerRead:
    spec = with_values(spec, traces)
    row, repetition = requests.locked(session, id_)
    experiment = session.get_one(ExperimentRow, repetition.experiment_id)
    resolved = spec_of(experiment.spec)
    check_values(resolved, spec.values, spec.readings, spec.unit, resolved.reality.repeats)
    check_attachments(session, spec.attachments)
    answered = row.state in requests.ANSWERED
    counted = requests.counted_answer(session, row) if answered else None
    if row.state is RequestState.WITHDRAWN or (answered and counted is None):
        msg = f"request {row.id} is no longer needed: its experiment has ended, or a correction closed its branch"
        raise Conflict(msg)
    if counted is not None and says_nothing_new(counted, spec):
        counted.doubts = None if spec.confirmed else counted.doubts
        return view_answer(counted)
    latest = (spec.take or row.takes) >= row.takes if row.state is not RequestState.TAKEN else spec.take == row.takes
    counts = counted is None and latest
    given = insert_answer(session, row, spec, AnswerState.COUNTED if counts else AnswerState.CONFLICT, token, traces)
    if counts:
        told = () if spec.confirmed else doubts(session, repetition, row, spec.values)
        given.doubts = list(told) or None
        settle_request(session, row, given)
        record_answer(session, row, given)
    else:
        note_answer(session, EventKind.CONFLICTING, row, repetition, given)
    return view_answer(given)


def with_values(spec: MeasurementSpec, traces: TracesRead | None) -> MeasurementSpec:
    """Return an answer with the values and readings of its traces, if it has any.

    Raises:
        Conflict: they are doubtful and not confirmed.
    """
    if traces is None:
        return spec
    if traces.doubts and not spec.confirmed:
        raise Conflict(f"{'; '.join(traces.doubts)}. Look at the traces; if they are right, send `confirmed` with them")
    named = dict.fromkeys((*spec.attachments, *(trace.attachment for trace in traces.traces)))
    return spec.model_copy(update={"values": traces.values, "readings": traces.readings, "attachments": tuple(named)})


def insert_answer(
    session: Session,
    row: RequestRow,
    spec: MeasurementSpec,
    state: AnswerState,
    token: str | None,
    traces: TracesRead | None = None,
) -> AnswerRow:
    """Store an answer as it was given; without an operator, the holder of its take, if that is the latest one."""
    parts, holder = _parts(spec), row.taken_by if spec.take == row.takes else None
    given = AnswerRow(
        id=new_id(),
        repetition_id=row.repetition_id,
        request_id=row.id,
        take=spec.take,
        state=state,
        token_id=token,
        at=moment(session),
        **parts | {"operator": parts["operator"] or holder or UNKNOWN},
    )
    if traces is not None:
        kept = set(TraceRead.model_fields)
        given.traces = [trace.model_dump(mode="json", include=kept) for trace in traces.traces]
    session.add(given)
    session.flush()
    return given


def settle_request(session: Session, row: RequestRow, given: AnswerRow) -> None:
    """End a request with the answer that counts. If it is not of the holder, the take still keeps the bench."""
    to = RequestState.MEASURED if given.values is not None else RequestState.FAILED
    held = None if given.take == row.takes else row.held
    become(session, row, to, held=held, unanswered=0, ended_at=moment(session))


def note_answer(
    session: Session,
    kind: EventKind,
    row: RequestRow,
    repetition: RepetitionRow,
    given: AnswerRow,
    by: str | None = None,
) -> None:
    """Add the event of an answer that does not count by itself, or no longer; `by` names the person who says so."""
    body = {"iteration": row.iteration, "request": row.id, "answer": given.id, "operator": given.operator}
    if by:
        body["by"] = storable(by)
    if given.reason:
        body["reason"] = given.reason
    note(session, kind, repetition.experiment_id, repetition.number, **body)


def _parts(spec: MeasurementSpec) -> dict[str, Any]:
    """Return the parts of an answer by column, as they are stored; None for a part that is left out."""
    parts = {"values", "readings", "failed", "operator", "note", "attachments"}
    given = spec.model_dump(mode="json", include=parts).items()
    return {name: storable(part) if isinstance(part, str) else part or None for name, part in given}


def says_nothing_new(counted: AnswerRow, spec: MeasurementSpec) -> bool:
    """Return whether each part of an answer is in the one that counts already, as of an answer that is sent again."""
    parts = _parts(spec)
    attached = set(parts.pop("attachments") or ()) <= set(counted.attachments or ())
    same_take = spec.take is None or counted.take == spec.take
    return same_take and attached and all(not part or getattr(counted, name) == part for name, part in parts.items())


_REMEDY = "let the driver return (fitness, readings), or use `gaplab traces REQUEST FILE --answer`"


def check_values(
    spec: ResolvedSpec,
    values: Sequence[float] | None,
    readings: Sequence[Table] | None,
    unit: str | None,
    repeats: int | None = None,
) -> None:
    """Refuse values of another unit or number than `repeats`, if that is given, and readings of another shape.

    If the experiment tunes on readings, values without any that it compares are refused too. An answer about a probe
    is no exception, since it also counts for a later sample of the same controller.

    Raises:
        InvalidSpec: with every violation.
    """
    robot = robot_of(spec)
    violations = list(unit_violations(label_of(spec.robot), unit, robot.unit))
    if values is not None and len(values) != (repeats or len(values)):
        message = (
            f"the experiment asks for {repeats} value{'' if repeats == 1 else 's'} a measurement, not {len(values)}"
        )
        violations.append(Violation("/values", list(values), message, f"exactly {repeats}"))
    if readings is not None:
        violations += readings_violations(readings, None if values is None else len(values), robot.sensors)
    if values is not None and not violations:
        discrepancy = discrepancy_of(spec.model_dump(include={"discrepancy"}))
        violations += lack_violations(discrepancy, robot.sensors, values, readings, _REMEDY)
    if violations:
        raise InvalidSpec(violations)


def check_attachments(session: Session, hashes: Sequence[str]) -> None:
    """Refuse attachments that are not stored.

    Raises:
        InvalidSpec: with each that is missing.
    """
    if missing := attachments.missing(session, hashes, "/attachments"):
        raise InvalidSpec(missing)
