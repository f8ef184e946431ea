"""Robot files and pools. A process knows those of the experiments and checks that it loads."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import timedelta
from typing import Any

from sqlalchemy import event, func, select, update
from sqlalchemy.orm import QueryContext, Session

from gaplab.schemas.robots import FileKind
from gaplab.services.store.clock import now
from gaplab.services.store.models import FileRow, SensitivityRow
from gaplab.services.store.statements import insert_new
from gaplab.services.world import robot_library
from gaplab.services.world.robot_files import NamedFile


def learn(session: Session, specs: Iterable[Mapping[str, Any]]) -> None:
    """Let this process know the files that stored specs name, so that robots can be created without a store."""
    if unknown := robot_library.unknown(specs):
        texts = select(FileRow.text).where(FileRow.sha256.in_(unknown))
        robot_library.learn(session.connection().scalars(texts))


@event.listens_for(FileRow, "load")
def _learn(row: FileRow, _: object) -> None:
    robot_library.learn([row.text])


@event.listens_for(SensitivityRow, "load")
def _learn_robot_of(row: SensitivityRow, context: QueryContext) -> None:
    learn(context.session, [row.spec])


def newest(session: Session, kind: FileKind, name: str) -> FileRow | None:
    """Return the file that was stored last under a name; None if there is none."""
    order = FileRow.created_at.desc(), FileRow.sha256
    return session.scalar(select(FileRow).where(FileRow.kind == kind, FileRow.name == name).order_by(*order).limit(1))


def named(session: Session, kind: FileKind, name: str) -> FileRow | None:
    """Return the file with this hash, or the newest one with this name; None if there is none."""
    found = session.get(FileRow, name)
    return found if found is not None and found.kind is kind else newest(session, kind, name)


def all_(session: Session, kind: FileKind) -> list[FileRow]:
    """Return all files of a kind, by name, the newest of a name first."""
    order = FileRow.name, FileRow.created_at.desc(), FileRow.sha256
    return list(session.scalars(select(FileRow).where(FileRow.kind == kind).order_by(*order)))


def names(session: Session, kind: FileKind) -> tuple[str, ...]:
    """Return the names of all files of a kind, sorted."""
    return tuple(session.scalars(select(FileRow.name).where(FileRow.kind == kind).distinct().order_by(FileRow.name)))


def put(session: Session, file: NamedFile) -> FileRow:
    """Insert a file unless it is there, and return its row; it is the newest of its name now."""
    values = {"sha256": file.sha256, "kind": file.kind, "name": file.name, "text": file.text}
    session.execute(insert_new(session, FileRow).values(**values, created_at=now()))
    session.execute(update(FileRow).where(FileRow.sha256 == file.sha256).values(created_at=now()))
    return session.get_one(FileRow, file.sha256)


def insert_unless_there(session: Session, rows: Sequence[dict[str, Any]]) -> None:
    """Insert files; one that is there already stays as it is, and no name gets another meaning."""
    for row in rows:
        same = FileRow.kind == row["kind"], FileRow.name == row["name"]
        oldest = session.scalar(select(func.min(FileRow.created_at)).where(*same))
        at = now() if oldest is None else oldest - timedelta(microseconds=1)
        session.execute(insert_new(session, FileRow).values({"created_at": at} | row))
