"""Specs of what was submitted, to submit it again."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen


class SpecRead(Frozen):
    """The spec of a study or an experiment: what a person would submit, and what was stored."""

    spec: dict[str, Any] | None = Field(
        description="the shortest spec that gives the same; null if no single spec gives all experiments",
        examples=[{"strategies": ["simulated_fit", "random"], "engine": "mujoco", "budget": "smoke"}],
    )
    resolved: tuple[dict[str, Any], ...] = Field(default=(), description="the complete spec of each experiment")
    remarks: tuple[str, ...] = Field(default=(), description="what the spec lacks, in words")
