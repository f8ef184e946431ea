"""Comparisons leave the service: as CSV, as a table for a paper, and as a frame."""

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.api.clients.client import Client
from gaplab.api.commands.exit_codes import Exit
from gaplab.schemas.comparisons import Comparison, Equivalence, Estimate, Summary, Test, Trusted
from gaplab.services.findings.tables import comparison, escaped, latex
from gaplab.services.results.comparisons import compare, warnings_of
from gaplab.services.store.session import Store
from tests import experiments
from tests.commands import Gaplab
from tests.conftest import filled
from tests.experiments import listed, submit_one, toy

NAMES = ("half & half_100%", "=1+1", "plain")
"""Of three experiments; two have signs that tables treat as their own."""


def fill(store: Store) -> None:
    for name in NAMES:
        submit_one(store, toy(name=name, repetitions=4))
    experiments.finish(store)


@pytest.fixture(scope="module")
def sqlite_template(sqlite_template: Path) -> Path:
    """A database with the experiments and their results."""
    return filled(sqlite_template, fill)


@pytest.fixture
def ids(sqlite_store: Store) -> list[str]:
    found = {each.name: each.id for each in listed(sqlite_store)}
    return [found[name] for name in NAMES]


def test_csv_has_every_number_of_the_json(ids: list[str], sqlite_store: Store) -> None:
    with TestClient(create_app(sqlite_store), base_url="http://localhost") as api:
        plain = api.get("/comparisons", params={"study": ids, "from": 2, "to": 2}).json()
        answer = api.get("/comparisons", params={"study": ids, "from": 2, "to": 2, "format": "csv"})

    rows = list(csv.DictReader(io.StringIO(answer.text)))
    assert answer.headers["content-type"].startswith("text/csv")
    assert len(rows) == len(plain) == 3
    for row, pair in zip(rows, plain, strict=True):
        assert (row["first"], row["second"]) == (pair["first"], pair["second"])
        for test in ("student", "welch", "mann_whitney", "paired_t", "wilcoxon", "brown_forsythe"):
            for value in ("statistic", "p", "p_holm"):
                expected = pair[test][value]
                assert row[f"{test}_{value}"] == ("" if expected is None else repr(expected))
    assert {row["second_name"] for row in rows} == {"'=1+1", "plain"}


def test_transferred_controllers_alone_and_the_best_of_them_stand_beside_the_recorded_fitness(
    ids: list[str], sqlite_store: Store
) -> None:
    with TestClient(create_app(sqlite_store), base_url="http://localhost") as api:
        probes = api.get(f"/experiments/{ids[0]}/samples", params={"kind": "probe", "limit": 1000}).json()["items"]
        kinds = ("recorded", "transferred", "equal_chances")
        curves = {kind: api.get("/curves", params={"study": ids, "fitness": kind}).json() for kind in kinds}
        pairs = {kind: api.get("/comparisons", params={"study": ids, "fitness": kind}).json() for kind in kinds}
        figure = api.get("/figures/curves", params={"study": ids, "format": "json"}).json()

    alone = {(each["repetition"], each["iteration"]): each["fitness"] for each in probes}
    values = {kind: [point["values"] for point in found[0]["points"]] for kind, found in curves.items()}
    for count in range(len(values["recorded"])):
        assert values["transferred"][count] == [alone[each, count] for each in range(4)]
        measured = [[alone[each, before] for before in range(count + 1)] for each in range(4)]
        best = [max((one for one in each if one is not None), default=None) for each in measured]
        assert values["equal_chances"][count] == best  # a failed controller is never the best
    for kind, found in pairs.items():
        means = [each["points"][found[0]["to_evaluations"]]["mean"] for each in curves[kind][:2]]
        assert (found[0]["fitness"], found[0]["difference"]) == (kind, pytest.approx(means[0] - means[1]))
    assert "Thin lines: transferred controllers alone." in figure["caption"]


