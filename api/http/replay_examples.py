"""Examples of replays and predictions, for /docs: a robot that is a box with one foot, in two frames."""

from gaplab.schemas.predictions import Prediction, Predictions
from gaplab.schemas.replays import ControllerKind, Replay, ReplayWorld, Shape

_SHAPES = (
    Shape(body=None, kind="plane", size_m=(), role="ground"),
    Shape(body=0, kind="box", size_m=(0.3, 0.2, 0.06), role="trunk"),
    Shape(body=1, kind="capsule", size_m=(0.01, 0.15), position_m=(0.0, 0.0, -0.075), role="limb"),
    Shape(body=1, kind="sphere", size_m=(0.025,), position_m=(0.0, 0.0, -0.15), role="foot"),
)


def _world(fitness: float, x: float) -> ReplayWorld:
    return ReplayWorld(
        engine="pybullet",
        fitness=fitness,
        recorded=fitness,
        shapes=_SHAPES,
        positions_m=((0.0, 0.0, 0.175, 0.15, 0.1, 0.175), (x, 0.0, 0.174, 0.15 + x, 0.1, 0.174)),
        orientations=((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0, 0.0, 0.1, 0.0, 0.995)),
        heights_m=(0.175, 0.174),
        speeds_m_s=(fitness, fitness),
        contacts=(((0.0, 0.02),),),
    )


REPLAY = Replay(
    experiment="01f2e3d4c5b6",
    repetition=0,
    iteration=3,
    kind=ControllerKind.TRANSFER,
    simulator=3,
    robot="quadruped",
    unit="m/s",
    bodies=("trunk", "front_left_shin"),
    feet=("front left",),
    times_s=(0.0, 0.02),
    counted_s=(0.5, 3.0),
    simulation=_world(0.31, 0.006),
    reality=_world(0.27, 0.005),
)

PREDICTIONS = Predictions(
    experiment="01f2e3d4c5b6",
    unit="m/s",
    items=(Prediction(repetition=0, iteration=1, simulated_before=0.42, simulated_after=0.29, fitness=0.27),),
    pending=79,
)
