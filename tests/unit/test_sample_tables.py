"""Tables of samples: what is read, and every error with its line and column."""

import re
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import gaplab
from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Outcome, Selected, Transferred, Tuned
from gaplab.services.specs import sample_tables
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import expected_rollouts, resolve_experiment
from gaplab.services.specs.sample_tables import read_samples
from gaplab.services.world.robot_files import RobotFile
from gaplab.services.world.robots.quadruped import Quadruped, QuadrupedOptions
from gaplab.services.world.robots.toy_function import ToyFunction
from tests.experiments import toy

TOY = ToyFunction()
GENES = ",".join(f"gene_{place}" for place in range(24))
HALVES = ",".join(["0.5"] * 24)


def errors(text: str, robot: Any = TOY) -> list[tuple[int, str | None]]:
    found = read_samples(text, robot)
    assert not (found.samples and found.errors)
    return [(each.line, each.column) for each in found.errors]


def test_a_table_with_repeats_is_read() -> None:
    found = read_samples("gene_0,value_1,value_2\n0.25,0.41,0.44\n\n1,-2e-1,\n", TOY)

    assert found.errors == ()
    assert [(each.genome, each.values) for each in found.samples] == [((0.25,), (0.41, 0.44)), ((1.0,), (-0.2,))]
    assert all(each.readings is None for each in found.samples)


@pytest.mark.parametrize(
    "text",
    ["value;gene_0\n0.5;0.25", "\ufeffgene_0\tvalue [m/s]\r\n0.25\t0.5\r\n", ' gene_0 , "value_1" \n 0.25, "0.5"'],
    ids=["semicolons", "tabs, a byte order mark and a unit", "spaces and quotes"],
)
def test_separators_order_and_units_vary(text: str) -> None:
    (sample,) = read_samples(text, TOY).samples

    assert (sample.genome, sample.values) == ((0.25,), (0.5,))


def test_readings_have_a_sensor_a_time_and_a_repeat() -> None:
    robot = Quadruped(QuadrupedOptions(counted_s=0.5))
    text = f"{GENES},value_1,value_2,roll@0.75,roll@0.75#2,y@1 [m]\n{HALVES},0.3,0.4,0.1,,-2\n"
    (sample,) = read_samples(text, robot).samples

    assert robot.sensors.times_s.tolist() == [0.75, 1.0]
    none = (None,) * 5
    assert sample.readings == (((0.1, *none[1:]), (*none[1:], -2.0)), (none, none))


def test_a_reading_is_found_by_the_name_that_errors_say_also_at_odd_times() -> None:
    robot = Quadruped(QuadrupedOptions(counted_s=123.45678))
    unknown = read_samples(f"{GENES},value,rolled\n{HALVES},0.3,0.1\n", robot).errors[0]
    (last,) = re.findall(r", ([\d.]+) s$", str(unknown.permitted))

    (sample,) = read_samples(f"{GENES},value,roll@{last}\n{HALVES},0.3,0.1\n", robot).samples

    assert sample.readings is not None
    assert sample.readings[0][-1][0] == 0.1


def test_all_errors_are_told_at_once_with_line_and_column() -> None:
    text = "gene_0,value_1,value_2\n1.5,0.4,\nx,0.4,1\n0.1,,inf\n0.1,0.2\n0.2,0,1_000\n0.2,0.3,\n"

    assert errors(text) == [
        (2, "gene_0"),
        (3, "gene_0"),
        (4, "value_1"),
        (4, "value_2"),
        (5, None),
        (6, "value_2"),
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", [(1, "gene_0"), (1, "value")]),
        ("gene_0,value\n", [(1, None)]),
        ("gene_0,gene_1,valeu\n0.1,0.2,x\n", [(1, "gene_1"), (1, "valeu"), (1, "value")]),
        ("gene_0,value,value_1\n0.1,0.2,0.2\n", [(1, "value")]),
        ("gene_0,value_1,value_3\n0.1,0.2,0.2\n", [(1, "value_2")]),
        ("gene_0,value_1,value_2,value_3\n0.1,0.2,,0.2\n", [(2, "value_3")]),
        ("gene_0,value [km/h]\n0.1,0.2\n", [(1, "value")]),
        ("gene_0,value,roll@0.75\n0.1,0.2,0.3\n", [(1, "roll@0.75")]),
        ("gene_1,value\n0.1,0,5\nx,y\n", [(1, "gene_1"), (1, "gene_0"), (2, None), (3, "value")]),
        ('gene_0,value\n0.1,"0.5\n0.2,0.3\n', [(3, "value")]),
    ],
    ids=[
        "empty",
        "only a header",
        "unknown columns",
        "a column twice",
        "a repeat without a column",
        "a gap between repeats",
        "another unit",
        "a sensor that the robot lacks",
        "errors of header and lines",
        "an open quote",
    ],
)
def test_nonsense_is_refused(text: str, expected: list[Any]) -> None:
    assert errors(text) == expected


