"""What people change about studies beside their work: names, notes, tags, the archive, and deletion.

Lists leave out an archived study; nothing else about it changes. Deletion takes all results. What a study shares with
others stays: provenances and sensitivity checks, which are about machines and robots, and files that answers of others
name. Events stay too, because their numbers have no gaps; the last one says that the experiment was deleted.

Notes are Markdown, rendered as HTML that is safe on a page. HTML in them is shown as text. Addresses lead to http,
https and mailto alone, and images are links: a note makes no reader's browser send a request.

Use cases raise NotFound if nothing has the id.
"""

from collections.abc import Collection, MutableMapping
from dataclasses import dataclass
from functools import cache
from typing import Any
from urllib.parse import urlsplit

from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token
from markdown_it.utils import OptionsDict
from sqlalchemy import delete as delete_from
from sqlalchemy import or_, select, update

from gaplab.schemas.editing import MOST_TAGS, DeletionRead, Edit, NotesRead
from gaplab.schemas.events import EventKind
from gaplab.schemas.records import StudyRead
from gaplab.services.core.errors import Conflict, Forbidden, InvalidSpec, Violation
from gaplab.services.experiments.views import view
from gaplab.services.store.clock import moment, now
from gaplab.services.store.models import (
    AnswerRow,
    AttemptRow,
    Base,
    BranchRow,
    CheckpointRow,
    DeletionRow,
    ExperimentProvenanceRow,
    ExperimentRow,
    RepetitionRow,
    RequestRow,
    StepRow,
    StudyRow,
)
from gaplab.services.store.queries import attachments
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import Members, lock, members, whole
from gaplab.services.store.session import Session, snapshot, transaction
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
        Conflict: notes or tags of one experiment among others.
        Changed: it was edited meanwhile.
        InvalidSpec: it would have too many tags.
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


@transaction
def archive(session: Session, id_: str, *, archived: bool = True) -> StudyRead:
    """Archive a study once all of its experiments have ended, or undo that; doing it twice changes nothing.

    Raises:
        Conflict: an experiment of it has not ended, or the id is that of one of its experiments.
    """
    found = whole(session, id_)
    states = lock(session, found.ids)
    if archived and (open_ := sorted({state.value for state in states.values() if not state.ended})):
        msg = f"{found} is {' and '.join(open_)} and cannot be archived: wait for its end, or cancel it first"
        raise Conflict(msg)
    _archive(session, found, archived=archived)
    return view(session, found)[0]


def show_again(session: Session, experiment: ExperimentRow) -> None:
    """Undo the archiving of the study of an experiment that is computed again: work must not be hidden."""
    _archive(session, members(session, experiment.study_id), archived=False)


def _archive(session: Session, found: Members, *, archived: bool) -> None:
    """Note since when a study is archived, or that it is not any more."""
    row, study = StudyRow, found.study
    missing = row.archived_at.is_(None) if archived else row.archived_at.is_not(None)
    moved = update(row).where(row.id == study.id, missing).values(archived_at=now() if archived else None)
    if session.scalar(moved.returning(row.id)) is not None:
        session.refresh(study)
        for id_ in sorted(found.ids):
            note(session, EventKind.ARCHIVED if archived else EventKind.UNARCHIVED, id_)


_OF_REPETITIONS: tuple[type[Base], ...] = (
    AnswerRow,
    RequestRow,
    BranchRow,
    StepRow,
    CheckpointRow,
    AttemptRow,
)
"""Tables of results, each before the tables that it refers to."""


_SQL = {"synchronize_session": False}


@dataclass(frozen=True)
class Deleter:
    """Who deletes: the id of its token, or None, and whether it may delete what others have submitted."""

    token: str | None
    may_delete_all: bool = False


@transaction
def delete(session: Session, id_: str, by: Deleter) -> DeletionRead:
    """Delete a study, or one experiment of it, with its results; doing it twice changes nothing, and returns the same.

    The last experiment of a study takes the study with it.

    Raises:
        NotFound: no such study or experiment, and none was deleted.
        Forbidden: others have submitted it.
        Conflict: it has not ended, or still holds hardware.
    """
    _lock_all(session, id_)
    if before := session.get(DeletionRow, storable(id_)):
        return _view_deletion(before)
    found = members(session, id_)
    _delete(session, found, by)
    buried = {row.id: _bury(session, row, found.study.id, by) for row in found.experiments}
    if found.one is None:
        session.execute(delete_from(StudyRow).where(StudyRow.id == found.study.id), execution_options=_SQL)
        if found.study.id not in buried:
            buried[found.study.id] = _bury(session, found.study, None, by)
    return buried[id_]


