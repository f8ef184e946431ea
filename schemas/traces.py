"""Attachments, and traces: the recorded motion of a robot, from which its code computes fitness and readings."""

import re
from typing import Annotated, ClassVar

from pydantic import Field

from gaplab.schemas.base import Examples, Frozen, Read, Real, Statistic, Unit

TRACE_COLUMNS = ("time_s", "x", "y", "z", "qx", "qy", "qz", "qw")
"""Columns of a trace in CSV: seconds on a clock of its own, metres, and a quaternion."""

QUANTITIES = {
    "angle": ("angle", "position", "pos"),
    "speed": ("speed", "velocity", "vel"),
    "torque": ("torque", "effort"),
    "command": ("command", "target", "action"),
}
"""What a column of a trace says of a joint, and how its heading may call that: `angle elbow`, `position_elbow`."""

_HEADING = re.compile(r"(?P<name>[^\[(]*?)\s*(?:[\[(](?P<how>[^\])]*)[\])]?)?\s*")
_HOW = re.compile(r"(?P<sign>[-−]?)\s*(?P<unit>[^@]*?)\s*(?:@\s*(?P<zero>.*))?")


def heading_parts(heading: str) -> tuple[str, str]:
    """Return the name of a column, and how it counts: `x` and `mm` of `x [mm]` or `x (mm)`."""
    match = _HEADING.fullmatch(heading)
    return (match["name"], (match["how"] or "").strip()) if match else (heading, "")


def how_parts(how: str) -> tuple[str, str, str | None]:
    """Return sign, unit and zero of a column: `-`, `deg` and `90` of `-deg @ 90`."""
    match = _HOW.fullmatch(how)
    return ("-" if match["sign"] else "", match["unit"], match["zero"]) if match else ("", how, None)


def said_of(name: str) -> tuple[str, str]:
    """Return the quantity and the joint of a column, like `position_elbow`; no quantity if it names none."""
    for quantity, names in QUANTITIES.items():
        for each in names:
            if name.startswith(each) and name[len(each) : len(each) + 1] in {" ", "_", ".", "/"}:
                return quantity, name[len(each) + 1 :]
    return "", name


Hash = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
"""SHA-256 of the content of an attachment, in hexadecimal."""

Traces = Annotated[tuple[Hash, ...], Field(min_length=1, max_length=20)]

Lags = Annotated[
    tuple[Annotated[Real, Field(ge=-1e9, le=1e10)] | None, ...],
    Field(
        max_length=20,
        description="time on the clock of each trace at which the motion began, s; null: found by the rest before it, "
        "and by cross-correlation",
    ),
]


class AttachmentRead(Read):
    """A stored file of an answer."""

    id: str = Field(description="SHA-256 of its content, in hexadecimal; answers name it by that", examples=["ab" * 32])
    name: str = Field(examples=["run-3.csv"])
    media_type: str = Field(examples=["text/csv"])
    size: int = Field(description="bytes")


class TracesSpec(Frozen):
    """Traces of all repeats of a motion."""

    EXAMPLES: ClassVar[Examples] = {"one": {"summary": "One repeat", "value": {"traces": ["ab" * 32]}}}

    traces: Traces = Field(description="hashes of attachments, one for each repeat")
    lags_s: Lags | None = None


class TraceRead(Read):
    """A trace of one repeat, with the alignment of its clock."""

    attachment: str = Field(description="hash of the attachment", examples=["ab" * 32])
    lag_s: float = Field(description="time on the clock of the trace at which the motion began, s", examples=[2.015])
    match: Statistic = Field(
        None,
        description="correlation with the motion that the best simulator expects, at most 1; null: the lag was given, "
        "or the expected motion does not change",
    )
    after_rest: bool = Field(False, description="whether the rest before the motion shows when it began")


class TracesRead(Read):
    """What traces say: the values and readings of an answer, which is not given by this."""

    values: tuple[float, ...] = Field(description="fitness of each repeat", examples=[(0.41, 0.44)])
    unit: Unit
    readings: tuple[tuple[tuple[float | None, ...], ...], ...] | None = Field(
        None,
        description="readings of the sensors in each repeat, computed from its trace; null: the robot has none",
        examples=[[[[0.02, None]]]],
    )
    traces: tuple[TraceRead, ...]
    doubts: tuple[str, ...] = Field(
        (),
        description="what is unlikely about the traces; an answer with them is refused unless it is `confirmed`",
        examples=[("trace 1: there is no row from 1.5 to 3.5 s",)],
    )
