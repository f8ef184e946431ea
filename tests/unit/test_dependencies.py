"""What gaplab needs is pinned, all of it, and nothing else than that is installed."""

import re
import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
LINES = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if line and not line.startswith("#")]
PINS = {canonicalize_name(name): version for name, _, version in (line.partition("==") for line in LINES)}


def declared(*extras: str) -> list[Requirement]:
    texts = PROJECT["dependencies"] + [each for extra in extras for each in PROJECT["optional-dependencies"][extra]]
    return [Requirement(each) for each in texts if not each.startswith("gaplab")]


def needed() -> dict[str, str]:
    """Every distribution that gaplab needs, directly or not, with the version that is installed."""
    found: dict[str, str] = {}
    waiting = [(each, frozenset[str]()) for each in declared("mujoco", "physx", "mcap", "lerobot", "collada", "dev")]
    while waiting:
        requirement, extras = waiting.pop()
        if requirement.marker and not any(requirement.marker.evaluate({"extra": each}) for each in extras or {""}):
            continue
        name = canonicalize_name(requirement.name)
        try:
            installed = distribution(name)
        except PackageNotFoundError:
            continue  # `pip check` tells what is missing
        if name not in found:
            found[name] = installed.version
            below = frozenset(requirement.extras)
            waiting += [(Requirement(each), below) for each in installed.requires or ()]
    return found


def test_everything_that_is_needed_is_pinned_to_what_is_installed() -> None:
    found = needed()

    assert len(found) > 50
    assert {name: (PINS.get(name), version) for name, version in found.items() if PINS.get(name) != version} == {}  # type: ignore[call-overload]


def test_every_line_of_the_constraints_is_a_version() -> None:
    assert [line for line in LINES if not re.fullmatch(r"[A-Za-z0-9_.-]+==[0-9][0-9a-z.+]*", line)] == []
    assert len(PINS) == len(LINES)


@pytest.mark.parametrize("requirement", declared("mujoco", "physx", "mcap", "lerobot", "collada", "dev"), ids=str)
def test_what_is_declared_has_a_lower_bound_that_its_pin_fulfils(requirement: Requirement) -> None:
    assert requirement.specifier
    assert requirement.specifier.contains(PINS[canonicalize_name(requirement.name)])
    assert requirement.url is None
