"""Replays and predictions: physics that is computed on request."""

from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import Field

from gaplab.api.http.dependencies import Id, Parameters, RolloutProcessDep, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.replays import ControllerKind, Predictions, Replay
from gaplab.services.replay import predictions, replays
from gaplab.services.replay.rollout import LAST, ReplayChoice

router = APIRouter(prefix="/experiments", tags=["replays"])


class ReplayQuery(Parameters):
    """The controller to replay, and the simulator to replay it in."""

    repetition: int = Field(default=0, ge=0, le=1_000_000, description="number of the repetition, from 0")
    iteration: int | None = Field(
        default=None,
        ge=0,
        le=1_000_000,
        description="iteration that tried or transferred the controller; left out: the last that was measured",
    )
    kind: ControllerKind = ControllerKind.TRANSFER
    simulator: int | None = Field(
        default=None,
        ge=0,
        le=1_000_000,
        description="iteration whose best simulator replays the controller; left out: the same iteration for a "
        "transferred controller, the one before for a sample",
    )

    def choice(self) -> ReplayChoice:
        """Return the choice of a controller and of a simulator."""
        iteration = LAST if self.iteration is None else self.iteration
        return ReplayChoice(self.repetition, iteration, self.kind, self.simulator)


@router.get(
    "/{id}/replay",
    summary="Replay a controller",
    response_model=Replay,
    response_description="Shapes, and their motion in simulation and in reality",
    responses=documented(404, 409, 422, 429),
)
def read_replay(
    id: Id, store: StoreDep, process: RolloutProcessDep, query: Annotated[ReplayQuery, Query()]
) -> Response:
    """Compute the motion of a sample or a transferred controller in its simulator and in reality, from the same start.

    Reality is shown for controllers that were measured there, because their motion does not reveal its parameters.
    Before they are measured, the answer is 409.
    """
    replay = replays.replay_json(store, process, id, query.choice())
    return Response(replay, media_type="application/json")


@router.get(
    "/{id}/predictions",
    summary="Read what simulators predicted",
    response_description="By repetition and iteration",
    responses=documented(404, 422, 429),
)
def read_predictions(id: Id, store: StoreDep, process: RolloutProcessDep) -> Predictions:
    """Return the fitness of each sample in the best simulator before its measurement, and after tuning on it.

    Each request computes for about two seconds; repeat it while some samples are pending.
    """
    return predictions.predictions(store, process, id)
