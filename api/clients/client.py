"""A client of the service in Python: what the `gaplab` command is made of.

with Client("http://127.0.0.1:8000") as gaplab:
    study = gaplab.submit({"robot": "toy_function", "budget": "smoke"})
    gaplab.wait(study.id)
    curves = gaplab.curves([study.id])

Programs import it from `gaplab`.
"""

import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import httpx2
from pydantic import BaseModel

from gaplab.api.clients.archives import Archives
from gaplab.api.clients.connection import Connection
from gaplab.api.clients.errors import ExperimentFailed as ExperimentFailed
from gaplab.api.clients.errors import ExtraMissing as ExtraMissing
from gaplab.api.clients.errors import ServiceError as ServiceError
from gaplab.api.clients.errors import ServiceUnreachable as ServiceUnreachable
from gaplab.api.clients.figures import Figures
from gaplab.api.clients.frames import Frames
from gaplab.api.clients.history import History
from gaplab.api.clients.life_cycle import LifeCycle, part
from gaplab.api.clients.waiting import Waiting
from gaplab.schemas.curves import Comparison, Curve
from gaplab.schemas.editing import Edit
from gaplab.schemas.estimates import EstimateRead
from gaplab.schemas.misfit import MisfitRead
from gaplab.schemas.plugin import Catalogue
from gaplab.schemas.records import ExperimentRead, Page, RepetitionRead, StudyRead
from gaplab.schemas.sensitivity import SensitivityRead, SensitivitySpec
from gaplab.schemas.spec import ExperimentSpec, StudySpec

Spec = ExperimentSpec | StudySpec | Mapping[str, Any]

NOT_CHECKED = {"name", "strategy", "strategies", "direct_repetitions", "priority", "max_parallel"}
"""What a spec has beside the settings that a sensitivity check takes."""

MOST_CURVES = 100
"""Of one request: as many as the service gives at a time, in an address that is not too long for anybody."""


