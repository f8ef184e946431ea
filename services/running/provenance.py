"""Provenance: the versions that computed an experiment, and the supervisors that may continue it.

An experiment is bound to the versions that computed its first steps: its engines with their libraries, the machine's
architecture, the version of the spec, its external plug-ins. A supervisor with others skips it until a person accepts.
A supervisor that cannot use a plug-in skips all experiments that name it; they stay queued, and tell why.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import ColumnElement, func, select, update
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.provenance import Provenance, ProvenanceRead, ProvenanceUse
from gaplab.schemas.records import StudyRead
from gaplab.services.core.errors import Conflict
from gaplab.services.experiments.views import view
from gaplab.services.plugins.external import named_in, still_holds, tells_unavailable, text_of, unavailable
from gaplab.services.store.lease import Claim
from gaplab.services.store.models import ExperimentProvenanceRow, ExperimentRow, ProvenanceRow, RepetitionRow
from gaplab.services.store.queries import files
from gaplab.services.store.queries.attempts import insert_provenances, provenance_id
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import get_experiment, lock, members
from gaplab.services.store.session import snapshot, transaction
from gaplab.services.store.statements import insert_new, storable

NONE: Mapping[str, str] = {}
"""No plug-in is refused."""


@snapshot
def read(session: Session, experiment_id: str) -> ProvenanceRead:
    """Return the versions that computed the experiment, and those of a supervisor that skipped it.

    Raises:
        NotFound: the experiment does not exist.
        StoreUnavailable: the database cannot be used now.
    """
    experiment = get_experiment(session, experiment_id)
    return ProvenanceRead(
        computed_with=experiment.computed_with, refused_by=experiment.refused_by, uses=uses(session, experiment_id)
    )


@transaction
def accept_versions(session: Session, id_: str) -> StudyRead:
    """Let the next supervisor continue experiments under any versions; each is then bound to those.

    Raises:
        NotFound: no such study or experiment.
        Conflict: all of them have ended, or have not started.
        StoreUnavailable: the database cannot be used now.
    """
    found = members(session, id_)
    lock(session, found.ids)
    for experiment in found.experiments:
        session.refresh(experiment)
    bound = [each for each in found.experiments if not each.state.ended and each.computed_with is not None]
    if not bound:
        ended = " and ".join(sorted({each.state for each in found.experiments if each.state.ended}))
        why = f"has ended: it is {ended}" if ended else "has not started, so it has no versions yet"
        raise Conflict(f"{found} {why}; there is nothing to accept")
    for experiment in bound:
        versions = {"computed_with": experiment.computed_with, "refused_by": experiment.refused_by}
        note(session, EventKind.VERSIONS_ACCEPTED, experiment.id, **versions)
        experiment.computed_with = experiment.refused_by = None
    session.flush()
    return view(session, found)[0]


def decisive(under: Provenance, spec: Mapping[str, Any]) -> str:
    """Return the part of a provenance that all supervisors of an experiment with this spec must share."""
    chosen = {ref["name"] for ref in (spec["engine"], spec["reality"]["engine"]) if ref}
    engines = (f"{name} ({under.engines.get(name, 'none')})" for name in sorted(chosen))
    plugins = (plugin for plugin in named_in(spec) if not plugin.startswith("engine "))
    external = (f"{plugin} ({under.outside[plugin]})" for plugin in plugins if plugin in under.outside)
    return ", ".join([*engines, under.architecture, f"spec {under.spec_version}", *external])


def permitted(session: Session, under: Provenance, refused: Mapping[str, str] = NONE) -> ColumnElement[bool]:
    """SQL condition: the supervisor may claim the experiment's repetitions.

    Its spec can be read, its plug-ins can be used, and it has not started, or started with the same versions. `refused`
    says why processes of the supervisor refuse plug-ins, by kind and name.
    """
    row = ExperimentRow
    same = row.computed_with.in_(_shared(session, under))
    holding = [text for text in _refusals_of_plugins(session) if still_holds(text, refused)]
    usable = row.refused_by.is_(None) | row.refused_by.not_in(holding)
    return (row.spec_version <= under.spec_version) & (row.computed_with.is_(None) | same) & usable


def _shared(session: Session, under: Provenance) -> list[str]:
    """Return those versions, of all that claimable experiments are bound to, that this provenance has too.

    Which are decisive follows from a spec, so one experiment speaks for all that are bound to the same ones.
    """
    row = ExperimentRow
    readable = row.claimable.is_(True) & (row.spec_version <= under.spec_version)
    bound = select(func.min(row.id)).where(readable, row.computed_with.is_not(None)).group_by(row.computed_with)
    specs = select(row.computed_with, row.spec).where(row.id.in_(bound))
    return [versions for versions, spec in session.execute(specs) if versions == decisive(under, spec)]


def refuse_unusable(session: Session, repetitions: Sequence[int], refused: Mapping[str, str]) -> list[str]:
    """Note on experiments of these repetitions which plug-ins cannot be used, and return those experiments."""
    row, owners = ExperimentRow, select(RepetitionRow.experiment_id).where(RepetitionRow.id.in_(repetitions))
    experiments = session.execute(
        select(row.id, row.spec, row.computed_with, row.refused_by).where(row.id.in_(owners)).order_by(row.id)
    ).all()
    files.learn(session, (each.spec for each in experiments))
    reasons = ((each, unusable(each.spec, refused)) for each in experiments)
    waiting = [(each, storable(text_of(found))) for each, found in reasons if found]
    for experiment, text in waiting:
        session.execute(update(row).where(row.id == experiment.id).values(refused_by=text))
        if text != experiment.refused_by:
            _tell(session, experiment.id, experiment.computed_with, text)
    return [experiment.id for experiment, _ in waiting]


def record(session: Session, under: Provenance, claims: Sequence[Claim]) -> None:
    """Store the provenance of claims, and bind starting experiments to it. The experiments must be locked."""
    id_, experiment = provenance_id(under), ExperimentRow
    specs = {claim.experiment_id: claim.spec.model_dump(mode="json") for claim in claims}
    insert_provenances(session, [{"id": id_, "facts": under.model_dump(mode="json")}])
    uses = [{"experiment_id": each, "provenance_id": id_} for each in specs]
    session.execute(insert_new(session, ExperimentProvenanceRow).values(uses))
    session.execute(update(experiment).where(experiment.id.in_(specs)).values(refused_by=None))
    for experiment_id, spec in specs.items():
        unbound = update(experiment).where(experiment.id == experiment_id, experiment.computed_with.is_(None))
        session.execute(unbound.values(computed_with=decisive(under, spec)))
    row = RepetitionRow
    session.execute(update(row).where(row.id.in_([claim.id for claim in claims])).values(provenance_id=id_))
    for claim in claims:
        told = {"epoch": claim.epoch, "steps": len(claim.log), "provenance": id_}
        note(session, EventKind.REPETITION_CLAIMED, claim.experiment_id, claim.number, **told)


def refuse(session: Session, under: Provenance, refused: Mapping[str, str] = NONE) -> None:
    """Note once, on each waiting experiment that may not be claimed with this provenance, why that is."""
    row = ExperimentRow
    outdated = [text for text in _refusals_of_plugins(session) if not still_holds(text, refused)]
    untold = row.refused_by.is_(None) | row.refused_by.in_(outdated)
    waiting = row.claimable.is_(True) & untold & row.computed_with.is_not(None) & ~permitted(session, under, refused)
    experiments = session.execute(select(row.id, row.spec, row.computed_with).where(waiting).order_by(row.id)).all()
    files.learn(session, (spec for _, spec, _ in experiments))
    for experiment, spec, before in experiments:
        theirs = storable(text_of(unusable(spec, refused)) or decisive(under, spec))
        new = update(row).where(row.id == experiment, untold).values(refused_by=theirs)
        if session.execute(new.returning(row.id)).first() is not None:
            _tell(session, experiment, before, theirs)


@transaction
def tell_refused(session: Session, experiment_id: str, under: Provenance, refused: Mapping[str, str]) -> None:
    """Note why experiments wait, now that a process has refused the plug-ins of one of them.

    Unless that one has steps, it is not bound any more to the versions under which it was claimed.

    Raises:
        StoreUnavailable: the database cannot be used now.
    """
    row = ExperimentRow
    lock(session, [experiment_id])
    begun = select(RepetitionRow.id).where(RepetitionRow.experiment_id == experiment_id, RepetitionRow.steps > 0)
    unbound = update(row).where(row.id == experiment_id, row.running == 0, ~begun.exists())
    session.execute(unbound.values(computed_with=None))
    refuse(session, under, refused)


def _refusals_of_plugins(session: Session) -> list[str]:
    """Return the texts by which waiting experiments tell of plug-ins that some supervisor cannot use."""
    row = ExperimentRow
    told = select(row.refused_by).where(row.claimable.is_(True), row.refused_by.is_not(None)).distinct()
    return [text for text in session.scalars(told) if text is not None and tells_unavailable(text)]


def unusable(spec: Mapping[str, Any], refused: Mapping[str, str]) -> dict[str, str]:
    """Return why plug-ins that a spec names cannot be used by this supervisor, by kind and name."""
    reasons = ((plugin, unavailable(plugin) or refused.get(plugin)) for plugin in named_in(spec))
    return {plugin: why for plugin, why in reasons if why is not None}


def _tell(session: Session, experiment: str, before: str | None, theirs: str) -> None:
    note(session, EventKind.VERSIONS_REFUSED, experiment, computed_with=before, refused_by=theirs)


def uses(session: Session, experiment_id: str) -> tuple[ProvenanceUse, ...]:
    """Return each provenance that computed a part of the experiment, the earliest first."""
    use, fact, row = ExperimentProvenanceRow, ProvenanceRow, RepetitionRow
    claimed = (
        select(func.count())
        .where(row.experiment_id == use.experiment_id, row.provenance_id == use.provenance_id)
        .scalar_subquery()
    )
    rows = session.execute(
        select(fact.id, use.since, claimed, fact.facts)
        .join(fact, fact.id == use.provenance_id)
        .where(use.experiment_id == experiment_id)
        .order_by(use.since, fact.id)
    )
    return tuple(
        ProvenanceUse(id=id_, since=since, repetitions=count, provenance=Provenance.model_validate(facts))
        for id_, since, count, facts in rows
    )
