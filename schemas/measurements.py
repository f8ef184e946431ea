"""Measurements of a physical robot: requests for them, takes, answers, corrections, and what is known beforehand.

A request is `open`; an operator or a driver takes it for a while, and answers. `measured` and `failed` end it, and the
repetition goes on; `void` declares the answer invalid, and asks again. A correction replaces an answer; what
was computed from it is computed again, and the old steps stay readable as a closed branch.
"""

from enum import StrEnum
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from gaplab.schemas.base import Examples, Frozen, Id, Label, Moment, Read, Real, Reason, RobotName, Statistic, Unit
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.traces import AttachmentRead as AttachmentRead
from gaplab.schemas.traces import Hash, Lags, TraceRead, Traces

MOST_VALUES = 1_000
"""Most values of one measurement."""

Values = Annotated[tuple[Real, ...], Field(min_length=1, max_length=MOST_VALUES, examples=[(0.41, 0.44, 0.4)])]

Table = tuple[tuple[Real | None, ...], ...]
"""`(r, s)`: a row for each time of reading, a column for each sensor, in its unit; null where it failed."""


class MeasuredValues(Frozen):
    """What was measured of one controller."""

    values: Values = Field(description="fitness of each repeat, in the robot's unit")
    readings: tuple[Table, ...] | None = Field(
        None,
        max_length=MOST_VALUES,
        description="what the sensors said in each repeat: a row for each time, a column for each sensor, in its unit; "
        "null where a sensor failed",
        examples=[[[[0.02, None]]]],
    )

    @model_validator(mode="after")
    def _check_the_readings(self) -> "MeasuredValues":
        if self.readings is not None and len(self.readings) != len(self.values):
            raise ValueError(f"readings have one table for each value: {len(self.values)}, not {len(self.readings)}")
        return self


class KnownSample(MeasuredValues):
    """A controller that was measured before the experiment; the first simulators are tuned on it."""

    genome: tuple[Real, ...] = Field(min_length=1, max_length=100_000, examples=[(0.12, 0.55, 0.83, 0.31)])
    unit: Unit | None = Field(None, description="unit of the values, which must be the robot's; null: it is")


class RequestState(StrEnum):
    """State of a request."""

    OPEN = "open"
    TAKEN = "taken"
    MEASURED = "measured"
    FAILED = "failed"
    WITHDRAWN = "withdrawn"
    """It is no longer needed: its experiment ended, or a correction closed its branch."""
    STUCK = "stuck"
    """It was taken too often without an answer; a person opens it again."""


class TakeSpec(Frozen):
    """Who takes a request, and for how long without a heartbeat."""

    EXAMPLES: ClassVar[Examples] = {"by hand": {"summary": "A person takes it", "value": {"operator": "Ada"}}}

    operator: Label = Field(description="person or driver", examples=["Ada"])
    lease_s: Annotated[Real, Field(ge=1, le=86_400)] = Field(
        600.0, description="seconds without a heartbeat, by the clock of a supervisor, after which it is open again"
    )


class HolderSpec(Frozen):
    """The take that a heartbeat, an answer or a release belongs to."""

    EXAMPLES: ClassVar[Examples] = {"the first take": {"value": {"take": 1}}}

    take: int = Field(ge=1, description="number of the take, as the answer to taking the request has it")


class ReleaseSpec(HolderSpec):
    """A take to end without an answer; anyone but its holder gives a name and a reason."""

    operator: Label | None = None
    reason: Reason | None = None
    moved_s: Annotated[Real, Field(ge=0, le=1e9)] | None = Field(
        None,
        description="seconds, up to now, in which the robot may have moved for this take after its end: what others "
        "measured meanwhile is then doubtful",
    )


class MeasurementSpec(Frozen):
    """An answer to a request: its values, or why there are none."""

    EXAMPLES: ClassVar[Examples] = {
        "measured": {"summary": "Three repeats", "value": {"take": 1, "values": [0.41, 0.44, 0.4], "unit": "m/s"}},
        "failed": {"summary": "Nothing to learn from", "value": {"take": 1, "failed": "a leg slipped off"}},
    }

    take: int | None = Field(None, ge=1, description="number of the take; null: nobody took the request")
    values: Values | None = Field(None, description="fitness of each repeat; null if the measurement failed")
    readings: tuple[Table, ...] | None = Field(None, max_length=MOST_VALUES)
    traces: Traces | None = Field(
        None, description="in place of values: a trace of each repeat, from which the robot's code computes them"
    )
    lags_s: Lags | None = None
    unit: Unit | None = Field(None, description="unit of the values, which must be the robot's; null: it is")
    failed: Reason | None = Field(
        None, description="why there are no values: the controller counts as tried, but nothing is tuned on it"
    )
    operator: Label | None = Field(
        None, description='default: who took the request; "unknown" if `take` is not its latest take'
    )
    note: Annotated[str, Field(max_length=20_000)] | None = None
    attachments: tuple[Hash, ...] = Field(
        (), max_length=20, description="hashes of stored attachments: a trace, a photograph"
    )
    confirmed: bool = Field(False, description="a person confirms that unlikely values are right")

    @model_validator(mode="after")
    def _check_that_it_is_one(self) -> "MeasurementSpec":
        if sum(part is not None for part in (self.values, self.traces, self.failed)) != 1:
            raise ValueError("an answer has either `values`, or `traces`, or the reason `failed`")
        if self.traces is not None and self.readings is not None:
            raise ValueError("readings are computed from `traces`, so leave them out")
        return self


