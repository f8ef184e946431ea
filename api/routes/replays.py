"""Replays and predictions: physics that is computed on request."""

from fastapi import APIRouter, Response
from pydantic import Field

from gaplab.api.http.dependencies import Asked, Id, Number, Parameters, RolloutProcessDep, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.replays import ControllerKind, Predictions, Replay
from gaplab.services.replay import replays
from gaplab.services.replay.rollout import LAST, ReplayChoice

router = APIRouter(prefix="/experiments", tags=["replays"])


class ReplayQuery(Parameters):
    """The controller to replay, and the simulator to replay it in."""

    repetition: Number = Field(0, description="number of the repetition, from 0")
    iteration: Number | None = Field(
        None, description="iteration that tried or transferred the controller; left out: the last that was measured"
    )
    kind: ControllerKind = ControllerKind.TRANSFER
    simulator: Number | None = Field(
        None,
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
    responses=documented(409, 429),
)
def read_replay(id: Id, store: StoreDep, process: RolloutProcessDep, query: Asked[ReplayQuery]) -> Response:
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
    responses=documented(429),
)
def read_predictions(id: Id, store: StoreDep, process: RolloutProcessDep) -> Predictions:
    """Return the fitness of each sample in the best simulator before its measurement, and after tuning on it.

    Each request computes for about two seconds; repeat it while some samples are pending.
    """
    return replays.predictions(store, process, id)
