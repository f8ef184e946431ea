"""Names, notes and tags, changed after submission. Each function is one transaction, and raises StoreUnavailable.

`starting_from` protects another person's edit: the change is refused unless the present number of edits is in it.
None permits any number. Progress is no edit.
"""

from collections.abc import Collection
from typing import Any

from sqlalchemy import update

from gaplab.schemas.editing import MOST_TAGS, Edit
from gaplab.schemas.events import EventKind
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.services.core.errors import Changed, InvalidSpec, Violation
from gaplab.services.experiments.views import view_experiments, view_studies
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import experiments_of, get_experiment, get_study
from gaplab.services.store.session import Session, transaction
from gaplab.services.store.texts import pack_tags, storable, unpack_tags


@transaction
def edit_experiment(
    session: Session, experiment_id: str, edit: Edit, *, starting_from: Collection[int] | None
) -> ExperimentRead:
    """Change the experiment's name, notes or tags; its spec stays as it was submitted.

    Raises:
        NotFound: no such experiment.
        Changed: it was edited meanwhile.
    """
    row = get_experiment(session, experiment_id)
    if told := _edit(session, row, edit, starting_from):
        note(session, EventKind.EDITED, row.id, **told)
    return view_experiments(session, [row])[0]


@transaction
def edit_study(session: Session, study_id: str, edit: Edit, *, starting_from: Collection[int] | None) -> StudyRead:
    """Change the study's name, notes or tags; its experiments keep theirs.

    Raises:
        NotFound: no such study.
        Changed: it was edited meanwhile.
    """
    row = get_study(session, study_id)
    if told := _edit(session, row, edit, starting_from):
        for experiment in experiments_of(session, [row.id]):
            note(session, EventKind.EDITED, experiment.id, **told, of_study=True)
    return view_studies(session, [row])[0]


def _edit(
    session: Session, row: ExperimentRow | StudyRow, edit: Edit, starting_from: Collection[int] | None
) -> dict[str, list[str]]:
    """Change what differs, and return it as an event's body: the fields, and tags that are new or gone."""
    table = type(row)
    session.refresh(row, with_for_update={"key_share": True})
    if starting_from is not None and row.edits not in starting_from:
        raise Changed(f"{row.id!r} was changed by someone else since you read it; read it again, and then decide")
    before, after = set(unpack_tags(row.tags)), _tags_after(row, edit)
    values = {name: text for name, text in _texts(edit).items() if text != getattr(row, name)}
    told = {"fields": sorted([*values, *(["tags"] if after != before else [])])}
    if not told["fields"]:
        return {}
    values |= {"edits": table.edits + 1, "tags": pack_tags(after)}
    session.execute(update(table).where(table.id == row.id).values(values))
    session.refresh(row)
    changes = {"add_tags": sorted(after - before), "remove_tags": sorted(before - after)}
    return told | {name: tags for name, tags in changes.items() if tags}


def _texts(edit: Edit) -> dict[str, Any]:
    changes = edit.model_dump(exclude_unset=True, include={"name", "notes"})
    return {name: storable(value) if value is not None else None for name, value in changes.items()}


def _tags_after(row: ExperimentRow | StudyRow, edit: Edit) -> set[str]:
    """Return the tags after the edit.

    Raises:
        InvalidSpec: there would be too many.
    """
    given = set(unpack_tags(row.tags)) if edit.tags is None else set(edit.tags)
    tags = (given | set(edit.add_tags)) - set(edit.remove_tags)
    if len(tags) > MOST_TAGS:
        message = f"it would have {len(tags)} tags; permitted: at most {MOST_TAGS}. Remove some with `remove_tags`"
        raise InvalidSpec([Violation("/add_tags", edit.add_tags, message)])
    return tags
