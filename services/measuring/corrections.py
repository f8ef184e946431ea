"""Corrections of measurements: what follows from one is computed again, and nothing that was measured is lost."""

from collections.abc import Callable

from gaplab.schemas.corrections import ConflictSpec, Consequences, CorrectionSpec, VoidSpec
from gaplab.schemas.events import EventKind
from gaplab.schemas.measurements import AnswerState, MeasurementSpec
from gaplab.schemas.traces import TracesRead
from gaplab.services.core.errors import Conflict
from gaplab.services.experiments.idempotency import Once, once
from gaplab.services.experiments.limits import Admission
from gaplab.services.measuring import rewriting
from gaplab.services.measuring.answering import check_values, insert_answer, note_answer, settle_request
from gaplab.services.measuring.rewriting import apply, ask_again, consequences, nothing_follows, recorded
from gaplab.services.measuring.waiting import record_answer
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.models import AnswerRow, ExperimentRow, RepetitionRow, RequestRow
from gaplab.services.store.queries import requests
from gaplab.services.store.queries.requests import judge
from gaplab.services.store.session import Session, Store
from gaplab.services.store.statements import existing


def correct(
    store: Store, id_: str, spec: CorrectionSpec, admitted: Admission, *, dry_run: bool = False
) -> Once[Consequences]:
    """Replace the answer that counts; the repetition goes on from it.

    Raises:
        NotFound: there is no such answer.
        InvalidSpec: the values do not fit the request.
        Conflict: it does not count.
    """
    if dry_run:
        with store.reading() as session:
            row, request, repetition = _counted(session, id_, requests.get)
            _check(session, repetition, _with_readings(spec, row))
            return Once(consequences(session, request, repetition, "correct"))

    def work(session: Session) -> Consequences:
        return _correct(session, id_, spec, admitted.token)

    return once(store, admitted, spec, Consequences, work, of=id_)


def void(store: Store, id_: str, spec: VoidSpec, admitted: Admission, *, dry_run: bool = False) -> Once[Consequences]:
    """Void the answer that counts: it is invalid, and its controller is requested again.

    Raises:
        NotFound: there is no such answer.
        Conflict: it does not count.
    """
    if dry_run:
        with store.reading() as session:
            return Once(consequences(session, *_counted(session, id_, requests.get)[1:], "void"))
    return once(store, admitted, spec, Consequences, lambda session: _void(session, id_, spec), of=id_)


def decide(
    store: Store, id_: str, spec: ConflictSpec, admitted: Admission, *, dry_run: bool = False
) -> Once[Consequences]:
    """Decide about an answer that is in conflict with the one that counts, or with whoever holds the request.

    If it counts already, and something about it is doubtful, it is confirmed.

    Raises:
        NotFound: there is no such answer.
        Conflict: it is neither in conflict nor doubtful, or the request is no longer needed.
    """
    if dry_run:
        with store.reading() as session:
            row = existing(session, AnswerRow, id_, "measurement")
            return Once(_decided(session, row, *requests.get(session, row.request_id), spec))
    return once(store, admitted, spec, Consequences, lambda session: _decide(session, id_, spec), of=id_)


def _correct(session: Session, id_: str, spec: CorrectionSpec, token: str | None) -> Consequences:
    row, request, repetition = _counted(session, id_, requests.locked)
    spec = _with_readings(spec, row)
    _check(session, repetition, spec)
    found = consequences(session, request, repetition, "correct")
    kept = {"attachments": tuple(row.attachments or ()), "note": row.note}
    answer = MeasurementSpec(**spec.model_dump(include={"values", "readings", "failed", "operator"}), **kept)
    new = replace(session, row, answer, spec.reason, token)
    branch = apply(session, request, repetition, new, spec.reason)
    return found.model_copy(update={"answer": new.id, "branch": branch})


def replace(
    session: Session,
    row: AnswerRow,
    spec: MeasurementSpec,
    reason: str,
    token: str | None,
    traces: TracesRead | None = None,
) -> AnswerRow:
    """Let another answer count in place of a row that counts; no step is changed yet."""
    request = session.get_one(RequestRow, row.request_id)
    repetition = session.get_one(RepetitionRow, row.repetition_id)
    judge(session, row, AnswerState.REPLACED, reason)
    new = insert_answer(session, request, spec, AnswerState.COUNTED, token, traces)
    new.replaces = row.id
    settle_request(session, request, new)
    note_answer(session, EventKind.CORRECTED, request, repetition, row, spec.operator)
    return new


