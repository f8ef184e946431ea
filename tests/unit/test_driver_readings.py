"""A driver's readings are checked after each repeat, before anything is journalled."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gaplab.api.clients.drivers import DriverBroken, Robot, measure
from gaplab.api.clients.driving import TakeLost
from gaplab.api.clients.journal import Journal
from gaplab.schemas.records import SensorsRead

SENSORS = SensorsRead(names=("roll", "height"), units=("rad", "m"), noises=(0.02, 0.005), times_s=(0.5, 1.0, 1.5))
TABLE = [[0.1, 0.2], [0.1, None], [0.1, 0.2]]


class Task(SimpleNamespace):
    """A request for two repeats."""

    def __init__(self, sensors: SensorsRead | None) -> None:
        motion, request = SimpleNamespace(observe_s=(3.0,)), SimpleNamespace(unit="m/s")
        take = SimpleNamespace(lost=None, ask=lambda: None)
        super().__init__(
            repeats=2, known=[], motion=motion, request=request, sensors=sensors, noted=[], told=[], take=take
        )

    def note(self, value: float, readings: Any) -> None:
        self.noted.append((value, readings))

    def tell(self, values: list[float], readings: Any) -> Any:
        self.told.append((values, readings))
        return SimpleNamespace(id="a1", doubts=("0.4 is 5 times what was expected",))


class Driver:
    """Returns always the same."""

    def __init__(self, answer: Any) -> None:
        self.answer, self.runs = answer, 0

    def connect(self) -> None:
        """Do nothing."""

    def run(self, motion: Any) -> Any:
        self.runs += 1
        return self.answer

    def stop(self) -> None:
        """Do nothing."""


@pytest.mark.parametrize(
    ("sensors", "answer", "said"),
    [
        (
            SENSORS.model_copy(update={"needed": True}),
            0.4,
            "no readings, but the experiment tunes on them: return (fitness, readings), 3 rows of 2 numbers: roll, "
            "height, at 3 times from 0.5 to 1.5 s; or answer with `gaplab traces REQUEST FILE --answer`",
        ),
        (SENSORS, (0.4, TABLE[:2]), "readings of another shape than the sensors'; return 3 rows of 2 numbers"),
        (SENSORS, (0.4, [0.1, 0.2, 0.3]), "readings of another shape"),
        (SENSORS.model_copy(update={"names": (), "times_s": ()}), (0.4, TABLE), "the robot has no sensors"),
        (None, np.array([0.4, 0.5]), "must return the fitness, a number"),
        (SENSORS, (0.4, [[0.1, float("inf")]] * 3), "cannot be sent: /readings/0/1: must be a finite number, not inf"),
    ],
)
def test_a_wrong_answer_is_refused_after_the_first_run(sensors: SensorsRead, answer: Any, said: str) -> None:
    task, driver = Task(sensors), Driver(answer)

    with pytest.raises(DriverBroken) as refused:
        measure(task, Robot(driver), None, lambda sentence: None)  # type: ignore[arg-type]

    assert said in str(refused.value)
    assert (driver.runs, task.noted, task.told) == (1, [], [])


@pytest.mark.parametrize(
    ("sensors", "answer", "told"),
    [
        (SENSORS.model_copy(update={"needed": True}), (0.4, TABLE), [([0.4, 0.4], [TABLE, TABLE])]),
        (SENSORS, 0.4, [([0.4, 0.4], None)]),
        (None, 0.4, [([0.4, 0.4], None)]),
        (SENSORS, (0.4, np.array(TABLE, dtype=float)), [([0.4, 0.4], [TABLE, TABLE])]),
    ],
)
def test_what_fits_is_told_after_the_last_run(sensors: SensorsRead | None, answer: Any, told: Any) -> None:
    task, driver, said = Task(sensors), Driver(answer), list[str]()

    measure(task, Robot(driver), None, said.append)  # type: ignore[arg-type]

    assert (driver.runs, task.told) == (2, told)
    assert said[-1] == "doubtful: 0.4 is 5 times what was expected; correct a1, or confirm it"


@pytest.mark.parametrize(("refused", "kept"), [("Bo has taken it since", []), (None, [(0.4, None)])])
def test_repeats_are_forgotten_if_somebody_else_may_have_moved_the_robot_meanwhile(
    refused: str | None, kept: Any
) -> None:
    task, said = Task(None), list[str]()
    journal, left = Journal(), iter([None])
    journal.repeat("r", 0.4)

    def ask() -> None:
        if next(left, "lost"):
            raise TakeLost(refused or "no heartbeat")

    task.take = SimpleNamespace(lost=None, refused=refused, ask=ask)
    task.forget = lambda: journal.forget("r")
    measure(task, Robot(Driver(0.4)), None, said.append)  # type: ignore[arg-type]

    assert (len(task.noted), task.told, said[-1]) == (1, [], f"stopped: {refused or 'no heartbeat'}")
    assert journal.repeats("r") == kept


def test_a_repeat_of_a_journal_whose_readings_do_not_fit_is_measured_again() -> None:
    task, driver = Task(SENSORS.model_copy(update={"needed": True})), Driver((0.4, TABLE))
    task.known = [(0.3, None), (0.2, TABLE)]

    measure(task, Robot(driver), None, lambda sentence: None)  # type: ignore[arg-type]

    assert (driver.runs, task.told) == (1, [([0.2, 0.4], [TABLE, TABLE])])
