"""Specs for the service to run, estimate or check."""

import time
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from gaplab.api.clients.connection import Connection, segment
from gaplab.schemas.estimates import EstimateRead
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.schemas.sensitivity import SensitivityRead, SensitivitySpec
from gaplab.schemas.spec import ExperimentSpec, StudySpec

Spec = ExperimentSpec | StudySpec | Mapping[str, Any]

NOT_CHECKED = {"name", "strategy", "strategies", "direct_repetitions", "priority", "max_parallel"}
"""Fields of a spec that a sensitivity check does not have."""


class Submission:
    """Requests that send a spec; the service validates it."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def submit(self, spec: Spec) -> ExperimentRead | StudyRead:
        """Queue an experiment if the spec names a `strategy`, else a study."""
        body = _body(spec)
        if "strategy" in body and "strategies" not in body:
            return self._connection.post(ExperimentRead, "/experiments", body)
        return self._connection.post(StudyRead, "/studies", body)

    def estimate(self, spec: StudySpec | Mapping[str, Any]) -> EstimateRead:
        """Return the rollouts and the duration of a study on the service's machine; nothing is stored."""
        return self._connection.post(EstimateRead, "/studies/estimate", _body(spec))

    def check(self, spec: Spec | SensitivitySpec, *, every_s: float = 0.5) -> SensitivityRead:
        """Return the effect of the tunables of a spec on fitness; the service computes it if it is not known yet.

        Args:
            spec: spec of an experiment, a study or a sensitivity check.
            every_s: interval between requests until the check ends.
        """
        body = {name: value for name, value in _body(spec).items() if name not in NOT_CHECKED}
        check = self._connection.post(SensitivityRead, "/sensitivity", body)
        while not check.state.ended:
            time.sleep(every_s)
            check = self._connection.get(SensitivityRead, f"/sensitivity/{segment(check.id)}")
        return check


def _body(spec: BaseModel | Mapping[str, Any]) -> dict[str, Any]:
    return spec.model_dump(mode="json", exclude_unset=True) if isinstance(spec, BaseModel) else dict(spec)