class DoubtsRead(Read):
    """What is plausible in an answer, but unlikely; nothing is stored."""

    doubts: tuple[str, ...] = Field(examples=[("31 is 1e+02 times the other repeats",)])


class AnswerState(StrEnum):
    """What became of an answer."""

    COUNTED = "counted"
    CONFLICT = "conflict"
    """It came late, or second; a person decides which one counts."""
    REPLACED = "replaced"
    VOID = "void"
    DISMISSED = "dismissed"


class AnswerRead(Read):
    """An answer to a request, as it was given. Answers are never changed; others replace them."""

    id: Id
    request: Id
    state: AnswerState
    values: tuple[float, ...] | None = Field(None, examples=[(0.41, 0.44, 0.4)])
    fitness: Statistic = Field(None, description="mean of the values; null if the measurement failed")
    readings: tuple[Table, ...] | None = Field(None, examples=[[[[0.02, None]]]])
    failed: str | None = Field(None, examples=["a leg slipped off"])
    operator: str = Field(examples=["Ada"])
    note: str | None = Field(None, examples=["on the new carpet"])
    attachments: tuple[str, ...] = ()
    traces: tuple[TraceRead, ...] = Field((), description="the traces that the values were computed from")
    doubts: tuple[str, ...] = Field(
        (),
        description="what is unlikely about it, until a person confirms it: a decision that `this` counts",
        examples=[("31 is 1e+02 times the other repeats",)],
    )
    replaces: Id | None = Field(None, description="the answer that it corrects")
    reason: str | None = Field(None, description="why it was corrected, voided or dismissed", examples=["4.4 was 0.44"])
    at: Moment


Beyond = Literal["warn", "refuse"]
"""What happens to a controller that is expected to exceed a limit."""


class LimitsSpec(Frozen):
    """Limits of a physical robot; a missing one is not checked."""

    joint_speed: Annotated[Real, Field(gt=0, examples=[12.0])] | None = Field(
        None, description="greatest speed of a joint, rad/s"
    )
    torque: Annotated[Real, Field(gt=0, examples=[6.0])] | None = Field(
        None, description="greatest torque of a joint, N·m; checked only if the engine tells torques"
    )
    tilt: Annotated[Real, Field(gt=0, examples=[0.8])] | None = Field(
        None, description="greatest tilt of the base from upright, rad"
    )
    height: Annotated[Real, Field(examples=[0.08])] | None = Field(
        None, description="least height of the base's frame above the ground, m"
    )


class Safety(Read):
    """What tuned simulators expect of a controller; the worst of each.

    Attributes:
        simulators: number of simulators that were asked.
        failed: number of them in which the physics failed.
    """

    simulators: int
    failed: int
    joint_speed: float | None = Field(None, description="greatest speed of a joint, rad/s", examples=[8.1])
    torque: float | None = Field(None, description="greatest torque of a joint, N·m", examples=[6.5])
    tilt: float | None = Field(None, description="greatest tilt of the base from upright, rad", examples=[0.18])
    height: float | None = Field(None, description="least height of the base's frame, m", examples=[0.16])
    clearance: float | None = Field(
        None,
        description="least height of the lowest point of the base's body, m; negative inside the ground",
        examples=[0.12],
    )
    falls: int = Field(0, description="number of simulators in which it falls: it tilts by more than 90°")
    fitness_low: Statistic = Field(None, description="least fitness")
    fitness_high: Statistic = Field(None, description="greatest fitness")
    beyond: tuple[str, ...] = Field((), description="limits of the spec that it exceeds, in words")
    unknown: tuple[str, ...] = Field((), description="what could not be forecast, and why, in words")


class RequestRead(Read):
    """A measurement that an experiment waits for."""

    id: Id
    experiment: Id
    experiment_name: str = Field(examples=["gait"])
    experiment_state: State
    repetition: int
    iteration: int
    kind: MeasurementKind
    robot: RobotName
    unit: Unit
    bench: str = Field(examples=["lab 1"])
    repeats: int
    genome: tuple[float, ...] = Field(examples=[(0.12, 0.55, 0.83, 0.31)])
    state: RequestState
    takes: int = Field(description="number of the latest take; 0: it was never taken")
    unanswered: int = Field(description="takes in a row that ended without an answer")
    taken_by: str | None = Field(None, examples=["Ada"])
    taken_until: Moment | None = Field(None, description="about when the take ends without a heartbeat")
    busy: bool = Field(False, description="whether another request of the same bench is taken")
    safety: Safety | None = None
    expected: tuple[str, ...] = Field(
        (), description="`safety` in words", examples=[("3 simulators expect 0.3 to 0.5 m/s",)]
    )
    between_repeats: str | None = Field(
        None,
        description="how the robot begins, and what to do between repeats; null: it has no body",
        examples=["Let it rest for 1 s."],
    )
    needs: str | None = Field(
        None, description="what is needed besides values; null: nothing", examples=["Send a trace."]
    )
    same_as: Id | None = Field(
        None, description="an earlier request for the same controller, whose answer is this one's too"
    )
    branch: int | None = Field(None, description="number of the closed branch that it belongs to; null: none")
    answers: tuple[AnswerRead, ...] = ()
    created_at: Moment
    ended_at: Moment | None = None
