"""The gait of a controller and the toy of the paper's Fig. 3, from what is stored to every format."""

from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.schemas.replays import Replay, ReplayReadings
from gaplab.services.core.errors import InvalidSpec, NotFound
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Probed, Transferred, Tuned
from gaplab.services.engines.analytic import speed
from gaplab.services.figures.kinds.replays import gait_figure, readings_figure
from gaplab.services.figures.kinds.toy import toy_figure
from gaplab.services.figures.marks import Arrow, Bars, Line, Points
from gaplab.services.figures.matplotlib.files import render_file
from gaplab.services.figures.plotly.chart import chart
from gaplab.services.figures.words import number
from gaplab.services.results.toy import toy_iterations
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.store.session import Store
from tests.experiments import submit_one, toy

FORMATS = {"html": b"<!doctype", "svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}


@pytest.fixture(scope="module")
def replay() -> Any:
    """Made up: in simulation the one foot is put down twice, in reality the physics failed."""
    world = {
        "engine": "mujoco",
        "fitness": 0.4,
        "recorded": None,
        "shapes": [],
        "positions_m": [[0.0, 0.0, 0.1], [0.1, 0.0, 0.2], [0.2, 0.0, 0.3]],
        "orientations": [[0.0, 0.0, 0.0, 1.0]] * 3,
        "heights_m": [0.1, 0.2, 0.3],
        "speeds_m_s": [0.3, 0.4, 0.5],
        "contacts": [[[0.0, 0.5], [1.5, 2.0]]],
    }
    failed = {"engine": "mujoco", "fitness": None, "recorded": None, "shapes": []}
    return Replay.model_validate(
        {
            "experiment": "e",
            "repetition": 0,
            "iteration": 2,
            "kind": "transfer",
            "simulator": 2,
            "robot": "r",
            "unit": "m/s",
            "bodies": ["trunk"],
            "feet": ["left"],
            "times_s": [0.0, 1.0, 2.0],
            "counted_s": [0.5, 2.0],
            "simulation": world,
            "reality": failed,
        }
    )


def marks(figure: Any, kind: Any) -> Any:
    return [[mark for mark in panel.marks if isinstance(mark, kind)] for panel in figure.panels]


def walked(store: Store, **changes: Any) -> Any:
    """The id of an experiment on the toy function that has ended, and the log of its first repetition."""
    submitted = submit_one(store, toy(repetitions=1, iterations=3, **changes)).id
    (claim,) = execution.claim(store, "me", 1)
    log = list(repetition(setting(claim.spec, 0)))
    for step in log:
        assert execution.record(store, claim, step)
    assert execution.complete(store, claim)
    return submitted, log


def test_a_gait_is_footfalls_height_and_speed(replay: Any) -> None:
    figure = gait_figure(replay)

    (feet, _, _), (_, (height,), (pace,)) = marks(figure, Bars), marks(figure, Line)
    assert [bars.intervals for bars in feet] == [((0.0, 0.5, 0.0), (1.5, 2.0, 0.0))]
    assert (height.y, pace.y) == ((0.1, 0.2, 0.3), (0.3, 0.4, 0.5))
    assert "share of the time on the ground: left 50 %" in figure.alt
    assert figure.caption.startswith("Fitness in simulation 0.4 m/s.")
    assert ("Fitness (m/s)", "0.4") in figure.table.rows


def test_a_gait_of_which_nothing_moved_is_empty(replay: Any) -> None:
    still = replay.model_copy(update={"simulation": replay.reality})

    figure = gait_figure(still)

    assert figure.empty
    assert figure.nothing == "the physics failed"


@pytest.mark.parametrize("format_", ["svg", "png", "pdf"])
def test_readings_of_a_robot_without_sensors_are_an_empty_figure(replay: Any, format_: Any) -> None:
    figure = readings_figure(replay)

    assert figure.empty
    assert figure.nothing == "the robot has no sensors"
    assert chart(figure)["data"] == []
    assert render_file(figure, format_).startswith(FORMATS[format_])


def test_readings_of_many_joints_are_two_in_a_row_each_with_its_name(replay: Any) -> None:
    names = [f"{what} joint {place}" for what in ("angle", "speed", "torque") for place in range(12)]
    rows = tuple((0.1 * place,) * 50 for place in range(36))
    readings = ReplayReadings(
        sensors=tuple(names),
        units=("rad",) * 12 + ("rad/s",) * 12 + ("N·m",) * 12,
        noises=(0.002,) * 12 + (0.05,) * 24,
        times_s=tuple((np.arange(50) * 0.02).tolist()),
        simulation=rows,
        reality=rows,
    )

    figure = readings_figure(replay.model_copy(update={"readings": readings}))

    assert (len(figure.panels), figure.columns) == (36, 2)
    assert [panel.title for panel in figure.panels] == names
    assert figure.caption.endswith("are divided: angle 0.002 rad, speed 0.05 rad/s, torque 0.05 N·m.")
    assert render_file(figure, "png").startswith(FORMATS["png"])


def test_the_toy_has_what_the_papers_figure_has(store: Store) -> None:
    experiment, log = walked(store)

    (shown,) = toy_iterations(store, experiment, 0, [2])

    tuned = next(step for step in log if isinstance(step, Tuned) and step.iteration == 2)
    sent = next(step for step in log if isinstance(step, Transferred) and step.iteration == 2)
    probed = next(step for step in log if isinstance(step, Probed) and step.iteration == 2)
    assert shown.truth == pytest.approx(speed(np.array(shown.genes), 1.0, 0.8, 0.0), abs=1e-12)  # type: ignore[arg-type]
    assert len(shown.approximations) == len(tuned.simulators)
    best = speed(np.array(shown.genes), *tuned.simulators[0].parameters, 0.0)  # type: ignore[call-arg]
    assert shown.approximations[0] == pytest.approx(best, abs=1e-12)
    assert shown.squared_error == tuned.simulators[0].squared_error
    assert [each.iteration for each in shown.samples] == [1, 2]
    assert (shown.transfer.gene, shown.transfer.simulated) == (sent.genome[0], sent.fitness)
    assert shown.transfer.real == probed.fitness
    error = sum(
        (np.interp(each.gene, shown.genes, shown.approximations[0]) - each.fitness) ** 2 for each in shown.samples
    )
    assert error == pytest.approx(shown.squared_error, abs=1e-3)


def test_the_arrow_goes_from_simulation_to_reality(sqlite_store: Store) -> None:
    experiment, _ = walked(sqlite_store)
    (shown,) = toy_iterations(sqlite_store, experiment, 0, [0])

    figure = toy_figure([shown])

    ((arrow,),) = marks(figure, Arrow)
    sent = shown.transfer
    assert (arrow.start, arrow.end) == ((sent.gene, sent.simulated), (sent.gene, sent.real))
    ((truth, best, *others),) = marks(figure, Line)
    assert (truth.name, best.name, len(others)) == ("Reality", "Simulation", len(shown.approximations) - 1)
    assert [points.name for points in marks(figure, Points)[0]] == ["Transferred: fittest in simulation"]
    assert "Iteration 0: after 0\N{NO-BREAK SPACE}samples" in figure.caption


def test_several_iterations_are_panels_and_none_is_the_last(sqlite_store: Store) -> None:
    experiment, _ = walked(sqlite_store)

    figure = toy_figure(toy_iterations(sqlite_store, experiment, 0, [0, 1, 2, 3]))
    (last,) = toy_iterations(sqlite_store, experiment, 0, [])

    assert [panel.title for panel in figure.panels] == [f"Iteration {number}" for number in range(4)]
    assert len({panel.y.limits for panel in figure.panels}) == 1
    assert last.iteration == 3


@pytest.mark.parametrize(
    ("changes", "seen", "heading"),
    [
        ({"held_out": 0.5}, [1, 3], "Sum of squared errors"),
        ({"discrepancy": "absolute_fitness"}, [1, 2, 3], "Sum of errors"),
    ],
)
def test_the_error_of_the_toy_is_of_what_tuning_saw_and_minimised(
    sqlite_store: Store, changes: Any, seen: Any, heading: str
) -> None:
    experiment, _ = walked(sqlite_store, **changes)

    (shown,) = toy_iterations(sqlite_store, experiment, 0, [3])

    found = [each for each in shown.samples if each.iteration in seen]
    off = [abs(np.interp(each.gene, shown.genes, shown.approximations[0]) - each.fitness) for each in found]
    expected = np.sqrt(np.mean(np.square(off))) if shown.squares else np.mean(off)
    assert shown.error == pytest.approx(expected, abs=1e-3)
    figure = toy_figure([shown])
    assert figure.table.head[3] == heading
    assert f"the best simulator errs by {number(shown.error)} a sample" in figure.caption


def test_the_true_function_is_hidden_until_the_experiment_has_ended(sqlite_store: Store) -> None:
    running = submit_one(sqlite_store, toy(repetitions=1)).id
    (claim,) = execution.claim(sqlite_store, "me", 1)
    log = repetition(setting(claim.spec, 0))
    for _ in range(8):
        execution.record(sqlite_store, claim, next(log))

    (shown,) = toy_iterations(sqlite_store, running, 0, [1])
    figure = toy_figure([shown])

    assert shown.truth is None
    assert not figure.empty
    assert "Reality" not in {line.name for line in marks(figure, Line)[0]}
    assert "once the experiment has ended" in figure.caption


def test_what_is_not_there_is_refused_and_what_is_not_yet_there_is_empty(sqlite_store: Store) -> None:
    waiting = submit_one(sqlite_store, toy(repetitions=1)).id
    walking = submit_one(sqlite_store, toy(robot="quadruped", repetitions=1)).id

    assert toy_figure(toy_iterations(sqlite_store, waiting, 0, [])).empty
    for repetition_, iterations in ((1, [0]), (0, [3])):
        with pytest.raises(NotFound, match="permitted: from 0 to"):
            toy_iterations(sqlite_store, waiting, repetition_, iterations)
    with pytest.raises(InvalidSpec, match="'quadruped' is not a function of one gene"):
        toy_iterations(sqlite_store, walking, 0, [])


def test_the_direct_baseline_has_no_simulators_and_its_fittest_is_in_reality(sqlite_store: Store) -> None:
    experiment = submit_one(sqlite_store, toy(strategy="direct", repetitions=1)).id
    (claim,) = execution.claim(sqlite_store, "me", 1)
    for step in repetition(setting(claim.spec, 0)):
        execution.record(sqlite_store, claim, step)
    execution.complete(sqlite_store, claim)

    (shown,) = toy_iterations(sqlite_store, experiment, 0, [])

    assert (shown.approximations, shown.squared_error) == ((), None)
    assert shown.transfer.real == pytest.approx(max(shown.truth), rel=1e-3)
    assert not marks(toy_figure([shown]), Arrow)[0]


def test_the_toy_is_answered_in_every_format(sqlite_store: Store) -> None:
    experiment, _ = walked(sqlite_store)
    api = TestClient(create_app(sqlite_store))

    for format_, begin in FORMATS.items():
        answer = api.get("/figures/toy", params={"experiment": experiment, "iteration": [0, 3], "format": format_})
        assert (answer.status_code, answer.content[: len(begin)].lower()) == (200, begin.lower())
    shown = api.get("/figures/toy", params={"experiment": experiment, "format": "json"}).json()
    assert {each["name"] for each in shown["figure"]["data"]} >= {"Reality", "Simulation", "Samples"}
    assert api.get(f"/figures/gait?experiment={experiment}").status_code == 422
    assert api.get("/figures/toy?experiment=no-such").status_code == 404
