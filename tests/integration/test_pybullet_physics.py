"""PyBullet against the textbook: what its coefficients are said to be is what they do."""

from collections.abc import Iterator
from dataclasses import replace
from types import ModuleType
from typing import NamedTuple

import numpy as np
import pytest

from gaplab.services.engines.pybullet.engine import PyBulletScene, StickSlip
from gaplab.services.world.world import Body, Box, Joint, Material, Sphere, World

pybullet: ModuleType = pytest.importorskip("pybullet")

G = 9.81
STEP_S = 1 / 120
BALL = World(bodies=(Body("ball", 1.0, Sphere(0.05)),), start_height_m=1.05)
SLEDGE = World(
    bodies=(
        Body("board", 1.9, Box((2.0, 2.0, 0.02)), collides=False),
        Body("foot", 0.1, Sphere(0.02)),
    ),
    joints=(Joint("hinge", "board", "foot", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),),
    start_height_m=0.02,
)
CORNERS = {"a": (0.3, 0.3, 0.0), "b": (0.3, -0.3, 0.0), "c": (-0.3, 0.3, 0.0), "d": (-0.3, -0.3, 0.0)}
FOUR_FEET = World(
    bodies=(
        Body("board", 1.6, Box((0.6, 0.6, 0.02)), collides=False),
        *(Body(name, 0.1, Sphere(0.02)) for name in CORNERS),
    ),
    joints=tuple(Joint(f"hinge_{name}", "board", name, where, (0.0, 0.0, 1.0)) for name, where in CORNERS.items()),
    start_height_m=0.02,
)
WEIGHT_N = 2.0 * G


class Sledge(NamedTuple):
    """A wide board on one foot, too inert to roll or tip in a second, at rest on the ground, to be pushed about."""

    scene: PyBulletScene
    advance: StickSlip

    def speed(self) -> float:
        linear, _ = pybullet.getBaseVelocity(self.scene.robot, physicsClientId=self.scene.client)
        return float(np.hypot(linear[0], linear[1]))

    def throw(self, x: float, y: float) -> None:
        pybullet.resetBaseVelocity(self.scene.robot, [x, y, 0], [0, 0, 0], physicsClientId=self.scene.client)

    def pull(self, force_n: float) -> None:
        """One step under a horizontal force in the plane of contact, so that it does not tip."""
        place = (float(self.scene.pose()[0]), 0.0, 0.0)
        pybullet.applyExternalForce(
            self.scene.robot, -1, [force_n, 0, 0], place, pybullet.WORLD_FRAME, physicsClientId=self.scene.client
        )
        self.advance.step(1)


def at_rest(world: World, material: Material) -> Sledge:
    scene = PyBulletScene(pybullet, world)
    scene.start(replace(world, material=material))
    advance = StickSlip(scene)
    advance.step(30)
    return Sledge(scene, advance)


@pytest.fixture
def sledge(request: pytest.FixtureRequest) -> Iterator[Sledge]:
    sledge = at_rest(SLEDGE, request.param)
    yield sledge
    sledge.scene.close()


FRICTIONS = [Material(1.0, 0.8), Material(1.2, 0.3), Material(0.5, 0.1)]


@pytest.mark.parametrize("sledge", FRICTIONS, indirect=True)
@pytest.mark.parametrize("direction", [(1.0, 0.0), (np.sqrt(0.5), np.sqrt(0.5))])
def test_a_sliding_sledge_is_slowed_by_the_dynamic_friction_in_any_direction(
    sledge: Sledge, direction: tuple[float, float]
) -> None:
    sledge.throw(3 * direction[0], 3 * direction[1])
    sledge.advance.step(2)  # the first step of the slide is still under static friction
    before = sledge.speed()

    sledge.advance.step(20)

    friction = sledge.scene.world.material.dynamic_friction
    assert (before - sledge.speed()) / (20 * STEP_S) == pytest.approx(friction * G, rel=0.05)


@pytest.mark.parametrize("sledge", FRICTIONS, indirect=True)
def test_a_sledge_at_rest_breaks_loose_at_the_static_friction(sledge: Sledge) -> None:
    assert breaks_loose(sledge) == pytest.approx(1.0, rel=0.03)


@pytest.mark.parametrize("material", FRICTIONS)
def test_four_feet_break_loose_a_little_early_for_the_first_to_slide_takes_the_others_along(material: Material) -> None:
    sledge = at_rest(FOUR_FEET, material)

    assert 0.75 < breaks_loose(sledge) < 0.95

    sledge.scene.close()


def breaks_loose(sledge: Sledge) -> float:
    """The pull at which the sledge begins to move, as a share of what static friction should withstand."""
    withstood = sledge.scene.world.material.static_friction * WEIGHT_N
    return next(
        float(share)
        for share in np.linspace(0.5, 1.2, 420)
        if not sledge.pull(share * withstood) and sledge.speed() > 0.02
    )


@pytest.mark.parametrize("sledge", FRICTIONS, indirect=True)
def test_a_sledge_that_slid_to_rest_sticks_again(sledge: Sledge) -> None:
    material = sledge.scene.world.material
    sledge.throw(0.2, 0.0)
    sledge.advance.step(60)
    assert sledge.speed() < 0.01

    between = (material.static_friction + material.dynamic_friction) / 2
    for _ in range(30):
        sledge.pull(between * WEIGHT_N)

    assert sledge.speed() < 0.01


@pytest.mark.parametrize("sledge", FRICTIONS, indirect=True)
def test_a_sledge_broken_loose_accelerates_against_the_dynamic_friction(sledge: Sledge) -> None:
    material = sledge.scene.world.material
    pull = 1.05 * material.static_friction
    for _ in range(3):
        sledge.pull(pull * WEIGHT_N)
    before = sledge.speed()

    for _ in range(20):
        sledge.pull(pull * WEIGHT_N)

    expected = (pull - material.dynamic_friction) * G
    assert (sledge.speed() - before) / (20 * STEP_S) == pytest.approx(expected, rel=0.1)
