"""Links from an answer to further operations, in the OpenAPI document: generated clients and tests follow them."""

from typing import Any

FROM_EXPERIMENT = (
    "read_experiment",
    "list_repetitions",
    "list_samples",
    "list_simulators",
    "read_misfit",
    "read_curve",
    "edit_experiment",
    "read_provenance",
    "export_experiment",
    "pause_experiment",
    "resume_experiment",
    "stop_experiment",
    "cancel_experiment",
    "retry_experiment",
    "schedule_experiment",
)
FROM_STUDY = (
    "read_study",
    "read_study_curves",
    "edit_study",
    "export_study",
    "pause_study",
    "resume_study",
    "stop_study",
    "cancel_study",
    "retry_study",
)
FROM_CHECK = ("read_sensitivity",)


def leading_to(*operations: str) -> dict[str, Any]:
    """Return the part of a documented response that links to operations on its id."""
    return {
        "links": {name: {"operationId": name, "parameters": {"path.id": "$response.body#/id"}} for name in operations}
    }
