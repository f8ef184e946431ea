"""Parts that engines share: cached scenes, bounds of plausible poses, and indices as slices."""

from dataclasses import replace

import numpy as np
import pytest

from gaplab.services.engines.base import WARM_SCENES, WarmScenes
from gaplab.services.engines.stepped import DEEPEST_M, FARTHEST_M, consecutive, plausible
from gaplab.services.world.world import Material, World


class Scene:
    """A scene that knows whether it is closed."""

    def __init__(self, world: World) -> None:
        self.world, self.closed = world, False

    def close(self) -> None:
        self.closed = True


@pytest.mark.parametrize(
    ("indices", "expected"),
    [([], slice(0, 0)), ([3], slice(3, 4)), ([6, 7, 8], slice(6, 9)), ([0, 2], [0, 2]), ([2, 1], [2, 1])],
)
def test_indices_that_follow_each_other_are_a_slice(indices: list[int], expected: slice | list[int]) -> None:
    found = consecutive(indices)

    assert found == expected
    assert np.arange(9)[found].tolist() == indices


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        ((0.0, 0.0, 0.17), True),
        ((FARTHEST_M, 0.0, 0.17), False),
        ((0.0, -FARTHEST_M, 0.17), False),
        ((0.0, 0.0, np.nextafter(FARTHEST_M, 0.0)), True),
        ((0.0, 0.0, -DEEPEST_M), False),
        ((0.0, 0.0, np.nextafter(-DEEPEST_M, 0.0)), True),
        ((0.0, np.nan, 0.17), False),
    ],
)
def test_one_implausible_position_makes_all_poses_implausible(place: tuple[float, ...], expected: bool) -> None:
    poses = np.zeros((2, 3, 7))
    poses[1, 2, :3] = place

    assert plausible(poses).tolist() == [True, expected]


def test_worlds_that_differ_in_material_share_a_scene() -> None:
    scenes = WarmScenes(Scene)
    first, second = World(start_height_m=1.0), World(start_height_m=1.0, material=Material(restitution=0.5))

    assert first != second
    assert scenes[first.kind] is scenes[second.kind]


def test_a_dropped_scene_is_built_again_and_the_oldest_is_closed() -> None:
    scenes, worlds = WarmScenes(Scene), [World(start_height_m=float(each)) for each in range(WARM_SCENES + 1)]
    oldest, *others = [scenes[world] for world in worlds]

    assert oldest.closed
    assert not any(scene.closed for scene in others)
    assert scenes[replace(worlds[-1])] is others[-1]

    scenes.drop(worlds[-1])

    assert others[-1].closed
    assert not scenes[worlds[-1]].closed
