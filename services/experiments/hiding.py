"""Hiding of reality: when its parameters may be shown.

The experiments of a study share one reality, so an ended experiment stays hidden until all of its study have ended.
"""

from collections.abc import Sequence

from sqlalchemy.orm import Session

from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries.experiments import open_studies


def hidden(session: Session, experiments: Sequence[ExperimentRow]) -> frozenset[str]:
    """Return the ids of the experiments whose reality's parameters may not be shown yet."""
    open_ = open_studies(session, [row.study_id for row in experiments])
    return frozenset(row.id for row in experiments if row.study_id in open_)
