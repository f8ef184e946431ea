"""Replays and predictions: physics that is computed while somebody waits."""

from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import Field

from gaplab.api.http import examples, replay_examples
from gaplab.api.http.dependencies import Id, Parameters, RolloutProcessDep, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.predictions import Predictions
from gaplab.schemas.replays import ControllerKind, Replay
from gaplab.services.replay import predictions, replays
from gaplab.services.replay.rollout import ReplayChoice

router = APIRouter(prefix="/experiments", tags=["replays"])


class ReplayQuery(Parameters):
    """Which controller is wanted, and in which simulator."""

    repetition: int = Field(default=0, ge=0, le=1_000_000, description="its number, from 0")
    iteration: int = Field(default=0, ge=0, le=1_000_000, description="that tried or transferred the controller")
    kind: ControllerKind = ControllerKind.TRANSFER
    simulator: int | None = Field(
        default=None,
        ge=0,
        le=1_000_000,
        description="the iteration whose best simulator it is shown in; left out: the one that it was chosen in, which "
        "for a sample is that of the iteration before",
    )


@router.get(
    "/{id}/replay",
    summary="Replay a controller",
    response_model=Replay,
    responses={
        200: examples.shown(replay_examples.REPLAY, "Shapes, and where they are over time, in both worlds"),
        **documented(404, 409, 422, 429),
    },
)
def read_replay(
    id: Id,  # noqa: A002 - the address says {id}
    store: StoreDep,
    process: RolloutProcessDep,
    which: Annotated[ReplayQuery, Query()],
) -> Response:
    """A sample or a transferred controller in its simulator and in reality, from the same start, computed anew.

    Reality is shown of controllers that were measured there: their motion is not its parameters. 409 before they are.
    """
    shown = replays.replay_json(store, process, id, ReplayChoice(**which.model_dump()))
    return Response(shown, media_type="application/json")


@router.get(
    "/{id}/predictions",
    summary="Read what simulators predicted",
    responses={
        200: examples.shown(replay_examples.PREDICTIONS, "By repetition and iteration"),
        **documented(404, 422, 429),
    },
)
def read_predictions(id: Id, store: StoreDep, process: RolloutProcessDep) -> Predictions:  # noqa: A002 - the address says {id}
    """The fitness of each sample in the best simulator before it was measured, and after tuning on it.

    About two seconds are computed for each question; ask again while some are pending.
    """
    return predictions.predictions(store, process, id)
