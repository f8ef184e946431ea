"""`gaplab.recover` and its command: whether tuning finds truths that are known, before a robot is touched."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaplab.api.library import recovering
from gaplab.services.core.errors import InvalidSpec, PluginBroken
from gaplab.workers.process_tasks import computed
from tests.commands import Gaplab
from tests.drawn_arm import imported

TASK = {"name": "reach", "options": {"settling_s": 0.2, "counted_s": 0.8}}


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return imported(tmp_path_factory.mktemp("arm"))


def recover(arm: Path, *tunables: str, **values: Any) -> Any:
    asked: dict[str, Any] = {"draws": 3, "samples": 2, "engine": "mujoco", "task": TASK, "workers": 1}
    return recovering.recover(arm, tunables, **asked | values)


def test_what_moves_the_arm_is_recovered_and_what_never_does_is_never_called_identified(arm: Path) -> None:
    found = recover(arm, "kp", "dynamic_friction")
    kp, friction = found.tunables

    assert kp.identified
    assert kp.width < 0.5
    assert friction.identified == 0
    assert friction.covered == 1.0
    assert friction.width > 0.9
    assert "Never identified with 2 random motions: dynamic_friction" in str(found)
    assert len({tuple(draw.truth) for draw in found.draws}) == 3


def test_its_numbers_depend_on_the_seed_alone_and_not_on_processes(arm: Path) -> None:
    one, two, other = (
        recover(arm, "kp", "mass(tool)", **{"draws": 2, "samples": 1, **values})
        for values in ({}, {"workers": 2}, {"seed": 1, "draws": 1})
    )

    assert one.tunables == two.tunables
    for mine, theirs in zip(one.draws, two.draws, strict=True):
        np.testing.assert_array_equal(mine.intervals, theirs.intervals)
    assert not np.array_equal(one.draws[0].truth, other.draws[0].truth)


def test_truths_of_what_is_given_are_not_drawn_and_reality_may_have_what_no_simulator_has(arm: Path) -> None:
    known, beyond = (
        recover(arm, "kp", "mass(tool)", reality=given, draws=2, samples=1)
        for given in ({"mass( tool )": 1.25}, {"mass(tool)": 1.25, "joint_friction": 3.0})
    )

    assert {draw.truth[1] for draw in known.draws} == {1.25}
    assert len({draw.truth[0] for draw in known.draws}) == 2
    assert [draw.truth.tolist() for draw in known.draws] == [draw.truth.tolist() for draw in beyond.draws]
    assert known.draws[0].values[0] != beyond.draws[0].values[0]


@pytest.mark.parametrize(
    ("values", "pointer", "told"),
    [
        ({"draws": 0}, "/draws", "at least 1"),
        ({"samples": 0}, "/samples", "at least 1"),
        ({"workers": 0}, "/workers", "at least 1"),
        ({"tuner": "search"}, "/tuner", "gives no intervals"),
        ({"engine": "pybulet"}, "/engine", "unknown engine"),
        ({"reality": {"slop": 0.1}}, "/reality/parameters/slop", "unknown tunable"),
        ({"tunables": ["kp", "mass(tol)"]}, "/tunables/1", "matches no body"),
        ({"robot": "toy_function", "engine": None, "task": None}, "/discrepancy", "has no sensors"),
    ],
)
def test_what_cannot_be_is_refused_with_its_place(arm: Path, values: Any, pointer: str, told: str) -> None:
    robot, tunables = values.pop("robot", arm), values.pop("tunables", ())

    with pytest.raises(InvalidSpec, match=told) as refused:
        recover(robot, *tunables or ("dynamic_friction",), **values)

    assert pointer in [each.pointer for each in refused.value.violations]


def test_the_command_prints_a_row_for_each_tunable_and_a_verdict(arm: Path, gaplab: Gaplab) -> None:
    asked = ["recover", str(arm), "--tunables", "kp", "--engine", "mujoco", "--draws", "2", "--samples", "1"]

    shown, document = (gaplab(*asked, *more).out for more in ((), ("--json",)))

    assert "Truth in its interval" in shown
    assert "2 draws say little" in shown
    found = json.loads(document)
    assert [each["name"] for each in found["tunables"]] == ["kp"]
    assert found["draws"] == 2


def fails() -> None:
    raise ValueError("a sensor is unplugged")


def test_an_error_in_another_process_is_told_here() -> None:
    with pytest.raises(PluginBroken, match="ValueError: a sensor is unplugged"):
        dict(computed([fails] * 3, 2))
