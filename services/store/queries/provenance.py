"""Provenances: each is stored once, under a hash of its facts."""

import json
from collections.abc import Mapping, Sequence
from hashlib import sha256
from typing import Any

from sqlalchemy.orm import Session

from gaplab.schemas.provenance import Provenance
from gaplab.services.store.models import ProvenanceRow
from gaplab.services.store.statements import insert_new


def id_of(provenance: Provenance) -> str:
    """Return the id of a provenance: a hash of its facts."""
    return sha256(json.dumps(provenance.model_dump(mode="json"), sort_keys=True).encode()).hexdigest()[:16]


def insert_unless_there(session: Session, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add provenances whose ids are new; an equal id means equal facts."""
    session.execute(insert_new(session, ProvenanceRow), [dict(row) for row in rows])