def test_latex_prints_names_as_they_are_and_numbers_in_math_mode() -> None:
    test = Test(p=0.0001, p_holm=0.0003, text="< 0.001 (raw < 0.001)")
    estimate, nothing = Estimate(value=0.125, text="0.125 [0.05, 0.2]"), Estimate(text="–")
    equivalence = Equivalence(
        margin=0.03, test="welch", p=0.2, p_holm=0.4, verdict="undecided", words="undecided within ±0.03"
    )
    summary = Summary(n=9, sd=0.5, mean=estimate, interquartile_mean=nothing)
    pair = Comparison(
        first="a", second="b", first_name="half & half_100%", second_name=r"a\b{c}^~", from_evaluations=3,
        to_evaluations=5, n_first=9, n_second=9, sizes="9, 9", difference=-0.25, difference_text="−0.25 [−0.5, 0]",
        effect_size=None, effect_size_text="–", student=test, welch=test, mann_whitney=Test(text="–"),
        lower=-0.5, upper=0.0, improvement=estimate, shared_streams=False, streams="", n_paired=0,
        trusted=Trusted(test="welch", text="0.041 (raw 0.004)"), paired_t=Test(),
        wilcoxon=Test(), brown_forsythe=test, summary_first=summary, summary_second=summary,
        equivalence=equivalence, unit="m/s", where="mean of each repetition over 3 to 5 real-world evaluations",
    )  # fmt: skip

    table = latex(comparison([pair]))

    name = r"half \& half 100\% $-$ a\textbackslash{}b\{c\}\textasciicircum{}\textasciitilde{}"
    assert f"{name} & $9$, $9$ & $-0.25$ [$-0.5$, $0$] & -- & $0.125$ [$0.05$, $0.2$] \\\\" in table
    verdict = r"$0.041$ (raw $0.004$) & too few values that vary & undecided within $\pm0.03$ \\"
    assert f"{name} & Welch & {verdict}" in table
    assert f"{name} & $< 0.001$ (raw $< 0.001$) & $< 0.001$ (raw $< 0.001$) & -- & $< 0.001$ (raw" in table
    assert r"\caption{Recorded fitness in m/s, mean of each repetition over 3 to 5 real-world evaluations" in table
    assert table.count(r"\begin{table}") == 4
    assert table.count("{") == table.count("}") - table.count(r"\}") + table.count(r"\{")
    assert escaped("a\n b") == "a b"


def test_the_client_gives_a_tuple_with_a_frame_and_a_table(ids: list[str], url: str) -> None:
    with Client(url) as client:
        pairs = client.compare(ids)
        frame, latex, text = pairs.frame(), pairs.latex(), pairs.csv()
        over, close = client.compare(ids, 1, 2), client.compare(ids, margin=0.5)
        over_latex, close_text = over.latex(), close.csv()

    assert [pair.first for pair in pairs] == list(frame["first"])
    assert (pairs[0].from_evaluations, pairs[0].to_evaluations) == (2, 2)  # the last that all have
    assert (over[0].from_evaluations, over[0].to_evaluations) == (1, 2)
    assert over[0].pooled is not None
    assert "pooled as in the paper" in over_latex
    assert {pair.equivalence.margin for pair in close if pair.equivalence} == {0.5}
    assert "undecided" in close_text or "equivalent," in close_text
    assert {"wilcoxon_p", "improvement_lower", "trusted_test", "pooled_student_p"} <= set(frame.columns)
    assert frame["student_p_holm"].dtype == float
    assert r"\begin{tabular}" in latex
    assert text.startswith("first,first_name,")


def test_the_command_prints_each_format(ids: list[str], gaplab: Gaplab) -> None:
    table, text, document, latex = (
        gaplab("compare", *ids, "--at", "2", "--format", name) for name in ("table", "csv", "json", "latex")
    )

    assert "Mann-Whitney" in table.out
    assert "plain" in table.out
    assert len(text.out.splitlines()) == 1 + 3
    assert json.loads(document.out)[0]["to_evaluations"] == 2
    assert r"\toprule" in latex.out
    over = gaplab("compare", *ids, "--at", "1-2", "--margin", "0.5").out
    assert "mean of each repetition over 1 to 2" in over
    assert "pooled as in the paper" in over
    assert "within ±0.5" in over
    assert "seed 0 and the strategy simulated_fit" in over.replace("\n", " ")


SLIPPERY = """
from gaplab.services.world.robots.toy_function import ToyFunction


class Slippery(ToyFunction):
    name = "slippery"
"""