def test_a_reading_of_a_repeat_without_a_value_is_refused() -> None:
    text = f"{GENES},value_1,value_2,roll@0.75#2\n{HALVES},0.3,,0.1\n"
    assert errors(text, Quadruped()) == [(2, "roll@0.75#2")]


def test_errors_say_what_is_permitted() -> None:
    found = read_samples('gene_0,value\n1.5,"0,4"\n', TOY).errors
    assert [each.message for each in found] == ["'0,4' is not a number; decimals have a point"]
    (found_gene,) = read_samples("gene_0,value\n1.5,0.4\n", TOY).errors
    assert (found_gene.value, found_gene.permitted) == ("1.5", "0 to 1")


def test_a_hostile_table_gives_a_short_answer() -> None:
    found = read_samples("gene_0,value\n" + "x,y\n" * 2_000, TOY)
    assert (len(found.errors), found.more) == (1_000, 3_000)


def test_names_are_looked_up_for_no_more_unknown_columns_than_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    looked_up: list[str] = []

    def nearest(name: str, *given: object, **options: object) -> list[str]:
        looked_up.append(name)
        return []

    monkeypatch.setattr(sample_tables, "get_close_matches", nearest)

    found = read_samples(",".join(f"x{place}" for place in range(3_000)), TOY)

    assert len(looked_up) == len(found.errors) == 1_000
    assert found.more > 2_000


def test_a_hostile_table_takes_little_memory() -> None:
    """All of its errors together would take 10 MB."""
    tracemalloc.start()

    found = read_samples("gene_0,value\n" + "x,y\n" * 5_000, TOY)

    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert (len(found.errors), found.more) == (1_000, 9_000)
    assert peak < 5e6


def test_a_cell_without_an_end_is_an_error_of_its_line() -> None:
    endless = '"' + "0123456789\n" * 20_000

    assert [place for place, _ in errors("gene_0,value\n1.5,0.4\n" + endless)] == [2, 13_110]
    (error,) = read_samples(endless, TOY).errors
    assert error.message == "the line is not CSV: field larger than field limit (131072)"


def test_the_client_reads_a_file_for_a_spec(tmp_path: Path) -> None:
    file = tmp_path / "runs.csv"
    file.write_text("gene_0,value_1,value_2\n0.25,0.41,0.44\n")
    samples = gaplab.read_samples(file, "toy_function")

    assert samples == [{"genome": [0.25], "values": [0.41, 0.44]}]
    resolved = resolve_experiment(toy(reality={"kind": "physical", "samples": samples}))
    assert len(setting(resolved, 0).known_samples) == 1
    file.write_text("gene_0,value\n2,3\n3,x\n")
    with pytest.raises(gaplab.InvalidSamples, match=r"runs.csv:2, gene_0: .*\nruns.csv:3, value: 'x' is not a number"):
        gaplab.read_samples(file, "toy_function")


