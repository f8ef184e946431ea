"""The client as notebooks use it: what may be given, what frames look like, and what survives a copy."""

import copy
import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import gaplab
from gaplab import Client, ExperimentFailed, ExtraMissing, InvalidSamples, InvalidSpec, ServiceError
from gaplab.services.core.arrays import frozen
from gaplab.services.core.types import Simulator, Tuned
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.experiments import run, some_log
from tests.integration.test_client import BOTH, SMALL, client, network

__all__ = ["client", "network"]

TUNED: dict[str, Any] = SMALL | {"tunables": ["static_friction", "restitution"]}


def test_an_edit_is_a_dict(client: Client) -> None:
    id = client.submit(SMALL).id

    edited = client.edit(id, {"name": "wet", "add_tags": ["floor"]})

    assert (edited.name, edited.tags) == ("wet", ("floor",))
    with pytest.raises(ServiceError, match="nme"):
        client.edit(id, {"nme": "dry"})


def test_a_single_id_is_that_of_its_study(client: Client, finish: Callable[[], None]) -> None:
    study = client.submit(BOTH)
    finish()

    assert len(client.compare(study.id)) == 1
    assert client.curves(study.id) == client.curves([study.id])
    assert client.curves_csv(study.id) == client.curves_csv([study.id])


def test_a_study_or_an_experiment_stands_for_its_id(client: Client, finish: Callable[[], None]) -> None:
    study = client.submit(BOTH)
    first = client.tag(study, "wet").experiments[0]
    finish()

    assert client.study(study).tags == client.study(first).tags == ("wet",)
    assert client.study(first).experiments == (client.study(study).experiments[0],)
    assert client.experiment(first).id == client.curves(first)[0].experiment == first.id
    assert [each.experiment for each in client.curves([first, study])] == [each.id for each in study.experiments]
    assert client.samples(first).equals(client.samples(first.id))
    with pytest.raises(TypeError, match="an id or a name is a text, not 5"):
        client.study(5)  # type: ignore[arg-type]


def test_an_option_of_a_figure_changes_neither_its_format_nor_its_experiments(client: Client) -> None:
    id = client.submit(SMALL).id

    with pytest.raises(TypeError, match=r"^experiment, format: not an option of a figure; give ids first"):
        client.figure(id, format="png", experiment="x")


def test_archives_are_written_to_a_path_and_read_from_one(
    client: Client, finish: Callable[[], None], tmp_path: Path
) -> None:
    study, file = client.submit(BOTH | {"tunables": TUNED["tunables"]}), tmp_path / "study.zip"
    finish()

    client.export(study.id, file)
    assert client.import_(str(file)).study is not None
    kept = file.read_bytes()
    with pytest.raises(FileExistsError):
        client.export(study.id, file)
    with pytest.raises(ServiceError):
        client.export("unknown", tmp_path / "other.zip")
    assert (file.read_bytes(), [each.name for each in tmp_path.iterdir()]) == (kept, ["study.zip"])


def test_frames_have_the_same_types_with_and_without_rows(client: Client, finish: Callable[[], None]) -> None:
    computed = client.submit(TUNED).id
    finish()
    empty = client.submit(TUNED).id

    for table in ("samples", "simulators", "curve"):
        one, none = getattr(client, table)(computed), getattr(client, table)(empty)
        shared = [name for name in one if name in none]
        assert {"mean", "squared_error", "standard_error"} & set(shared)
        assert none.dtypes[shared].astype(str).to_dict() == one.dtypes[shared].astype(str).to_dict()
    both = pd.concat([client.samples(empty), client.samples(computed)], ignore_index=True)
    assert both["measured_at"].dt.year.min() >= 2026
    assert {"repetition", "iteration", "repeats"} <= set(both.groupby("kind").mean(numeric_only=True))


def test_a_failed_measurement_has_no_values(client: Client, finish: Callable[[], None]) -> None:
    experiment = client.submit(SMALL)
    finish()

    found = client.samples(experiment.id)

    assert set(found["repeats"][found["fitness"].isna()]) == {0}
    assert set(found["repeats"][found["fitness"].notna()]) == {1}
    with pytest.raises(ServiceError, match="sample"):
        client.samples(experiment.id, kind="transfer")


def test_copies_of_errors_and_comparisons_are_what_they_were(
    client: Client, finish: Callable[[], None], tmp_path: Path
) -> None:
    study = client.submit(BOTH)
    finish()
    pairs = client.compare(study.id)
    with pytest.raises(ServiceError) as refused:
        client.experiment("unknown")
    table = tmp_path / "runs.csv"
    table.write_text("gene_0,value\nx,0.5\n")
    with pytest.raises(InvalidSamples) as invalid:
        gaplab.read_samples(table, "toy_function")

    for error in (refused.value, invalid.value, ExperimentFailed(study), ExtraMissing("pandas", "notebook")):
        again = pickle.loads(pickle.dumps(error))
        assert (type(again), str(again)) == (type(error), str(error))
    assert pickle.loads(pickle.dumps(refused.value)).problem == refused.value.problem
    for copied in (copy.deepcopy(pairs), pickle.loads(pickle.dumps(pairs))):
        assert copied == pairs
        assert copied.frame().equals(pairs.frame())
        assert copied.latex() == pairs.latex()


def test_a_robot_of_samples_is_known_without_a_service(tmp_path: Path) -> None:
    (tmp_path / "runs.csv").write_text("gene_0,value\n0.5,0.5\n")
    with pytest.raises(InvalidSpec, match="unknown robot 'toy'"):
        gaplab.read_samples(tmp_path / "runs.csv", "toy")


def test_intervals_and_weights_of_a_tuner_are_columns(client: Client, sqlite_store: Store) -> None:
    experiment = client.submit(TUNED | {"repetitions": 1})
    (claim,) = execution.claim(sqlite_store, "me", 1)
    interval = frozen([[0.25, 0.75], [0.0, 0.5]])
    simulator = Simulator(frozen([0.5, 0.125]), 0.25, interval, weight=0.75)
    run(
        sqlite_store,
        claim,
        (replace(step, simulators=(simulator,)) if isinstance(step, Tuned) else step for step in some_log()),
    )

    found = client.simulators(experiment.id)

    named = TUNED["tunables"]
    assert list(found)[5:] == [*named, *(f"{name}_{end}" for name in named for end in ("lower", "upper")), "weight"]
    assert found.iloc[-1, 5:].tolist() == [0.5, 0.125, 0.25, 0.75, 0.0, 0.5, 0.75]
