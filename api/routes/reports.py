"""Reports: a study as one document, with a verdict in words."""

from datetime import UTC, datetime
from importlib.metadata import version
from typing import Literal

from fastapi import APIRouter, Response
from pydantic import Field

from gaplab.api.http.dependencies import Asked, Id, RolloutProcessDep, StoreDep
from gaplab.api.http.documentation import sent
from gaplab.api.http.figures import in_turn
from gaplab.api.http.problems import documented
from gaplab.api.http.security_headers import page
from gaplab.api.routes.curves import MarginQuery
from gaplab.schemas.reports import VerdictRead
from gaplab.services.experiments import reading
from gaplab.services.reports.blocks import render_html
from gaplab.services.reports.content import facts_of, verdict_on
from gaplab.services.reports.document import report_of
from gaplab.services.reports.takehome import takehome_zip

router = APIRouter(tags=["reports"])

_FORMATS = "one HTML file without scripts, to read and to print; or JSON with the verdict alone"


class ReportQuery(MarginQuery):
    """The format of a report, and the margin of its verdict."""

    format: Literal["html", "json"] = Field("html", description=_FORMATS)


@router.get(
    "/studies/{id}/report",
    summary="Report on a study",
    response_model=VerdictRead,
    responses=sent({"text/html": "<!doctype html><html lang='en'>…"}, _FORMATS.capitalize()) | documented(429),
)
def report_study(id: Id, store: StoreDep, query: Asked[ReportQuery]) -> VerdictRead | Response:
    """Return verdict, curves, tests, simulators, sensitivity, cost, settings and provenance in one document.

    The verdict follows from rules that the report states: which strategies differ, and whether each curve still rises,
    or is flat since some iteration and not worth continuing. The id of one experiment gives the report on it alone.
    """
    study, margin = reading.read(store, id), query.chosen()
    if query.format == "json":
        return verdict_on(store, study, margin)
    report, at = report_of(facts_of(store, study, margin)), datetime.now(UTC)
    made = f"Made by gaplab {version('gaplab')} on {at:%Y-%m-%d at %H:%M} UTC, from what was stored by then."
    answer = page(in_turn(lambda: render_html(report, made)))
    answer.headers["Content-Disposition"] = f'inline; filename="gaplab-{report.id}-report.html"'
    return answer


@router.get(
    "/experiments/{id}/takehome",
    summary="Take home what an experiment found",
    response_class=Response,
    response_description="Files for programs, and the report",
    responses=sent({"application/zip": "PK…"}) | documented(409, 429),
)
def take_home(id: Id, store: StoreDep, process: RolloutProcessDep) -> Response:
    """Return the report, the best measured controller, the tuned simulator with its intervals, samples and provenance.

    The same results give the same bytes.
    """
    disposition = {"Content-Disposition": f'inline; filename="gaplab-{id}-takehome.zip"'}
    return Response(takehome_zip(store, process, id, in_turn), media_type="application/zip", headers=disposition)
