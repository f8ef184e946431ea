"""Every engine against the textbook: what its coefficients are said to be is what they do.

Only through the contract: worlds, motions and trajectories. A sledge on a driven wheel is pushed by friction alone, so
it tells both coefficients: its thrust is the motor's while the wheel grips, and the dynamic friction's when it spins.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.world.kinematics import product, rotated
from gaplab.services.world.motions import Motion, Start
from gaplab.services.world.world import Body, Box, Joint, Material, Motor, Sphere, World

G = 9.81
STEP_S = 1 / 100
BALL = World(bodies=(Body("ball", 1.0, Sphere(0.05)),), time_step_s=STEP_S)
BOARD_KG, WHEEL_KG, RADIUS_M = 1.5, 0.5, 0.1
SPUN_KG = 0.4 * WHEEL_KG  # what the wheel adds to the inertia of a rolling sledge
FASTEST_RAD_S = 50.0
SETTLED_S = 0.3
BREAKS_LOOSE_FROM = {"physx": 0.65}
"""Share of the static friction at which a wheel driven all of a sudden may break loose: 0.97 but where it is known to
do worse, as docs/engines.md says."""

FRICTIONS = [Material(1.0, 0.8), Material(1.2, 0.3), Material(0.5, 0.1)]

EMBODIED = [name for name, engine in engines.items() if engine.available() and engine.runs(BALL)]


@pytest.fixture(params=EMBODIED)
def engine(request: pytest.FixtureRequest) -> Engine:
    return engines[request.param]()


def honoured(engine: Engine, *coefficients: str) -> None:
    ignored = {f"material.{each}" for each in coefficients} - engine.honours
    if ignored:
        pytest.skip(f"{engine.name} does not honour {', '.join(sorted(ignored))}")


def thrust(engine: Engine, material: Material, torque_nm: float) -> float:
    """A sledge's acceleration, in its weight, when its wheel, at rest on the ground, is driven by a constant torque."""
    motor = Motor(position_gain=0.1, max_torque_nm=torque_nm, max_speed_rad_s=FASTEST_RAD_S)
    world = World(
        bodies=(
            Body("board", BOARD_KG, Box((2.0, 2.0, 0.02)), collides=False),  # wide: it hardly pitches in this time
            Body("wheel", WHEEL_KG, Sphere(RADIUS_M)),
        ),
        joints=(Joint("axle", "board", "wheel", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), motor),),
        material=material,
        start_height_m=RADIUS_M,
        time_step_s=STEP_S,
    )
    ahead = Motion(np.array([0.0, SETTLED_S]), np.array([[0.0], [1e6]]), SETTLED_S + np.array([0.1, 0.2, 0.3]))
    x = engine.rollout(world, ahead).positions_m[:, 0]
    return float(x[2] - 2 * x[1] + x[0]) / 0.1**2 / G


def test_a_motor_that_holds_an_arm_has_the_torque_of_its_weight(engine: Engine) -> None:
    arm_kg, reach_m = 0.5, 0.3
    held = World(
        bodies=(
            Body("block", 20.0, Box((1.0, 1.0, 0.2))),
            Body("arm", arm_kg, Sphere(0.05), (reach_m, 0.0, 0.0), collides=False),
        ),
        joints=(Joint("shoulder", "block", "arm", (0.0, 0.0, 0.1), (0.0, 1.0, 0.0), Motor(0.1, 8.0)),),
        material=Material(0.8, 0.8),
        start_height_m=0.1,
        time_step_s=STEP_S,
    )
    still = Motion(np.array([0.0]), np.array([[0.0]]), np.array([2.0]))
    torques = engine.record(held, still, np.array([0.0, 2.0])).torques_nm

    if torques is None:
        pytest.skip(f"{engine.name} does not tell torques")
    assert torques[:, 0] == pytest.approx([0.0, -arm_kg * G * reach_m], rel=0.01)


def torque(share: float) -> float:
    """That pushes the sledge with this share of its weight, if the wheel grips, and turns the wheel as well."""
    return share * G * (BOARD_KG + WHEEL_KG + SPUN_KG) * RADIUS_M


@pytest.mark.parametrize("material", FRICTIONS)
@pytest.mark.parametrize("share", [0.3, 0.7, 0.95])
def test_a_wheel_that_grips_pushes_with_its_motors_torque(engine: Engine, material: Material, share: float) -> None:
    honoured(engine, "static_friction")
    share *= BREAKS_LOOSE_FROM.get(engine.name, 0.97)

    pushed = thrust(engine, material, torque(share * material.static_friction))

    assert pushed == pytest.approx(share * material.static_friction, rel=0.02)


@pytest.mark.parametrize("material", FRICTIONS)
def test_a_wheel_breaks_loose_at_the_static_friction(engine: Engine, material: Material) -> None:
    honoured(engine, "static_friction", "dynamic_friction")
    shares = np.linspace(0.6, 1.1, 51) * material.static_friction

    loose = next(share for share in shares if thrust(engine, material, torque(share)) < 0.97 * share)

    assert BREAKS_LOOSE_FROM.get(engine.name, 0.97) < loose / material.static_friction < 1.03


