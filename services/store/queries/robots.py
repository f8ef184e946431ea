"""Robot files. A process knows the robots of the experiments and checks that it loads."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import timedelta
from typing import Any

from sqlalchemy import event, func, select, update
from sqlalchemy.orm import QueryContext, Session

from gaplab.schemas.plugin import PluginRef
from gaplab.services.store.clock import now
from gaplab.services.store.models import RobotRow, SensitivityRow
from gaplab.services.store.statements import insert_new
from gaplab.services.world import robot_library


def learn(session: Session, specs: Iterable[Mapping[str, Any]]) -> None:
    """Let this process know the robots that stored specs name, so that they can be created without a store."""
    if unknown := robot_library.unknown(PluginRef.model_validate(spec["robot"]) for spec in specs):
        texts = select(RobotRow.text).where(RobotRow.sha256.in_(unknown))
        robot_library.learn(session.connection().scalars(texts))


@event.listens_for(RobotRow, "load")
def _learn(row: RobotRow, _: object) -> None:
    robot_library.learn([row.text])


@event.listens_for(SensitivityRow, "load")
def _learn_robot_of(row: SensitivityRow, context: QueryContext) -> None:
    learn(context.session, [row.spec])


def newest(session: Session, name: str) -> RobotRow | None:
    """Return the robot that was stored last under a name; None if there is none."""
    order = RobotRow.created_at.desc(), RobotRow.sha256
    return session.scalar(select(RobotRow).where(RobotRow.name == name).order_by(*order).limit(1))


def all_(session: Session) -> list[RobotRow]:
    """Return all robots, by name, the newest of a name first."""
    order = RobotRow.name, RobotRow.created_at.desc(), RobotRow.sha256
    return list(session.scalars(select(RobotRow).order_by(*order)))


def names(session: Session) -> tuple[str, ...]:
    """Return the names of all robots, sorted."""
    return tuple(session.scalars(select(RobotRow.name).distinct().order_by(RobotRow.name)))


def put(session: Session, sha256: str, name: str, text: str) -> RobotRow:
    """Insert a robot file unless it is there, and return its row; it is the newest of its name now."""
    values = {"sha256": sha256, "name": name, "text": text}
    session.execute(insert_new(session, RobotRow).values(**values, created_at=now()))
    session.execute(update(RobotRow).where(RobotRow.sha256 == sha256).values(created_at=now()))
    return session.get_one(RobotRow, sha256)


def insert_unless_there(session: Session, rows: Sequence[dict[str, Any]]) -> None:
    """Insert robot files; one that is there already stays as it is, and no name gets another meaning."""
    for row in rows:
        oldest = session.scalar(select(func.min(RobotRow.created_at)).where(RobotRow.name == row["name"]))
        at = now() if oldest is None else oldest - timedelta(microseconds=1)
        session.execute(insert_new(session, RobotRow).values({"created_at": at} | row))
