"""Whether the service kept its word about measurements of a robot on a bench."""

from collections import Counter
from collections.abc import Iterator
from typing import Any


def measurements(history: Any, evidence: Any) -> Iterator[Any]:
    """Each acknowledged answer is there, one counts for a request, none is asked for again; a take has one holder."""
    counted = Counter(each.request for each in evidence.answers.values() if each.state == "counted")
    yield from (f"request {request}: {number} answers count" for request, number in counted.items() if number > 1)
    told = [record for record in history if record.acknowledged]
    yield from (f"{each.path}: {each.body} was accepted" for each in told if each.verb == "nonsense")
    lies = [record for record in told if record.verb == "lie" and record.answer["state"] == "counted"]
    yield from (f"{each.path}: {each.body} counts, and it is a lie" for each in lies)
    for record in told:
        if record.verb in {"answer", "correct"} and record.answer[_ANSWERED[record.verb]] not in evidence.answers:
            yield f"{record.path}: acknowledged, and {record.answer[_ANSWERED[record.verb]]} is not there"
    takes = [record for record in told if record.verb == "take"]
    holders = Counter((record.answer["id"], record.answer["takes"]) for record in takes)
    yield from (
        f"take {take} of request {request} has {number} holders"
        for (request, take), number in holders.items()
        if number > 1
    )
    yield from _asked_again(takes, told)


_ANSWERED = {"answer": "id", "correct": "answer"}


def _asked_again(takes: Any, told: Any) -> Iterator[Any]:
    """The takes of a controller that was measured before in the same repetition."""
    controller = {take.answer["id"]: _controller(take.answer) for take in takes}
    measured: dict[Any, float] = {}
    for record in told:
        if record.verb == "answer" and record.answer["state"] == "counted":
            key = controller.get(record.answer["request"])
            measured[key] = min(record.answered_at, measured.get(key, record.answered_at))
    for take in takes:
        if take.sent_at > measured.get(_controller(take.answer), float("inf")):
            yield f"request {take.answer['id']} was offered, and its controller was measured"


def _controller(request: Any) -> Any:
    return request["experiment"], request["repetition"], tuple(request["genome"])