def _lock_all(session: Session, id_: str) -> None:
    """Lock the experiments of a study, or an experiment with all others of its study.

    What is read later in the transaction counts no experiment that another transaction deletes at the same time.
    """
    row, named = ExperimentRow, storable(id_)
    study = select(row.study_id).where(row.id == named).scalar_subquery()
    which = or_(row.id == named, row.study_id == named, row.study_id == study)
    lock(session, session.scalars(select(row.id).where(which)).all())


def _delete(session: Session, found: Members, by: Deleter) -> None:
    """Delete experiments with all rows that belong to them alone.

    Raises:
        Forbidden: the deleter may not.
        Conflict: one has not ended, or still holds hardware.
    """
    if not by.may_delete_all and any(experiment.token_id != by.token for experiment in found.experiments):
        msg = f"{found} was submitted with another token: only that token, or an admin's, may delete it"
        raise Forbidden(msg)
    ids = found.ids
    states = lock(session, ids)
    if open_ := sorted({state.value for state in states.values() if not state.ended}):
        raise Conflict(f"{found} is {' and '.join(open_)} and cannot be deleted: cancel it first, and then delete it")
    row = RepetitionRow
    if session.scalar(select(row.id).where(row.experiment_id.in_(ids), row.hardware.is_not(None)).limit(1)):
        raise Conflict(f"{found} still holds hardware, whose worker is stopping: delete it in a moment")
    repetitions = select(row.id).where(row.experiment_id.in_(ids)).scalar_subquery()
    once_named = attachments.named(session, repetitions)
    for table in _OF_REPETITIONS:
        of_them = table.__table__.c.repetition_id.in_(repetitions)
        session.execute(delete_from(table).where(of_them), execution_options=_SQL)
    attachments.remove_unnamed(session, once_named)
    for table in (RepetitionRow, ExperimentProvenanceRow):
        session.execute(delete_from(table).where(table.experiment_id.in_(ids)), execution_options=_SQL)
    session.execute(delete_from(ExperimentRow).where(ExperimentRow.id.in_(ids)), execution_options=_SQL)


def _bury(session: Session, row: ExperimentRow | StudyRow, study: str | None, by: Deleter) -> DeletionRead:
    """Record that a row was deleted; the last event of an experiment says so too."""
    deleted = DeletionRow(id=row.id, study_id=study, name=row.name, token_id=by.token, deleted_at=moment(session))
    session.add(deleted)
    session.flush()
    if isinstance(row, ExperimentRow):
        note(session, EventKind.DELETED, row.id, name=row.name)
    return _view_deletion(deleted)


def _view_deletion(row: DeletionRow) -> DeletionRead:
    return DeletionRead(id=row.id, name=row.name, study=row.study_id, deleted_at=row.deleted_at)


_SCHEMES = {"http", "https", "mailto"}


@snapshot
def read_notes(session: Session, id_: str) -> NotesRead:
    """Return the notes of a study as HTML.

    Raises:
        Conflict: the id is that of one of its experiments.
    """
    return NotesRead(html=render(whole(session, id_).study.notes or ""))


def render(notes: str) -> str:
    """Return Markdown as HTML."""
    html: str = _markdown().render(notes)
    return html


@cache
def _markdown() -> MarkdownIt:
    markdown = MarkdownIt("js-default", {"html": False, "linkify": False, "maxNesting": 20}).disable("image")
    markdown.validateLink = _is_harmless  # type: ignore[method-assign, assignment]  # the library's documented way
    markdown.add_render_rule("link_open", _opened_link)
    return markdown


def _is_harmless(address: str) -> bool:
    """Return whether a link may lead to the address: a page elsewhere, or a place of the page itself."""
    try:
        parts = urlsplit(address.strip())
    except ValueError:
        return False
    return parts.scheme.lower() in _SCHEMES if parts.scheme else address.startswith("#")


def _opened_link(
    renderer: RendererHTML,
    tokens: list[Token],
    index: int,
    options: OptionsDict,
    env: MutableMapping[str, Any],
) -> str:
    """Return the opening tag of a link, which leaks no address and cannot reach the page."""
    token = tokens[index]
    if not str(token.attrGet("href") or "").startswith("#"):
        token.attrSet("rel", "noopener noreferrer nofollow")
        token.attrSet("target", "_blank")
    return renderer.renderToken(tokens, index, options, env)
