"""Comparisons leave the service: as CSV, as a table for a paper, and as a frame."""

import csv
import io
import json
from collections.abc import Callable

import pytest
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.api.clients.client import Client
from gaplab.api.commands.exit_codes import Exit
from gaplab.schemas.curves import Comparison, Test
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.experiments import submission
from gaplab.services.results.comparison_tables import comparisons_csv, comparisons_latex, escaped
from gaplab.services.store.session import Store
from tests.commands import Gaplab
from tests.experiments import toy


@pytest.fixture
def ids(sqlite_store: Store, finish: Callable[[], None]) -> list[str]:
    """Three experiments with results; a name has signs that tables treat as their own."""
    names = ("half & half_100%", "=1+1", "plain")
    specs: list[ExperimentSpec] = [toy(name=name, repetitions=4) for name in names]
    made = [submission.submit_experiment(sqlite_store, spec).id for spec in specs]
    finish()
    return made


def test_csv_has_every_number_of_the_json(ids: list[str], sqlite_store: Store) -> None:
    with TestClient(create_app(sqlite_store), base_url="http://localhost") as api:
        plain = api.get("/comparisons", params={"experiment": ids, "from": 2, "to": 2}).json()
        answer = api.get("/comparisons", params={"experiment": ids, "from": 2, "to": 2, "format": "csv"})

    rows = list(csv.DictReader(io.StringIO(answer.text)))
    assert answer.headers["content-type"].startswith("text/csv")
    assert len(rows) == len(plain) == 3
    for row, pair in zip(rows, plain, strict=True):
        assert (row["first"], row["second"]) == (pair["first"], pair["second"])
        for test in ("student", "welch", "mann_whitney"):
            for value in ("statistic", "p", "p_holm"):
                expected = pair[test][value]
                assert row[f"{test}_{value}"] == ("" if expected is None else repr(expected))
    assert {row["second_name"] for row in rows} == {"'=1+1", "plain"}


def test_latex_prints_names_as_they_are_and_rounds_p_as_papers_do() -> None:
    test = Test(statistic=3.0, p=0.0001, p_holm=0.0003)
    pair = Comparison(
        first="a", second="b", first_name="half & half_100%", second_name=r"a\b{c}^~", from_evaluations=3,
        to_evaluations=5, n_first=9, n_second=9, difference=-0.25, effect_size=None, student=test,
        welch=test.model_copy(update={"p_holm": 0.0412}), mann_whitney=Test(statistic=None, p=None),
    )  # fmt: skip

    table = comparisons_latex([pair], "m/s")

    assert (
        r"half \& half 100\% & a\textbackslash{}b\{c\}\textasciicircum{}\textasciitilde{} & 9, 9 & $-0.25$ & -- & "
        in table
    )
    assert r"& $-0.25$ & -- & $<0.001$ & $0.041$ & -- \\" in table
    assert "pooled over 3 to 5 real-world evaluations" in table
    assert "in m/s" in table
    assert table.count("{") == table.count("}") - table.count(r"\}") + table.count(r"\{")
    assert comparisons_csv([pair]).count("\n") == 2
    assert escaped("a\n b") == "a b"


def test_the_client_gives_a_tuple_with_a_frame_and_a_table(ids: list[str], url: str) -> None:
    with Client(url) as client:
        pairs = client.compare(ids)
        frame, latex, text = pairs.frame(), pairs.latex(), pairs.csv()
        pooled = client.compare(ids, 1, 2)

    assert [pair.first for pair in pairs] == list(frame["first"])
    assert (pairs[0].from_evaluations, pairs[0].to_evaluations) == (2, 2)  # the last that all have
    assert (pooled[0].from_evaluations, pooled[0].to_evaluations) == (1, 2)
    assert frame["student_p_holm"].dtype == float
    assert r"\begin{tabular}" in latex
    assert text.startswith("first,first_name,")


def test_the_command_prints_each_format(ids: list[str], gaplab: Gaplab) -> None:
    table, text, document, latex = (
        gaplab("compare", *ids, "--at", "2", "--format", name) for name in ("table", "csv", "json", "latex")
    )

    assert "p Mann-Whitney" in table.out
    assert "plain" in table.out
    assert len(text.out.splitlines()) == 1 + 3
    assert json.loads(document.out)[0]["to_evaluations"] == 2
    assert r"\toprule" in latex.out
    assert "pooled over 1 to 2" in gaplab("compare", *ids, "--at", "1-2").out


def test_a_range_that_is_none_is_refused_in_words(ids: list[str], gaplab: Gaplab) -> None:
    wrong, backwards, alone = (
        gaplab("compare", *ids, "--at", "late"), gaplab("compare", *ids, "--at", "2-1"), gaplab("compare", ids[0])
    )  # fmt: skip

    assert wrong.code == Exit.USAGE
    assert "'late' is no number of real-world evaluations" in wrong.err.replace("\n│ ", "")
    assert backwards.code == alone.code == Exit.INVALID
    assert "at least 2 items" in alone.err
