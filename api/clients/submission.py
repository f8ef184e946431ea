"""Specs for the service to run, estimate or check."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from gaplab.api.clients.confirmation import can_ask, confirm
from gaplab.api.clients.connection import CONFIRMED, Connection, segment
from gaplab.schemas.estimates import EstimateRead
from gaplab.schemas.records import StudyRead
from gaplab.schemas.sensitivity import SensitivityRead, SensitivitySpec
from gaplab.schemas.spec import ExperimentSpec, StudySpec

Spec = ExperimentSpec | StudySpec | Mapping[str, Any]

NOT_CHECKED = {"name", "strategy", "strategies", "direct_repetitions", "priority", "max_parallel"}
"""Fields of a spec that a sensitivity check does not have."""


class Submission:
    """Requests that send a spec; the service validates it."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def submit(self, spec: Spec, *, yes: bool = False) -> StudyRead:
        """Queue a study; a spec that names a `strategy`, and no `strategies`, makes a study of one experiment.

        In a terminal or a notebook, the estimated cost is shown first, and above an hour a person is asked. With `yes`,
        it is submitted without estimate and question, whatever it costs.

        Raises:
            NotSubmitted: the person declined.
        """
        return self.send(spec, confirm_cost=yes or (can_ask() and confirm(self.estimate(spec), input)))

    def send(self, spec: Spec, *, confirm_cost: bool = False) -> StudyRead:
        """Submit without estimate and question; the service refuses a high cost unless it is confirmed."""
        return self._connection.post(StudyRead, f"/studies{CONFIRMED if confirm_cost else ''}", _body(spec))

    def estimate(self, spec: Spec) -> EstimateRead:
        """Return the rollouts, the duration and the resolved specs of a study; nothing is stored."""
        return self._connection.post(EstimateRead, "/studies/estimate", _body(spec))

    def check(self, spec: Spec | SensitivitySpec, *, every_s: float = 0.5) -> SensitivityRead:
        """Return the effect of the tunables of a spec on fitness; the service computes it if it is not known yet.

        The spec is one of an experiment, a study or a check, which is asked for every `every_s` seconds until it ends.
        """
        body = {name: value for name, value in _body(spec).items() if name not in NOT_CHECKED}
        check = self._connection.post(SensitivityRead, "/sensitivity", body)
        while not check.state.ended:
            time.sleep(every_s)
            check = self._connection.get(SensitivityRead, f"/sensitivity/{segment(check.id)}")
        return check


def _body(spec: BaseModel | Mapping[str, Any]) -> dict[str, Any]:
    """Return a spec as JSON.

    Raises:
        TypeError: it is neither a mapping nor a model, like the name of a file.
    """
    if isinstance(spec, BaseModel):
        return spec.model_dump(mode="json", exclude_unset=True)
    if not isinstance(spec, Mapping):
        hint = "; read a file with json.loads(Path(…).read_text())" if isinstance(spec, str | Path) else ""
        raise TypeError(f"a spec is a dict, an ExperimentSpec or a StudySpec, not {spec!r:.100}{hint}")
    return dict(spec)