def _void(session: Session, id_: str, spec: VoidSpec) -> Consequences:
    row, request, repetition = _counted(session, id_, requests.locked)
    found = consequences(session, request, repetition, "void")
    judge(session, row, AnswerState.VOID, spec.reason)
    note_answer(session, EventKind.VOIDED, request, repetition, row, spec.operator)
    branch = None
    if rows := recorded(session, request, repetition):
        request.place, request.iteration, request.kind = rows[0].place, rows[0].iteration, rows[0].kind
        session.flush()
        branch = rewriting.close(session, repetition, request.place, request.iteration, spec.reason)
        ask_again(session, request, repetition)
    return found.model_copy(update={"branch": branch})


def _decide(session: Session, id_: str, spec: ConflictSpec) -> Consequences:
    row = existing(session, AnswerRow, id_, "measurement")
    request, repetition = requests.locked(session, row.request_id)
    session.refresh(row)
    found = _decided(session, row, request, repetition, spec)
    if row.state is AnswerState.COUNTED:
        row.doubts = None
        note_answer(session, EventKind.DECIDED, request, repetition, row, spec.operator)
        return found
    if spec.counts == "other":
        judge(session, row, AnswerState.DISMISSED, spec.reason)
        note_answer(session, EventKind.DECIDED, request, repetition, row, spec.operator)
        return found
    counted = requests.counted_answer(session, request)
    if counted is not None:
        judge(session, counted, AnswerState.REPLACED, spec.reason)
        row.replaces = counted.id
    judge(session, row, AnswerState.COUNTED, spec.reason)
    settle_request(session, request, row)
    note_answer(session, EventKind.DECIDED, request, repetition, row, spec.operator)
    if counted is not None:
        return found.model_copy(update={"branch": apply(session, request, repetition, row, spec.reason)})
    record_answer(session, request, row)
    return found


def _decided(
    session: Session, row: AnswerRow, request: RequestRow, repetition: RepetitionRow, spec: ConflictSpec
) -> Consequences:
    """Return what follows from a decision, of which nothing is done yet."""
    if row.state is AnswerState.COUNTED and row.doubts and spec.counts == "this":
        return nothing_follows(request, repetition, "the answer is confirmed; nothing about it is doubtful any more")
    if row.state is not AnswerState.CONFLICT:
        raise Conflict(f"measurement {row.id} is {row.state.value}, not in conflict, so nothing is to be decided")
    if spec.counts == "other":
        return nothing_follows(request, repetition, "the answer is dismissed; what counted still counts")
    if requests.counted_answer(session, request) is not None:
        found = consequences(session, request, repetition, "correct")
    elif request.state in requests.PENDING:
        found = nothing_follows(request, repetition, "the answer counts, and the repetition goes on")
    else:
        raise Conflict(f"request {request.id} is no longer needed")
    return found.model_copy(update={"answer": row.id})


def _counted(
    session: Session, id_: str, get: Callable[[Session, str], tuple[RequestRow, RepetitionRow]]
) -> tuple[AnswerRow, RequestRow, RepetitionRow]:
    """Return an answer, its request and its repetition as `get` does, unless the answer does not count."""
    row = existing(session, AnswerRow, id_, "measurement")
    request, repetition = get(session, row.request_id)
    session.refresh(row)
    if row.state is not AnswerState.COUNTED:
        why = {
            AnswerState.CONFLICT: "it is in conflict; decide about it instead",
            AnswerState.REPLACED: "a correction has replaced it; correct that one",
            AnswerState.VOID: "it is void",
        }.get(row.state, "it is dismissed")
        raise Conflict(f"measurement {row.id} does not count: {why}")
    return row, request, repetition


def _with_readings(spec: CorrectionSpec, row: AnswerRow) -> CorrectionSpec:
    """Return a correction of the values alone with the readings of the answer, if it has as many repeats."""
    if (
        spec.readings is not None
        or spec.values is None
        or row.readings is None
        or len(row.readings) != len(spec.values)
    ):
        return spec
    return CorrectionSpec.model_validate({**spec.model_dump(exclude_none=True), "readings": row.readings})


def _check(session: Session, repetition: RepetitionRow, spec: CorrectionSpec) -> None:
    resolved = spec_of(session.get_one(ExperimentRow, repetition.experiment_id).spec)
    check_values(resolved, spec.values, spec.readings, spec.unit, resolved.reality.repeats)
