"""Files that belong to answers, like a trace or a photograph: stored once each, under the hash of their content."""

from hashlib import sha256

from sqlalchemy import update

from gaplab.schemas.measurements import AttachmentRead
from gaplab.services.core.errors import InvalidSpec, LimitReached, Violation
from gaplab.services.settings import variable_of
from gaplab.services.store.clock import now
from gaplab.services.store.models import AttachmentRow
from gaplab.services.store.queries import attachments
from gaplab.services.store.queries.attachments import MOST_BYTES
from gaplab.services.store.session import Session, snapshot, transaction
from gaplab.services.store.statements import existing, insert_new, storable


@transaction
def store_attachment(
    session: Session, content: bytes, name: str, media_type: str, most_unnamed: int | None = None
) -> AttachmentRead:
    """Store a file, unless it is stored already, and return its hash.

    Sending it again keeps it as long as a new one, until an answer names it. All that no answer names have at most
    `most_unnamed` bytes; None for no limit.

    Raises:
        InvalidSpec: it is empty or too large.
        LimitReached: too many bytes wait for an answer that names them; the message names the limit.
    """
    if not 0 < len(content) <= MOST_BYTES:
        message = f"an attachment has 1 to {MOST_BYTES:,} bytes, not {len(content):,}"
        raise InvalidSpec([Violation("", f"{len(content):,} bytes", message, f"at most {MOST_BYTES:,} bytes")])
    digest = sha256(content).hexdigest()
    values = {"id": digest, "name": storable(name), "media_type": storable(media_type), "content": content}
    session.execute(insert_new(session, AttachmentRow).values(**values, created_at=now()))
    session.execute(update(AttachmentRow).where(AttachmentRow.id == digest).values(created_at=now()))
    attachments.remove_unnamed(session, ())
    if most_unnamed is not None and (size := attachments.unnamed_bytes(session)) > most_unnamed:
        permitted = f"at most {most_unnamed:,} are permitted ({variable_of('unnamed_attachment_bytes')})"
        msg = f"with this file, those that no answer names have {size:,} bytes; {permitted}: send answers first"
        raise LimitReached(msg)
    return AttachmentRead(id=digest, name=name, media_type=media_type, size=len(content))


@snapshot
def read_attachment(session: Session, digest: str) -> tuple[AttachmentRead, bytes]:
    """Return a stored file.

    Raises:
        NotFound: none has this hash.
    """
    row = existing(session, AttachmentRow, digest, "attachment")
    return AttachmentRead(id=row.id, name=row.name, media_type=row.media_type, size=len(row.content)), row.content
