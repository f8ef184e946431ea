"""Provenance: recorded with the claims of supervisors, and what it forbids them to claim.

An experiment keeps what its first steps were computed with: its engines with their libraries, the machine's
architecture, the version of the spec, its plug-ins from outside gaplab. A supervisor that has another of these leaves
it alone until a person accepts it.
"""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from typing import Any, TypeAlias

from sqlalchemy import ColumnElement, func, select, update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.provenance import Provenance, ProvenanceRead, ProvenanceUse
from gaplab.services.core.errors import Conflict
from gaplab.services.store.lease import Claim
from gaplab.services.store.models import ExperimentProvenanceRow, ExperimentRow, ProvenanceRow, RepetitionRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import get_experiment, lock

_Insert: TypeAlias = Callable[..., postgresql.Insert | sqlite.Insert]
_INSERT: dict[str, _Insert] = {"sqlite": sqlite.insert, "postgresql": postgresql.insert}


def id_of(under: Provenance) -> str:
    """The id of a provenance: it follows from the facts; that there are no plug-ins from outside is none."""
    none = {name for name in ("plugins", "outside") if not getattr(under, name)}
    facts = under.model_dump(mode="json", exclude=none)
    return sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:16]


def decisive(under: Provenance, spec: Mapping[str, Any]) -> str:
    """What of it two supervisors must have in common to go on with the same experiment."""
    engines = (_engine(under, each) for each in sorted(_engines(spec)))
    outside = (_outside(under, each) for each in _others(spec) if each in under.outside)
    return ", ".join([*engines, *_machine(under), *outside])


def permitted(session: Session, under: Provenance) -> ColumnElement[bool]:
    """That an experiment may be claimed under this: it has not begun, or with the same; and its spec can be read."""
    row = ExperimentRow
    begun = row.claimable.is_(True) & row.computed_with.is_not(None)
    found = session.scalars(select(row.computed_with).where(begun).distinct())
    same = row.computed_with.in_([each for each in found if each is not None and _holds(each, under)])
    return (row.spec_version <= under.spec_version) & (row.computed_with.is_(None) | same)


def record(session: Session, under: Provenance, claims: Sequence[Claim]) -> None:
    """That these were claimed under it; experiments that begin are bound to it from now on. They are locked."""
    if not claims:
        return
    id_, insert = id_of(under), _INSERT[session.get_bind().dialect.name]
    specs = {each.experiment_id: each.spec.model_dump(mode="json") for each in claims}
    insert_unless_there(session, [{"id": id_, "facts": under.model_dump(mode="json")}])
    uses = [{"experiment_id": each, "provenance_id": id_} for each in specs]
    session.execute(insert(ExperimentProvenanceRow).values(uses).on_conflict_do_nothing())
    for experiment, spec in specs.items():
        _bind(session, experiment, decisive(under, spec))
    row = RepetitionRow
    session.execute(update(row).where(row.id.in_([each.repetition_id for each in claims])).values(provenance_id=id_))
    for each in claims:
        told = {"epoch": each.epoch, "steps": len(each.log), "provenance": id_}
        note(session, EventKind.REPETITION_CLAIMED, each.experiment_id, each.number, **told)


