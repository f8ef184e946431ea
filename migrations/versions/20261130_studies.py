"""Every experiment has a study, which alone is named, described, tagged, archived and watched.

An experiment without a study gets one with its id. Notes and tags of an experiment among others go to its study.

Revision: 0005, after 0004.
"""

from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

KEPT = ("notes", "tags", "edits", "archived_at", "webhook")
ORDER = ["created_at", "position", "id"]
LISTED = (["name", "id"], ["strategy", "id"], ["state", *ORDER], ["strategy", *ORDER])
"""Columns of the indexes of lists of experiments."""

STUDY = sa.table("study", *map(sa.column, ("id", "notes", "tags")))
SENT = sa.table("notification", *map(sa.column, ("event", "subject_id", "channel")), sa.column("message", sa.JSON()))


def upgrade() -> None:
    """Give each experiment a study, and move what people wrote there."""
    _keep_what_people_wrote(op.get_bind())
    columns = ", ".join(("id", "name", *KEPT, "created_at"))
    op.execute(f"INSERT INTO study ({columns}) SELECT {columns} FROM experiment WHERE study_id IS NULL")  # noqa: S608
    op.execute("UPDATE experiment SET study_id = id WHERE study_id IS NULL")
    op.execute(
        "UPDATE deletion SET study_id = id WHERE study_id IS NULL "
        "AND id NOT IN (SELECT study_id FROM deletion WHERE study_id IS NOT NULL)"
    )
    _forget_kinds(op.get_bind())
    op.execute("DELETE FROM idempotency")  # its answers have other fields
    for name in [*map(_index, LISTED), "ix_experiment_study_id"]:
        op.drop_index(name, "experiment")
    with op.batch_alter_table("experiment") as table:
        table.alter_column("study_id", existing_type=sa.String(32), nullable=False)
        for name in KEPT:
            table.drop_column(name)
    op.create_index("ix_experiment_study_id_state", "experiment", ["study_id", "state"])
    op.execute("UPDATE view SET sort = '-created_at' WHERE sort LIKE '%strategy' OR sort LIKE '%state'")
    with op.batch_alter_table("view") as table:
        table.drop_column("shows")


def downgrade() -> None:
    """Let experiments have these columns again; their studies stay."""
    with op.batch_alter_table("view") as table:
        table.add_column(sa.Column("shows", sa.String(16), nullable=False, server_default="studies"))
    op.drop_index("ix_experiment_study_id_state", "experiment")
    with op.batch_alter_table("experiment") as table:
        table.alter_column("study_id", existing_type=sa.String(32), nullable=True)
        table.add_column(sa.Column("edits", sa.Integer(), nullable=False, server_default="0"))
        table.add_column(sa.Column("archived_at", sa.DateTime(timezone=True)))
        for name in ("notes", "tags", "webhook"):
            table.add_column(sa.Column(name, sa.Text()))
    op.create_index("ix_experiment_study_id", "experiment", ["study_id"])
    for columns in LISTED:
        op.create_index(_index(columns), "experiment", columns)


def _index(columns: list[str]) -> str:
    return f"ix_experiment_{'_'.join(columns)}"


def _keep_what_people_wrote(connection: sa.Connection) -> None:
    """Add the notes and tags of experiments among others to those of their studies."""
    found = connection.execute(
        sa.text(
            "SELECT study.id, study.notes, study.tags, e.name, e.notes AS more_notes, e.tags AS more_tags "
            "FROM experiment e JOIN study ON study.id = e.study_id "
            "WHERE e.notes IS NOT NULL OR e.tags IS NOT NULL ORDER BY study.id, e.position"
        )
    ).all()
    kept: dict[str, dict[str, Any]] = {}
    for row in found:
        study = kept.setdefault(row.id, {"notes": row.notes, "tags": row.tags})
        more = f"{row.name}: {row.more_notes}" if row.more_notes else None
        study["notes"] = "\n\n".join(filter(None, (study["notes"], more)))[:10_000] or None
        tags = {*(study["tags"] or "").split(), *(row.more_tags or "").split()}
        study["tags"] = f" {' '.join(sorted(tags)[:20])} " if tags else None
    for id_, values in kept.items():
        connection.execute(sa.update(STUDY).where(STUDY.c.id == id_).values(values))


def _forget_kinds(connection: sa.Connection) -> None:
    """Remove from messages that are left to send whether they are about a study or an experiment."""
    for event, subject, channel, message in connection.execute(sa.select(SENT)).all():
        which = (SENT.c.event == event) & (SENT.c.subject_id == subject) & (SENT.c.channel == channel)
        shorter = {name: value for name, value in message.items() if name != "kind"}
        connection.execute(sa.update(SENT).where(which).values(message=shorter))
