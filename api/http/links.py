"""Links from an answer to further operations, in the OpenAPI document: generated clients and tests follow them."""

from typing import Any

FROM_STUDY = (
    "read_study",
    "edit_study",
    "export_study",
    "pause_study",
    "resume_study",
    "stop_study",
    "cancel_study",
    "retry_study",
    "schedule_study",
)
FROM_EXPERIMENT = (
    *FROM_STUDY,
    "read_experiment",
    "list_repetitions",
    "list_samples",
    "list_simulators",
    "read_misfit",
    "read_curve",
    "read_provenance",
)
FROM_CHECK = ("read_sensitivity",)


def leading_to(*operations: str) -> dict[str, Any]:
    """Return the part of a documented response that links to operations on its id."""
    return {
        "links": {name: {"operationId": name, "parameters": {"path.id": "$response.body#/id"}} for name in operations}
    }