def insert_unless_there(session: Session, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add these provenances; one that is there has the same facts."""
    insert = _INSERT[session.get_bind().dialect.name]
    session.execute(insert(ProvenanceRow).on_conflict_do_nothing(), [dict(each) for each in rows])


def refuse(session: Session, under: Provenance) -> int:
    """Say of each experiment that waits and may not be claimed under this why that is, once; how many they were."""
    row = ExperimentRow
    waiting = (
        row.claimable.is_(True) & row.refused_by.is_(None) & row.computed_with.is_not(None) & ~permitted(session, under)
    )
    found = session.execute(select(row.id, row.spec, row.computed_with).where(waiting).order_by(row.id)).all()
    for experiment, spec, before in found:
        theirs = decisive(under, spec)
        new = update(row).where(row.id == experiment, row.refused_by.is_(None)).values(refused_by=theirs)
        if session.execute(new.returning(row.id)).first() is not None:
            note(session, EventKind.VERSIONS_REFUSED, experiment, computed_with=before, refused_by=theirs)
    return len(found)


def accept(session: Session, experiment_id: str) -> ExperimentRow:
    """The experiment goes on under whatever the next supervisor has, and is bound to that.

    Raises:
        NotFound: no such experiment.
        Conflict: it has ended, or has not begun.
    """
    experiment = get_experiment(session, experiment_id)
    lock(session, [experiment_id])
    session.refresh(experiment)
    if experiment.state.ended or experiment.computed_with is None:
        why = f"has ended: it is {experiment.state}" if experiment.state.ended else "has not begun under any versions"
        msg = f"experiment {experiment_id!r} {why}; nothing is to accept"
        raise Conflict(msg)
    told = {"computed_with": experiment.computed_with, "refused_by": experiment.refused_by}
    note(session, EventKind.VERSIONS_ACCEPTED, experiment_id, **told)
    experiment.computed_with = experiment.refused_by = None
    session.flush()
    return experiment


def read(session: Session, experiment_id: str) -> ProvenanceRead:
    """Under what the experiment was computed, in the order of its beginnings.

    Raises:
        NotFound: no such experiment.
    """
    experiment = get_experiment(session, experiment_id)
    return ProvenanceRead(
        computed_with=experiment.computed_with, refused_by=experiment.refused_by, uses=_uses(session, experiment_id)
    )


def _uses(session: Session, experiment_id: str) -> tuple[ProvenanceUse, ...]:
    use, fact, row = ExperimentProvenanceRow, ProvenanceRow, RepetitionRow
    claimed = (
        select(func.count())
        .where(row.experiment_id == use.experiment_id, row.provenance_id == use.provenance_id)
        .scalar_subquery()
    )
    found = session.execute(
        select(fact.id, use.since, claimed, fact.facts)
        .join(fact, fact.id == use.provenance_id)
        .where(use.experiment_id == experiment_id)
        .order_by(use.since, fact.id)
    )
    return tuple(
        ProvenanceUse(id=id_, since=since, repetitions=count, provenance=Provenance.model_validate(facts))
        for id_, since, count, facts in found
    )


def _bind(session: Session, experiment: str, to: str) -> None:
    row = ExperimentRow
    unbound = update(row).where(row.id == experiment, row.computed_with.is_(None))
    session.execute(unbound.values(computed_with=to, refused_by=None))


def _holds(text: str, under: Provenance) -> bool:
    """Whether each of the parts of what `decisive` says is so under this."""
    true = [*(_engine(under, each) for each in under.engines), *_machine(under)]
    part = "|".join(map(re.escape, [*true, *(_outside(under, each) for each in under.outside)]))
    return re.fullmatch(rf"(?:{part})(?:, (?:{part}))*", text) is not None


def _engine(under: Provenance, name: str) -> str:
    return f"{name} ({under.engines.get(name, 'none')})"


def _machine(under: Provenance) -> tuple[str, str]:
    return under.architecture, f"spec {under.spec_version}"


def _outside(under: Provenance, which: str) -> str:
    return f"{which} ({under.outside[which]})"


def _engines(spec: Mapping[str, Any]) -> set[str]:
    """The engine of the simulators, and that of reality."""
    chosen = (spec.get("engine"), spec["reality"].get("engine"))
    return {each["name"] for each in chosen if each}


def _others(spec: Mapping[str, Any]) -> list[str]:
    """Its plug-ins of the other kinds, each as a provenance calls it."""
    single = [f"{kind} {spec[kind]['name']}" for kind in ("strategy", "robot", "optimizer")]
    return [*single, *(f"tunable {each['name']}" for each in spec["tunables"])]
