"""Names, notes and tags, changed after submission."""

from collections.abc import Collection
from typing import Any

from sqlalchemy import update

from gaplab.schemas.editing import MOST_TAGS, Edit
from gaplab.schemas.events import EventKind
from gaplab.schemas.records import StudyRead
from gaplab.services.core.errors import Conflict, InvalidSpec, Violation
from gaplab.services.experiments.views import view
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import Members, lock, members, whole
from gaplab.services.store.session import Session, transaction
from gaplab.services.store.texts import pack_tags, storable, unpack_tags


class Changed(Conflict):
    """The object has changed since the client read it."""

    kind, title = "changed", "It was changed in the meantime"


@transaction
def edit(session: Session, id_: str, change: Edit, *, starting_from: Collection[int] | None) -> StudyRead:
    """Change a study's name, notes or tags; with the id of one of its experiments, the name of that.

    A study of one has one name with its experiment. Specs stay as they were submitted.

    Args:
        session: a transaction.
        id_: id of a study, or of one of its experiments.
        change: what changes.
        starting_from: protects another person's edit: the change is refused unless the present number of edits is in
            it; None permits any number. Progress does not count.

    Raises:
        NotFound: no such study or experiment.
        Conflict: notes or tags of one experiment among others.
        Changed: it was edited meanwhile.
        InvalidSpec: it would have too many tags.
        StoreUnavailable: the database cannot be used now.
    """
    found = members(session, id_) if change.model_fields_set == {"name"} else whole(session, id_)
    study, row = found.study, StudyRow
    lock(session, found.ids)
    session.refresh(study, with_for_update={"key_share": True})
    if starting_from is not None and study.edits not in starting_from:
        raise Changed(f"{study.id!r} was changed by someone else since you read it; read it again, and then decide")
    values, told = _changes(found, change)
    if told:
        if "name" in values and len(found.experiments) == 1:
            renamed = update(ExperimentRow).where(ExperimentRow.id == found.ids[0])
            session.execute(renamed.values(name=values["name"]))
            session.refresh(found.experiments[0])
        if found.one is not None:
            values = {}
        session.execute(update(row).where(row.id == study.id).values(values | {"edits": row.edits + 1}))
        session.refresh(study)
        for experiment in found.ids:
            note(session, EventKind.EDITED, experiment, **told)
    return view(session, found)[0]


def _changes(found: Members, change: Edit) -> tuple[dict[str, Any], dict[str, list[str]]]:
    """Return the columns that differ, and an event's body: the fields, and tags that are new or gone."""
    before, after = set(unpack_tags(found.study.tags)), _tags_after(found.study, change)
    given = change.model_dump(exclude_unset=True, include={"name", "notes"})
    texts = {name: None if value is None else storable(value) for name, value in given.items()}
    present = {"name": found.named.name, "notes": found.study.notes}
    values: dict[str, Any] = {name: text for name, text in texts.items() if text != present[name]}
    told = {"add_tags": sorted(after - before), "remove_tags": sorted(before - after)}
    if after != before:
        values["tags"] = pack_tags(after)
    changed = {"fields": sorted(values)} if values else {}
    return values, changed | {name: tags for name, tags in told.items() if tags}


def _tags_after(study: StudyRow, change: Edit) -> set[str]:
    """Return the tags after the edit.

    Raises:
        InvalidSpec: there would be too many.
    """
    given = set(unpack_tags(study.tags)) if change.tags is None else set(change.tags)
    tags = (given | set(change.add_tags)) - set(change.remove_tags)
    if len(tags) > MOST_TAGS:
        message = f"it would have {len(tags)} tags; permitted: at most {MOST_TAGS}. Remove some with `remove_tags`"
        raise InvalidSpec([Violation("/add_tags", change.add_tags, message)])
    return tags
