"""Events of experiments, and steps of their logs, as sentences."""

from collections.abc import Mapping
from typing import Any

from gaplab.schemas.events import EventKind
from gaplab.services.findings.wording import number

Body = Mapping[str, Any]

TAGS = {"tags": "set", "add_tags": "added", "remove_tags": "removed"}
"""What an edit did to tags, by the field of its event that names them."""

CHANNELS = {"webhook": "service's webhook", "own_webhook": "webhook of its own"}

SENTENCES = {
    EventKind.SUBMITTED: "Submitted, with {repetitions:,} repetitions",
    EventKind.IMPORTED: "Imported from an archive",
    EventKind.STARTED: "Started",
    EventKind.WAITING: "Waiting for measurements of the robot on the bench",
    EventKind.PAUSING: "Pausing: {reason_or_end}",
    EventKind.PAUSED: "Paused",
    EventKind.RESUMED: "Resumed",
    EventKind.STOPPING: "Stopping: running repetitions finish their step",
    EventKind.EXTENDED: "Extended to {iterations:,} iterations, {repetitions:,} repetitions",
    EventKind.RETRIED: "Retried",
    EventKind.COMPLETED: "Completed",
    EventKind.FAILED: "Failed",
    EventKind.CANCELLED: "Cancelled",
    EventKind.EDITED: "Edited: {edits}",
    EventKind.ARCHIVED: "Archived: lists leave it out",
    EventKind.UNARCHIVED: "Listed again",
    EventKind.DELETED: "Deleted: {name}",
    EventKind.NOTIFIED: "Told {whom} of the end of the {of}",
    EventKind.NOTIFICATION_FAILED: "Could not tell {whom} of the end of the {of}: {reason}; {again}",
    EventKind.SENSITIVITY_ENDED: "Sensitivity check {ended}",
    EventKind.VERSIONS_REFUSED: "Refused by a supervisor {unlike}",
    EventKind.VERSIONS_ACCEPTED: "Other versions were accepted: it continues under them",
    EventKind.REPETITION_CLAIMED: "{which} {begins}",
    EventKind.REPETITION_COMPLETED: "{which} completed",
    EventKind.REPETITION_FAILED: "{which} failed{why}",
    EventKind.REPETITION_LOST: "{which} lost its worker, and is queued again{why}",
    EventKind.REPETITION_HANDED_BACK: "{which} was handed back{why}",
    EventKind.REPETITION_WAITS: "{which} waits for a measurement",
    EventKind.REPETITION_PAUSED: "{which} paused",
    EventKind.REPETITION_STOPPED: "{which} stopped",
    EventKind.REPETITION_CANCELLED: "{which} cancelled",
    EventKind.REQUESTED: "{step}: a measurement of the {controller} is requested",
    EventKind.REFUSED: "{step}: refused before it was offered{why}",
    EventKind.TAKEN: "{step}: taken by {operator}",
    EventKind.RELEASED: "{step}: given back by {giver} without an answer{taken}",
    EventKind.TAKE_EXPIRED: "{step}: {operator} sent no heartbeat, so the measurement is open again",
    EventKind.CONFLICTING: "{step}: an answer by {operator} is in conflict, to be decided",
    EventKind.CORRECTED: "{step}: the measurement by {operator} was corrected{by_whom}{why}",
    EventKind.VOIDED: "{step}: the measurement by {operator} is void{says}{why}",
    EventKind.DECIDED: "{step}: {decided} about the answer by {operator}{why}",
    EventKind.SELECTED: "{step}: selected a controller to try in reality",
    EventKind.MEASURED: "{step}: {measured}",
    EventKind.TUNED: "{step}: {tuned}",
    EventKind.TRANSFERRED: "{step}: controller evolved, {reached} in simulation",
    EventKind.PROBED: "{step}: {probed}",
}
"""Sentences of events, with fields of their bodies and of `_parts`."""


def event_sentence(kind: EventKind, repetition: int | None, body: Body) -> str:
    """Return an event in words; one whose body lacks what its sentence needs is called by its kind."""
    which = f"Repetition {repetition}"
    places = {"which": which, "step": f"{which}, iteration {body.get('iteration')}"}
    try:
        return SENTENCES[kind].format_map({**body, **_parts(body), **places})
    except (KeyError, TypeError, ValueError):  # an imported event may have any body
        return kind.value.replace("_", " ")


def step_sentence(step: Body, repetition: int) -> str:
    """Return a step of a closed branch in the words of its event, with the repeats of its measurement."""
    best: Body = (step.get("simulators") or ({},))[0]
    repeats = f" ({', '.join(map(number, step['repeats']))})" if step.get("repeats") else ""
    return event_sentence(EventKind(step["kind"]), repetition, {**best, **step}) + repeats


def _parts(body: Body) -> dict[str, str]:
    """Return parts of sentences that depend on what a body has; a robot fails for other reasons than physics."""
    by, operator, reason = body.get("by"), body.get("operator"), body.get("reason")
    why = f": {reason}" if reason else ""
    fitness, simulated, error = body.get("fitness"), body.get("simulated_fitness"), body.get("squared_error")
    reached = "failed in reality" if fitness is None else f"the controller reaches {number(fitness)} in reality"
    return {
        "why": why,
        "reason_or_end": reason or "running repetitions finish their step",
        "edits": _edits(body),
        "whom": f"the {CHANNELS.get(str(body.get('channel')), body.get('channel'))}",
        "again": f"again in {body['again_in_s']} s" if body.get("again_in_s") else "given up",
        "ended": f"{body.get('state')}".lower() + (f": {' '.join(body['warnings'])}" if body.get("warnings") else ""),
        "unlike": _unlike(f"{body.get('refused_by')}", body),
        "begins": f"continues after {body['steps']:,} steps" if body.get("steps") else "begins",
        "controller": "transferred controller" if body.get("kind") == "probe" else "sample",
        "giver": f"{by or operator}",
        "taken": f", taken by {operator}{why}" if why else "",
        "by_whom": f" by {by}" if by else "",
        "says": f", says {by}" if by else "",
        "decided": f"{by} decided" if by else "decided",
        "measured": "failed in reality" if fitness is None else f"measured in reality, {number(fitness)}",
        "tuned": f"simulators tuned, sum of squared errors {'unknown' if error is None else number(error)}"
        if "squared_error" in body
        else "nothing to tune simulators on",
        "reached": "the physics failed" if simulated is None else f"reaching {number(simulated)}",
        "probed": "the controller is not measured, as the spec says" if body.get("left_out") else reached,
    }


def _edits(body: Body) -> str:
    """Return the fields that an edit changed: tags by their names, where the event has them."""
    named = [
        f"{did} the tag{'' if len(body[field]) == 1 else 's'} {', '.join(body[field])}"
        for field, did in TAGS.items()
        if body.get(field)
    ]
    others = [field for field in body.get("fields", ()) if not (named and field in TAGS)]
    return "; ".join(filter(None, [", ".join(others).replace("_", " "), *named]))


def _unlike(refused_by: str, body: Body) -> str:
    if "(unavailable: " in refused_by:
        return f"that cannot use its plug-ins: {refused_by}"
    return f"with other versions: {refused_by}, not {body.get('computed_with')}"
