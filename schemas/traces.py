"""Attachments, and traces: the recorded motion of a robot's base, from which its code computes fitness and readings."""

from typing import Annotated, ClassVar

from pydantic import Field

from gaplab.schemas.base import Examples, Frozen, Read, Real, Statistic, Unit

TRACE_COLUMNS = ("time_s", "x", "y", "z", "qx", "qy", "qz", "qw")
"""Columns of a trace in CSV: seconds on a clock of its own, metres, and a quaternion."""

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


class AlignedTrace(TraceRead):
    """A trace beside the motion that the best simulator expects, to see whether their clocks agree."""

    times_s: tuple[float, ...] = Field(description="seconds since the motion began", examples=[(0.0, 0.02)])
    heights_m: tuple[float, ...] = Field(description="height of the base", examples=[(0.17, 0.171)])
    distances_m: tuple[float, ...] = Field(description="distance over ground from the start", examples=[(0.0, 0.004)])
    expected_heights_m: tuple[float, ...] | None = Field(
        None, description="as the simulator expects; null: physics failed", examples=[(0.17, 0.172)]
    )
    expected_distances_m: tuple[float, ...] | None = Field(None, examples=[(0.0, 0.005)])


class TracesRead(Read):
    """What traces say: the values and readings of an answer, which is not given by this."""

    values: tuple[float, ...] = Field(description="fitness of each repeat", examples=[(0.41, 0.44)])
    unit: Unit
    readings: tuple[tuple[tuple[float | None, ...], ...], ...] | None = Field(
        None,
        description="readings of the sensors in each repeat, computed from its trace; null: the robot has none",
        examples=[[[[0.02, None]]]],
    )
    traces: tuple[AlignedTrace, ...]
    doubts: tuple[str, ...] = Field(
        (),
        description="what is unlikely about the traces; an answer with them is refused unless it is `confirmed`",
        examples=[("trace 1: there is no pose from 1.5 to 3.5 s",)],
    )
