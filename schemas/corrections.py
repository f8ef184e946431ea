"""Corrections of measurements: what is asked, what follows, and the steps that a correction closed."""

from typing import ClassVar, Literal

from pydantic import Field, model_validator

from gaplab.schemas.base import Examples, Frozen, Id, Label, Moment, Read, Reason, Unit
from gaplab.schemas.measurements import MOST_VALUES, Table, Values

_OPERATOR = "person who says so; the event names them"


class Consequences(Read):
    """What follows from a correction or a void."""

    answer: Id | None = Field(None, description="id of the new answer; null for a dry run or a void")
    request: Id = Field(description="id of the request that it answers")
    repetition: int
    iteration: int = Field(description="iteration from which the repetition goes on")
    steps: int = Field(description="stored steps that followed, which close as a branch and are computed again")
    branch: int | None = Field(None, description="number of the closed branch; null if nothing followed")
    measurements: int = Field(description="measurements among these steps; they are reused if requested again")
    words: str = Field(description="the same in a sentence", examples=["closes 4 steps; 1 measurement is reused"])


class CorrectionSpec(Frozen):
    """The right values in place of wrong ones."""

    EXAMPLES: ClassVar[Examples] = {
        "a wrong number": {
            "summary": "A typing error",
            "value": {"values": [0.41, 0.44, 0.4], "reason": "4.4 was 0.44"},
        }
    }

    values: Values | None = None
    readings: tuple[Table, ...] | None = Field(None, max_length=MOST_VALUES)
    unit: Unit | None = None
    failed: Reason | None = None
    reason: Reason = Field(description="why it is corrected")
    operator: Label | None = Field(None, description=_OPERATOR)

    @model_validator(mode="after")
    def _check_that_it_is_one(self) -> "CorrectionSpec":
        if (self.values is None) == (self.failed is None):
            raise ValueError("a correction has either `values` or the reason `failed`")
        return self


class VoidSpec(Frozen):
    """Why a measurement is invalid; its controller is requested again."""

    EXAMPLES: ClassVar[Examples] = {"void": {"summary": "The floor was wet", "value": {"reason": "the floor was wet"}}}

    reason: Reason
    operator: Label | None = Field(None, description=_OPERATOR)


class ConflictSpec(Frozen):
    """Which of several answers counts."""

    EXAMPLES: ClassVar[Examples] = {"dismissed": {"value": {"counts": "other", "reason": "it came late"}}}

    counts: Literal["this", "other"] = Field(description="`this` replaces what counted; `other` dismisses this one")
    reason: Reason
    operator: Label | None = Field(None, description=_OPERATOR)


class BranchRead(Read):
    """Steps of a repetition that a correction closed; they count nowhere, and stay readable."""

    repetition: int
    number: int
    iteration: int = Field(description="iteration of the measurement that was corrected")
    reason: str = Field(examples=["4.4 was 0.44"])
    steps: tuple[dict[str, object], ...] = Field(examples=[[{"kind": "probed", "iteration": 2, "fitness": 0.43}]])
    sentences: tuple[str, ...] = Field(
        description="the steps in words", examples=[["Repetition 0: iteration 2 reaches 0.43 in reality"]]
    )
    closed_at: Moment