@pytest.mark.parametrize("material", [*FRICTIONS, Material(0.6, 0.6)])
@pytest.mark.parametrize("excess", [1.2, 3.0])
def test_a_wheel_that_spins_pushes_with_the_dynamic_friction(engine: Engine, material: Material, excess: float) -> None:
    honoured(engine, "dynamic_friction")

    pushed = thrust(engine, material, torque(excess * max(material.static_friction, material.dynamic_friction)))

    assert pushed == pytest.approx(material.dynamic_friction, rel=0.1)


def fall(engine: Engine, height_m: float, material: Material = BALL.material) -> tuple[FloatArray, FloatArray]:
    """Times, and heights of a dropped ball's lowest point."""
    times = np.arange(0, 1.2, STEP_S)
    world = replace(BALL, material=material, start_height_m=height_m + 0.05)
    still = Motion(np.zeros(1), np.zeros((1, 0)), times)
    return times, engine.rollout(world, still).positions_m[:, 2] - 0.05


def test_a_dropped_ball_falls_freely(engine: Engine) -> None:
    times, heights = fall(engine, 1.0)

    falling = times < 0.4
    parabola = 1.0 - 0.5 * G * times**2
    assert np.all(
        np.abs(heights - parabola)[falling] <= 0.5 * G * times[falling] * STEP_S + 1e-6
    )  # half a step's worth


@pytest.mark.parametrize("center_m", [(0.0, 0.0, 0.0), (0.05, -0.1, 0.2)])
def test_a_thrown_box_flies_a_parabola_and_spins_as_euler_says(
    engine: Engine, center_m: tuple[float, float, float]
) -> None:
    """The velocity is that of its frame, in the world; the angular velocity is in its frame, not the world's."""
    if not engine.sets_starts:
        pytest.skip(f"{engine.name} starts no motion in the air")
    box = Body("box", 2.0, Box((0.3, 0.2, 0.1)), center_m)
    world = World((box,), start_height_m=1.0, time_step_s=1 / 2000, gravity_tilt_rad=(0.1, 0.2))
    if lacked := engine.lacks(world):
        pytest.skip(f"{engine.name} does not honour {', '.join(lacked)}")
    start = Start((1.0, -2.0, 5.0), (0.0, 0.6, 0.0, 0.8), (2.0, 1.0, 3.0), (0.5, 8.0, -0.5))
    seen = np.linspace(0.0, 0.8, 9)

    told = engine.rollout(world, Motion(np.zeros(1), np.zeros((1, 0)), seen, start=start, joints=True))

    x, y, z = ((b**2 + c**2) / 12 for b, c in ((0.2, 0.1), (0.3, 0.1), (0.3, 0.2)))

    def spins(_: float, state: FloatArray) -> FloatArray:
        turn, (a, b, c) = state[:4], state[4:]
        faster = [(y - z) / x * b * c, (z - x) / y * c * a, (x - y) / z * a * b]
        return np.array([*product(turn, np.array([a, b, c, 0.0])) / 2, *faster])

    spun = solve_ivp(spins, (0, 0.8), [*start.turn, *start.turning_rad_s], t_eval=seen, rtol=1e-9).y[:4].T  # type: ignore[misc]
    turn = np.array(start.turn)
    off = rotated(turn, np.array(center_m))
    launched = np.array(start.velocity_m_s) + np.cross(rotated(turn, np.array(start.turning_rad_s)), off)
    pull = Rotation.from_rotvec([0.1, 0.2, 0.0]).apply([0.0, 0.0, -G])
    flown = np.array(start.position_m) + off + np.outer(seen, launched) + np.outer(seen**2 / 2, pull)
    assert np.abs(np.sum(told.orientations * spun, axis=1)) == pytest.approx(1, abs=2e-4)
    assert told.positions_m + rotated(told.orientations, np.array(center_m)) == pytest.approx(flown, abs=0.01)
    assert told.positions_m[0] == pytest.approx(start.position_m, abs=1e-6)
    assert told.angles_rad is not None
    assert told.angles_rad.shape == (9, 0)


@pytest.mark.parametrize("ground_m", [-0.3, 0.0, 0.2])
def test_a_ball_lands_on_the_ground_wherever_it_is(engine: Engine, ground_m: float) -> None:
    if ground_m and "ground_m" not in engine.honours:
        pytest.skip(f"{engine.name} has its ground at 0")
    world = replace(BALL, start_height_m=0.5, ground_m=ground_m)

    heights = engine.rollout(world, Motion(np.zeros(1), np.zeros((1, 0)), np.array([0.0, 2.0]))).positions_m[:, 2]

    assert heights == pytest.approx([0.5, 0.05 + ground_m], abs=2e-3)


@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.85])
@pytest.mark.parametrize("height_m", [0.2, 0.5, 1.0])
def test_a_dropped_ball_bounces_with_the_restitution(engine: Engine, restitution: float, height_m: float) -> None:
    honoured(engine, "restitution")

    _, heights = fall(engine, height_m, Material(restitution=restitution))

    speeds = np.diff(heights) / STEP_S
    first = int(np.argmax(speeds > 0))
    # engines may bounce what gravity adds in the step of the impact, too, and push out of the ground besides
    assert 0.98 < speeds[first] / (restitution * -speeds[first - 1]) < 1.2


@pytest.mark.parametrize("height_m", [0.2, 0.5, 1.0])
def test_a_ball_without_restitution_stays_down(engine: Engine, height_m: float) -> None:
    honoured(engine, "restitution")

    _, heights = fall(engine, height_m, Material(restitution=0.0))

    assert heights[int(np.argmax(heights < 0.01)) :].max() < 0.02
