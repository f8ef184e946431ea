"""What gaplab's own robots promise; test_contract.py asks what every robot does."""

from typing import Any

import pytest

from gaplab.services.world.robots import robots


@pytest.mark.parametrize("name", sorted(robots))
def test_its_reality_is_the_papers(name: Any) -> None:
    material = robots[name].example().world.material

    assert (material.static_friction, material.dynamic_friction, material.restitution) == (1.0, 0.8, 0.0)
