"""Sensitivity checks as people use them: submitted, read, and summarised for their experiments.

Supervisors run them by `gaplab.services.running.sensitivity`.
"""

import json
from collections.abc import Iterable, Mapping
from functools import lru_cache
from hashlib import sha256

from sqlalchemy import select
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import OPEN, State
from gaplab.schemas.sensitivity import Checked, Sensitivity, SensitivityRead, SensitivitySpec
from gaplab.services.experiments.idempotency import Once, once
from gaplab.services.experiments.limits import FREELY, Admission
from gaplab.services.experiments.states import move
from gaplab.services.experiments.stored_files import resolved_here
from gaplab.services.findings.sensitivity import VERSION, Effort, alike, warning
from gaplab.services.plugins.external import external_plugins, named_in
from gaplab.services.specs.resolution import resolve_sensitivity
from gaplab.services.specs.robots import unit
from gaplab.services.specs.stored_specs import checked, subject
from gaplab.services.store.clock import moment
from gaplab.services.store.models import ExperimentRow, SensitivityRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.session import Store, snapshot
from gaplab.services.store.statements import existing, insert_new


def admit(store: Store, spec: SensitivitySpec, admitted: Admission = FREELY) -> Once[SensitivityRead]:
    """Submit the check, once for each idempotency key.

    Raises:
        InvalidSpec: they are invalid; the error has every violation.
        KeyReused: the key was used for another request.
    """
    resolved = resolved_here(store, spec, resolve_sensitivity)
    return once(store, admitted, spec, SensitivityRead, lambda session: _view(queue(session, resolved)))


@snapshot
def read(session: Session, id: str) -> SensitivityRead:
    """Return the check; it has results once it is COMPLETED."""
    return _view(existing(session, SensitivityRow, id, "sensitivity check"))


def queue(session: Session, spec: Checked) -> SensitivityRow:
    """Return the check of this spec, QUEUED if it is new, had FAILED or was CANCELLED.

    The row stays locked until the transaction ends. A check that ended earlier would not warn the experiments that
    are being submitted with it.
    """
    row, id_ = SensitivityRow, id_of(spec)
    values = {"id": id_, "spec": spec.model_dump(mode="json"), "created_at": moment(session)}
    session.execute(insert_new(session, row).values(values))
    again = (row.id == id_) & row.state.in_((State.FAILED, State.CANCELLED))
    move(session, row, again, State.QUEUED, losses=0, error=None)
    return session.get_one(row, id_, populate_existing=True, with_for_update={"read": True})


def queue_for(session: Session, experiments: Iterable[ExperimentRow]) -> None:
    """Queue the check that these experiments share; one without tunables, or without fitness, has none."""
    tuning = [row for row in experiments if row.tunes and not row.recorded]
    if not tuning:
        return
    check = queue(session, checked(tuning[0].spec))
    for row in tuning:
        row.sensitivity_id = check.id
    session.flush()
    if check.state.ended:
        tell(session, check, [row.id for row in tuning])


def cancel_unneeded(session: Session, check: str | None) -> None:
    """Cancel a check that has not ended if every experiment that it belongs to has."""
    row, experiment = SensitivityRow, ExperimentRow
    needed = select(experiment.sensitivity_id).where(experiment.sensitivity_id == check, experiment.state.in_(OPEN))
    move(session, row, (row.id == check) & row.id.not_in(needed), State.CANCELLED)


def tell(session: Session, check: SensitivityRow, experiments: Iterable[str]) -> None:
    """Record for these experiments that their check has ended, with its warnings."""
    body = {"sensitivity": check.id, "state": check.state.value, "warnings": list(warnings(check))}
    for experiment in experiments:
        note(session, EventKind.SENSITIVITY_ENDED, experiment, **body)


def summaries(session: Session, experiments: Iterable[ExperimentRow]) -> dict[str, tuple[str, tuple[str, ...]]]:
    """Return id and warnings of each experiment's check; experiments without a check are left out.

    An imported experiment names no check: it has the check of the same tunables, if there is one.
    """
    ids = {row.id: row.sensitivity_id or _id_of_text(subject(row.spec)) for row in experiments if row.tunes}
    rows = session.scalars(select(SensitivityRow).where(SensitivityRow.id.in_(ids.values())))
    found = {row.id: (row.id, warnings(row)) for row in rows}
    return {experiment: found[check] for experiment, check in ids.items() if check in found}


def warnings(check: SensitivityRow) -> tuple[str, ...]:
    """Return warnings about these tunables, as sentences."""
    if check.state is State.FAILED:
        return (f"the sensitivity check failed, so that nothing is known of the tunables: {check.error}",)
    findings = _findings(check)
    return (*(sentence for finding in findings if (sentence := warning(finding))), *alike(findings))


def id_of(spec: Checked, external: Mapping[str, str] | None = None) -> str:
    """Return the id of the check: a hash of the spec, the version of the method, and the external plug-ins.

    `external` are their versions by kind and name, so that an edited one is checked again; left out: this process's.
    """
    versions = external_plugins() if external is None else external
    names = named_in(spec.model_dump(mode="json"))
    files = [versions[name] for name in names if name in versions]
    text = json.dumps([VERSION, spec.model_dump(mode="json"), *files], sort_keys=True)
    return sha256(text.encode()).hexdigest()[:16]


@lru_cache(maxsize=256)
def _id_of_text(subject: str) -> str:
    """Return the id of the check of a subject without external plug-ins; the experiments of a list share subjects."""
    return id_of(Checked.model_validate_json(subject), external={})


def _findings(check: SensitivityRow) -> tuple[Sensitivity, ...]:
    return tuple(map(Sensitivity.model_validate, check.found or ()))


def _view(check: SensitivityRow) -> SensitivityRead:
    spec = Checked.model_validate(check.spec)
    return SensitivityRead.filled_from(
        check,
        spec=spec,
        rollouts=Effort(spec.points, spec.evaluations).rollouts(len(spec.tunables)),
        unit=unit(spec),
        tunables=_findings(check),
        warnings=warnings(check),
        reason=check.error,
    )