class Client(LifeCycle, Waiting, Frames, Figures, History, Archives, Connection):
    """A connection to a service.

    Args:
        url: of the service; left out: GAPLAB_URL, or this machine.
        token: to show; left out: GAPLAB_TOKEN, or none; "" for none.
        timeout_s: for which an answer is waited.
        transport: instead of the network, for tests.

    Every method raises ServiceError with the service's problem, or ServiceUnreachable.
    """

    def submit(self, spec: Spec) -> ExperimentRead | StudyRead:
        """Queue an experiment if the spec names a `strategy`, else a study; it is checked by the service."""
        body = _body(spec)
        if "strategy" in body and "strategies" not in body:
            return self._read(ExperimentRead, self._create("/experiments", body))
        return self._read(StudyRead, self._create("/studies", body))

    def estimate(self, spec: StudySpec | Mapping[str, Any]) -> EstimateRead:
        """Return the rollouts and the time that a study would take on the service's machine; nothing is stored."""
        return self._read(EstimateRead, self._patiently("POST", "/studies/estimate", json=_body(spec)))

    def experiment(self, id: str) -> ExperimentRead:
        """An experiment."""
        return self._read(ExperimentRead, self._get(f"/experiments/{part(id)}"))

    def study(self, id: str) -> StudyRead:
        """A study."""
        return self._read(StudyRead, self._get(f"/studies/{part(id)}"))

    def find(self, id: str) -> ExperimentRead | StudyRead:
        """The study of this id, or the experiment."""
        try:
            return self.study(id)
        except ServiceError as error:
            if error.problem.status != httpx2.codes.NOT_FOUND:
                raise
        return self.experiment(id)

    def experiments(self, **filters: str | int | None) -> Page[ExperimentRead]:
        """Experiments, the newest first; filters as in the API: limit, cursor, study, state, strategy, text, sort."""
        return self._read(Page[ExperimentRead], self._get("/experiments", **filters))

    def studies(self, **filters: str | int | None) -> Page[StudyRead]:
        """Studies, the newest first; filters as in the API: limit, cursor, state, strategy, text, sort."""
        return self._read(Page[StudyRead], self._get("/studies", **filters))

    def edit(self, id: str, edit: Edit) -> ExperimentRead | StudyRead:
        """A study or an experiment with a new name or notes, whatever they were before."""
        found = self.find(id)
        kind, noun = (StudyRead, "studies") if isinstance(found, StudyRead) else (ExperimentRead, "experiments")
        body, headers = edit.model_dump(exclude_unset=True), {"If-Match": "*"}
        return self._read(kind, self._request("PATCH", f"/{noun}/{part(id)}", json=body, headers=headers))

    def reveal(self, id: str) -> ExperimentRead:
        """An experiment with reality's parameters, ended or not; wants an admin's token."""
        return self._read(ExperimentRead, self._get(f"/experiments/{part(id)}", reveal="true"))

    def repetitions(self, id: str) -> tuple[RepetitionRead, ...]:
        """The repetitions of an experiment."""
        return self._read(tuple[RepetitionRead, ...], self._get(f"/experiments/{part(id)}/repetitions"))

    def misfit(self, id: str) -> MisfitRead:
        """How far an experiment's tuned simulators are from reality, and from each other."""
        return self._read(MisfitRead, self._get(f"/experiments/{part(id)}/misfit"))

    def check(self, spec: Spec | SensitivitySpec, *, every_s: float = 0.5) -> SensitivityRead:
        """What the tunables of a spec do to fitness: queued if that is not known yet, and waited for."""
        body = {name: value for name, value in _body(spec).items() if name not in NOT_CHECKED}
        check = self._read(SensitivityRead, self._create("/sensitivity", body))
        while not check.state.ended:
            time.sleep(every_s)
            check = self._read(SensitivityRead, self._get(f"/sensitivity/{part(check.id)}"))
        return check

    def curves(self, ids: Sequence[str]) -> tuple[Curve, ...]:
        """The curves of experiments, and of all experiments of studies, in this order."""
        return self.curves_of(self._experiments_of(ids))

    def curves_of(self, experiments: Sequence[str]) -> tuple[Curve, ...]:
        """The same of ids that are known to be of experiments: one request for each hundred."""
        answers = [self._get("/curves", experiment=some) for some in _by_hundreds(experiments)]
        return tuple(curve for answer in answers for curve in self._read(tuple[Curve, ...], answer))

    def curves_csv(self, ids: Sequence[str]) -> str:
        """The same as CSV."""
        parts = _by_hundreds(self._experiments_of(ids))
        first, *others = [self._get("/curves", experiment=some, format="csv").text for some in parts]
        return first + "".join(each.partition("\n")[2] for each in others)  # the heads of columns stand once

    def compare(self, experiments: Sequence[str], first: int, last: int) -> tuple[Comparison, ...]:
        """Every pair of experiments, at the counts of real-world evaluations from `first` to `last`, pooled."""
        answer = self._get("/comparisons", experiment=list(experiments), **{"from": first, "to": last})
        return self._read(tuple[Comparison, ...], answer)

    def catalogue(self) -> Catalogue:
        """The plug-ins of the service."""
        return self._read(Catalogue, self._get("/catalogue"))

    def _experiments_of(self, ids: Sequence[str]) -> list[str]:
        found = [self.find(each) for each in ids]
        return [one.id for each in found for one in (each.experiments if isinstance(each, StudyRead) else (each,))]


def _by_hundreds(experiments: Sequence[str]) -> Iterator[list[str]]:
    """The ids in parts that one request can ask for; none at all are a part, for the service to refuse."""
    for start in range(0, len(experiments) or 1, MOST_CURVES):
        yield list(experiments[start : start + MOST_CURVES])


def _body(spec: BaseModel | Mapping[str, Any]) -> dict[str, Any]:
    return spec.model_dump(mode="json", exclude_unset=True) if isinstance(spec, BaseModel) else dict(spec)