def test_the_client_knows_robot_files_and_plug_ins(tmp_path: Path, put: Callable[..., Path]) -> None:
    toy_module = "gaplab.services.world.robots.toy_function"
    put(mine=f"from {toy_module} import ToyFunction\nclass Mine(ToyFunction):\n    name = 'mine'\n")
    (tmp_path / "runs.csv").write_text("gene_0,value\n0.25,0.41\n")
    quadruped, file = Quadruped(), tmp_path / "bot.json"
    file.write_text(
        RobotFile(
            name="bot",
            usual_controller=PluginRef(name="square_pulses"),
            usual_task=PluginRef(name="walk"),
            world=quadruped.world,
        ).text
    )
    genes = quadruped.space.size
    (tmp_path / "bot.csv").write_text(
        ",".join([*(f"gene_{place}" for place in range(genes)), "value"]) + "\n" + "0.5," * genes + "0.4\n"
    )

    assert gaplab.read_samples(tmp_path / "runs.csv", "mine")[0]["values"] == [0.41]
    assert gaplab.read_samples(tmp_path / "bot.csv", file) == gaplab.read_samples(tmp_path / "bot.csv", str(file))
    assert gaplab.read_samples(tmp_path / "bot.csv", file)[0]["genome"] == [0.5] * genes
    spec = {"robot": str(file), "controller": "sine"}
    with pytest.raises(gaplab.InvalidSamples, match="there is no column gene_24"):
        gaplab.read_samples(tmp_path / "bot.csv", spec)


def test_the_client_says_which_robots_it_knows_and_what_knows_others(tmp_path: Path) -> None:
    (tmp_path / "runs.csv").write_text("gene_0,value\n0.25,0.41\n")

    with pytest.raises(InvalidSpec) as refused:
        gaplab.read_samples(tmp_path / "runs.csv", "my_bot")

    said = str(refused.value)
    assert said.startswith(
        "/robot: unknown robot 'my_bot'; permitted: quadruped, toy_function, and files like 'my_bot.json'"
    )
    assert said.endswith("a service's own robots are known to the service alone")
    assert "robot_file" not in said


def test_samples_of_a_spec_are_checked_with_pointers() -> None:
    samples = [
        {"genome": [0.5], "values": [0.4]},
        {"genome": [0.5, 0.5], "values": [0.4]},
        {"genome": [1.5], "values": [0.4], "unit": "km/h"},
        {"genome": [0.5], "values": [0.4], "readings": [[[0.1]]]},
    ]
    with pytest.raises(InvalidSpec) as refused:
        resolve_experiment(toy(reality={"kind": "physical", "samples": samples}))
    assert [each.pointer for each in refused.value.violations] == [
        "/reality/samples/1/genome",
        "/reality/samples/2/genome/0",
        "/reality/samples/2/unit",
        "/reality/samples/3/readings/0",
        "/reality/samples/3/readings/0/0",
    ]


def test_readings_of_a_spec_have_the_shape_of_the_sensors() -> None:
    good = [[0.0, None, 0.1, 0.2, 0.3]] * 10
    for readings, pointers in [
        ([good], set()),
        ([good[1:]], {"/reality/samples/0/readings/0"}),
        ([[[0.0], *good[1:]]], {"/reality/samples/0/readings/0/0"}),
    ]:
        samples = [{"genome": [0.5] * 24, "values": [0.4], "readings": readings}]
        found = set()
        try:
            resolve_experiment(
                toy(robot="quadruped", engine="mujoco", reality={"kind": "physical", "samples": samples})
            )
        except InvalidSpec as error:
            found = {each.pointer for each in error.violations}
        assert found == pointers


def test_rollouts_of_known_samples_are_expected() -> None:
    samples = [{"genome": [gene], "values": [0.4]} for gene in (0.2, 0.7)]
    without, resolved = (
        resolve_experiment(toy(reality={"kind": "physical", "samples": known})) for known in ([], samples)
    )
    more = len(samples) * (resolved.iterations + 1) * resolved.budget.simulator_evaluations
    assert expected_rollouts(resolved) == expected_rollouts(without) + more

    measured = replace(setting(resolved, 0), reality=lambda genome: Outcome(float(genome[0])))
    costs = [step.cost for step in repetition(measured) if isinstance(step, Selected | Tuned | Transferred)]
    assert sum(cost.rollouts + cost.saved for cost in costs) == expected_rollouts(resolved)


def test_a_strategy_that_tunes_nothing_draws_its_simulators_in_spite_of_known_samples() -> None:
    samples = [{"genome": [0.2], "values": [0.4]}]
    spec = toy(strategy="domain_randomization", reality={"kind": "physical", "samples": samples})
    found = setting(resolve_experiment(spec), 0)
    first = next(repetition(found))
    assert isinstance(first, Tuned)
    assert len(first.simulators) == found.strategy.ensemble
