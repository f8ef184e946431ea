"""Metrics, for whoever watches the service."""

from fastapi import APIRouter, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest

from gaplab.api.http.metrics import Metrics
from gaplab.api.http.problems import documented

router = APIRouter(tags=["health"])

EXAMPLE = '# TYPE gaplab_repetitions gauge\ngaplab_repetitions{state="RUNNING"} 2.0\n'


@router.get(
    "/metrics",
    summary="Read metrics",
    response_class=Response,
    responses={
        200: {
            "description": "In the text format of Prometheus",
            "content": {"text/plain": {"schema": {"type": "string"}, "example": EXAMPLE}},
        },
        **documented(),
    },
)
def read_metrics(request: Request) -> Response:
    """Requests and their latency, what the database holds by state, event streams, when a supervisor was heard of."""
    metrics: Metrics = request.app.state.metrics
    return Response(generate_latest(metrics.registry), media_type=CONTENT_TYPE_LATEST)