def test_what_differs_besides_the_strategy_is_said(
    sqlite_store: Store, finish: Callable[[], None], gaplab: Gaplab, put: Any
) -> None:
    put(slippery=SLIPPERY)
    specs = (
        toy(repetitions=2),
        toy(repetitions=2, strategy="random"),
        toy(repetitions=2, robot="slippery"),
        toy(repetitions=2, reality={"parameters": {"static_friction": 0.4}}),
    )
    plain, random, slippery, icy = (submit_one(sqlite_store, spec).id for spec in specs)
    open_ = submit_one(sqlite_store, toy(repetitions=2)).id

    def told(*pair: str) -> list[str]:
        (found,) = compare(sqlite_store, pair)
        return list(found.warnings)

    (hidden,) = told(plain, open_)
    finish()

    assert hidden.startswith("realities are hidden until the experiments have ended")
    assert told(plain, random) == told(plain, open_) == []
    assert told(plain, slippery) == [
        "different robots (slippery; toy_function): their fitness does not mean the same",
    ]
    assert warnings_of(sqlite_store, [plain, random, slippery, icy]) == (*told(plain, slippery), *told(plain, icy))
    assert told(plain, icy) == ["different realities: a difference may come from the reality, not from the strategy"]
    assert "! different robots (slippery; toy_function)" in gaplab("compare", plain, slippery).out
    assert "! different robots (slippery; toy_function)" in gaplab("diff", plain, slippery).out


def test_tasks_that_read_other_sensors_rate_alike(sqlite_store: Store) -> None:
    robot = {"repetitions": 2, "robot": "quadruped", "engine": "mujoco"}
    options: Any = ({}, {"sensors": ["base", "angles"], "every_s": 0.02}, {"counted_s": 2.0})
    plain, reads, shorter = (
        submit_one(sqlite_store, toy(**robot, task={"name": "walk", "options": each})).id for each in options
    )

    assert not any("different tasks" in each for each in warnings_of(sqlite_store, [plain, reads]))
    assert any("different tasks" in each for each in warnings_of(sqlite_store, [plain, shorter]))


def test_all_ways_to_ask_begin_at_the_same_count(ids: list[str], gaplab: Gaplab, url: str, sqlite_store: Store) -> None:
    with TestClient(create_app(sqlite_store), base_url="http://localhost") as api, Client(url) as client:
        http = api.get("/comparisons", params={"study": ids}).json()
        alone = api.get("/comparisons", params={"study": ids, "to": 1}).json()
        asked = client.compare(ids)
    command = json.loads(gaplab("compare", *ids, "--json").out)

    assert http == command == [pair.model_dump(mode="json") for pair in asked]
    assert {(pair["from_evaluations"], pair["to_evaluations"]) for pair in http} == {(2, 2)}
    assert {(pair["from_evaluations"], pair["to_evaluations"]) for pair in alone} == {(1, 1)}


def test_a_margin_is_given_once_and_is_above_0(ids: list[str], gaplab: Gaplab, sqlite_store: Store) -> None:
    with TestClient(create_app(sqlite_store), base_url="http://localhost") as api:
        twice, zero, no_direct = (
            api.get("/comparisons", params={"study": ids, **margin})
            for margin in ({"margin": 1, "margin_of_direct": 1}, {"margin": 0}, {"margin_of_direct": 0.03})
        )

    assert [answer.status_code for answer in (twice, zero, no_direct)] == [422, 422, 422]
    assert "one margin" in twice.text
    assert "one direct baseline" in no_direct.text
    for margin in ("0", "nan", "inf", "much", "-3%"):
        wrong = gaplab("compare", *ids, f"--margin={margin}")
        assert wrong.code == Exit.USAGE
        assert "is not a margin above 0" in wrong.err.replace("\n│ ", "")


def test_a_number_that_no_experiment_has_is_refused_with_those_they_have(ids: list[str], gaplab: Gaplab) -> None:
    said = gaplab("compare", *ids, "--at", "50")

    assert said.code == Exit.INVALID
    assert said.err == "gaplab: to: no experiment has 50 real-world evaluations; permitted: 0 to 2\n"
    assert gaplab("compare", *ids, "--at", "2").code == 0


def test_a_range_that_is_none_is_refused_in_words(ids: list[str], gaplab: Gaplab) -> None:
    wrong, backwards, alone = (
        gaplab("compare", *ids, "--at", "late"), gaplab("compare", *ids, "--at", "2-1"), gaplab("compare", ids[0])
    )  # fmt: skip

    assert wrong.code == Exit.USAGE
    assert "'late' is not a number of real-world evaluations" in wrong.err.replace("\n│ ", "")
    assert backwards.code == alone.code == Exit.INVALID
    assert "this names one" in alone.err
