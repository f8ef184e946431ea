"""What gaplab's own tunables promise; test_contract.py asks what every tunable does."""

from gaplab.services.world.tunables import tunables


def test_the_papers_three_coefficients_are_there() -> None:
    assert {"static_friction", "dynamic_friction", "restitution"} <= set(tunables)
