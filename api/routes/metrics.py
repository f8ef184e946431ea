"""Metrics, for monitoring the service."""

from fastapi import APIRouter, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest

from gaplab.api.http.problems import Responses, documented

router = APIRouter(tags=["health"])

_EXAMPLE = '# TYPE gaplab_repetitions gauge\ngaplab_repetitions{state="RUNNING"} 2.0\n'
_TEXT: Responses = {200: {"content": {"text/plain": {"schema": {"type": "string"}, "example": _EXAMPLE}}}}


@router.get(
    "/metrics",
    summary="Read metrics",
    response_class=Response,
    response_description="In the text format of Prometheus",
    responses=_TEXT | documented(),
)
def read_metrics(request: Request) -> Response:
    """Return request counts and latency, stored experiments by state, open streams, and the supervisors' heartbeats."""
    return Response(generate_latest(request.app.state.metrics.registry), media_type=CONTENT_TYPE_LATEST)
