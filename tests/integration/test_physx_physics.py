"""PhysX against the textbook: what its coefficients are said to be is what they do."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.physx import PhysX
from gaplab.services.engines.physx.engine import PhysXScene
from gaplab.services.world.world import Body, Box, Joint, Material, Sphere, World

if not PhysX.available():
    pytest.skip(PhysX.install, allow_module_level=True)

G = 9.81
STEP_S = 1 / 100
BALL = World(bodies=(Body("ball", 1.0, Sphere(0.05)),), start_height_m=1.05, time_step_s=STEP_S)
SLEDGE = World(
    bodies=(
        Body("board", 1.9, Box((2.0, 2.0, 0.02)), collides=False),
        Body("foot", 0.1, Sphere(0.02)),
    ),
    joints=(Joint("hinge", "board", "foot", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),),
    start_height_m=0.02,
    time_step_s=STEP_S,
)
BOX = World(bodies=(Body("box", 2.0, Box((0.2, 0.2, 0.04))),), start_height_m=0.02, time_step_s=STEP_S)
WEIGHT_N = 2.0 * G
FRICTIONS = [Material(1.0, 0.8), Material(1.2, 0.3), Material(0.5, 0.1)]
STEPS = 20


class Sledge(NamedTuple):
    """Something of 2 kg at rest on the ground, to be pushed about."""

    scene: PhysXScene
    material: Material
    ahead: FloatArray

    def speed(self) -> float:
        return float(np.linalg.norm(self.scene.articulation.root_linear_velocity[:2]))

    def throw(self, speed: float) -> None:
        self.scene.articulation.root_linear_velocity = [*(speed * self.ahead), 0.0]

    def pull(self, force_n: float, steps: int = 1) -> None:
        """Steps under a horizontal force in the plane of contact, so that it does not tip."""
        for _ in range(steps):
            x, y, _ = self.scene.pose()[:3]
            self.scene.articulation.root.add_force_at_point([*(force_n * self.ahead), 0.0], [x, y, 0.0])
            self.scene.step(1)

    def loose_at(self) -> float:
        """The share of its weight at which it breaks loose, pulled ever harder."""
        shares = np.linspace(0.7, 1.2, 500) * self.material.static_friction
        return float(next(share for share in shares if not self.pull(share * WEIGHT_N) and self.speed() > 0.02))


@pytest.fixture(params=FRICTIONS)
def material(request: pytest.FixtureRequest) -> Material:
    return request.param


@pytest.fixture(params=[(1.0, 0.0), (np.sqrt(0.5), np.sqrt(0.5))])
def ahead(request: pytest.FixtureRequest) -> FloatArray:
    return np.array(request.param)


def at_rest(world: World, material: Material, ahead: FloatArray) -> Iterator[Sledge]:
    engine = PhysX()
    scene = engine._scenes[world]
    scene.start(replace(world, material=material))
    scene.step(30)
    yield Sledge(scene, material, ahead)
    engine.close()


@pytest.fixture
def sledge(material: Material, ahead: FloatArray) -> Iterator[Sledge]:
    yield from at_rest(SLEDGE, material, ahead)


@pytest.fixture
def box(material: Material, ahead: FloatArray) -> Iterator[Sledge]:
    yield from at_rest(BOX, material, ahead)


@pytest.mark.parametrize("kind", ["sledge", "box"])
def test_what_slides_is_slowed_by_the_dynamic_friction_in_any_direction(
    kind: str, request: pytest.FixtureRequest, material: Material, ahead: FloatArray
) -> None:
    sliding: Sledge = request.getfixturevalue(kind)
    sliding.throw(3.0)
    sliding.scene.step(1)
    before = sliding.speed()

    sliding.scene.step(STEPS)

    assert (before - sliding.speed()) / (STEPS * STEP_S) == pytest.approx(material.dynamic_friction * G, rel=0.002)


def test_a_sledge_on_one_foot_breaks_loose_at_the_static_friction(sledge: Sledge) -> None:
    assert sledge.loose_at() == pytest.approx(sledge.material.static_friction, rel=0.01)


def test_a_box_on_its_corners_breaks_loose_near_the_static_friction(box: Sledge) -> None:
    """Four corners share the load as a few iterations of the solver find it; one that slides pulls the others along."""
    assert 0.87 < box.loose_at() / box.material.static_friction < 1.02


def test_a_sledge_broken_loose_accelerates_against_the_dynamic_friction(sledge: Sledge) -> None:
    pull = 1.05 * sledge.material.static_friction
    sledge.pull(pull * WEIGHT_N, steps=3)
    before = sledge.speed()

    sledge.pull(pull * WEIGHT_N, STEPS)

    expected = (pull - sledge.material.dynamic_friction) * G
    assert (sledge.speed() - before) / (STEPS * STEP_S) == pytest.approx(expected, rel=0.01)


def test_a_sledge_that_slid_to_rest_sticks_again(sledge: Sledge) -> None:
    sledge.throw(0.2)
    sledge.scene.step(60)

    between = (sledge.material.static_friction + sledge.material.dynamic_friction) / 2
    sledge.pull(between * WEIGHT_N, steps=30)

    assert sledge.speed() < 0.01


@pytest.mark.parametrize("height_m", [0.03, 0.1, 0.3, 1.0])
@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.85])
def test_a_dropped_ball_bounces_with_the_restitution(restitution: float, height_m: float) -> None:
    world = replace(BALL, start_height_m=height_m + 0.05)
    scene = PhysX()._scenes[world]
    scene.start(replace(world, material=Material(restitution=restitution)))
    speeds = [0.0]
    while speeds[-1] <= 0:
        scene.step(1)
        speeds.append(float(scene.articulation.root_linear_velocity[2]))

    before, after = speeds[-2:]
    assert after == pytest.approx(restitution * (G * STEP_S - before), rel=0.01)  # the step of the impact falls too
