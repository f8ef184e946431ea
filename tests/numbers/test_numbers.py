"""The same spec and seed give the numbers that they gave when the archives were kept, to the last bit.

Only a change whose CHANGELOG entry announces other numbers may write the archives again: `tests/numbers/keep.py`.
"""

import json
from io import BytesIO
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.archives import export, import_archive
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import reading
from gaplab.services.results import curves
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve
from gaplab.services.store.queries.logs import columns_of
from gaplab.services.store.session import Store
from tests.numbers.kept_numbers import CURVES, FOLDER, archive, exact, numbers, other_machine, other_versions, tables
from tests.numbers.specs import STUDIES
from tests.parameters import few

SAMPLE = ("repetition", "iteration", "kind", "genome", "fitness")
SIMULATOR = ("repetition", "iteration", "rank", "parameters", "squared_error")
KEPT = sorted(file.stem for file in FOLDER.glob("*.zip"))


def rows(steps: Any) -> Any:
    """The tally and the steps that an archive has of one repetition, in exact floats."""
    costs = [step.cost for step in steps if hasattr(step, "cost")]
    tally = {
        "steps": len(steps),
        "rollouts_done": sum(each.rollouts for each in costs),
        "rollouts_failed": sum(each.failures for each in costs),
        "rollouts_saved": sum(each.saved for each in costs),
    }
    return tally, [exact(unsigned(columns_of(step))) for step in steps]


def unsigned(columns: Any) -> Any:
    """As a database has it: without the sign of a zero."""
    return columns | {name: columns[name] + 0.0 for name in ("fitness", "recorded") if columns[name] is not None}


WITH_BODIES = {"mujoco", "physx", "pybullet"}
"""Archives of engines that take seconds for a repetition; the others have the numbers of each strategy."""


def in_part(name: Any, spec: Any) -> Any:
    """Whether an experiment is computed for every change."""
    return name not in WITH_BODIES or spec.strategy.name in {"simulated_fit_and_informative", "direct"}


@pytest.mark.parametrize("name", KEPT)
@pytest.mark.parametrize("whole", [False, pytest.param(True, marks=pytest.mark.release)], ids=["part", "whole"])
def test_the_pure_loop_computes_the_kept_numbers(name: Any, whole: Any) -> None:
    found = tables(archive(name))
    specs = [ResolvedSpec.model_validate(each["spec"]) for each in found["experiment"]]
    kept = [(spec, each) for spec, each in zip(specs, numbers(found), strict=True) if whole or in_part(name, spec)]

    computed = computed_from(spec for spec, _ in kept)

    expected = [each for _, each in kept]
    if computed != expected and (other := other_machine()):
        pytest.skip(f"the numbers differ, and so does the machine: {other}")
    assert computed == expected, other_versions(found)


def computed_from(specs: Any) -> Any:
    return [[rows(list(repetition(setting(spec, each)))) for each in range(spec.repetitions)] for spec in specs]


@pytest.mark.parametrize("name", ["analytic", "cma_es", "options"])
@pytest.mark.release
def test_explicit_old_options_give_the_kept_numbers(name: Any) -> None:
    kept = numbers(tables(archive(name)))

    computed = computed_from(resolve(STUDIES[name]))

    if computed != kept and (other := other_machine()):
        pytest.skip(f"the numbers differ, and so does the machine: {other}")
    assert computed == kept


def test_every_kept_spec_has_the_options_of_its_study() -> None:
    for name, study in STUDIES.items():
        stored = [ResolvedSpec.model_validate(each["spec"]) for each in tables(archive(name))["experiment"]]
        for old, new in zip(stored, resolve(study), strict=True):
            assert old.budget == new.budget
            assert old.strategy == new.strategy


def test_a_search_of_its_own_gives_simulated_fit_other_numbers() -> None:
    (fit, *_) = resolve(STUDIES["analytic"])
    (kept, *_) = numbers(tables(archive("analytic")))
    budget = fit.budget.model_copy(update={"reuse_transfer": False})

    (computed,) = computed_from([fit.model_copy(update={"budget": budget})])

    assert computed != kept


@pytest.fixture(scope="module", params=few(KEPT, {"analytic", "mujoco"}.__contains__))
def kept(request: pytest.FixtureRequest) -> Any:
    """A kept archive: its bytes, what is in it, and its curves."""
    data = archive(request.param)
    return data, tables(data), json.loads(CURVES.read_text())[request.param]


def test_an_import_shows_and_exports_the_kept_numbers(kept: Any, store: Store) -> None:
    data, found, expected = kept

    imported = import_archive(store, BytesIO(data))

    assert imported.experiments == tuple(each["id"] for each in found["experiment"])
    assert not imported.called_off
    assert_shown(store, found, expected)
    with export(store, imported.study).file as file:
        exported = tables(file.read())
    for table in found:
        pairs = zip(exported[table], found[table], strict=True)
        assert [chosen(row, old) for row, old in pairs] == exact(found[table])


def assert_shown(store: Store, found: Any, expected: Any) -> None:
    for experiment, curve in zip(found["experiment"], expected, strict=True):
        id_ = experiment["id"]
        assert reading.read_experiment(store, id_).spec == experiment["spec"]
        assert pages(reading.list_samples, store, id_, SAMPLE) == kept_samples(found, id_)
        assert pages(reading.list_simulators, store, id_, SIMULATOR) == kept_simulators(found, experiment)
        shown = curves.curve(store, id_)
        assert chosen(shown.model_dump(mode="json"), curve) == exact(curve)
        assert points(shown) == kept_points(found, id_)


def chosen(row: Any, columns: Any) -> Any:
    """These columns of a row, in exact floats; later versions may add others."""
    return exact({name: row[name] for name in columns})


def pages(read: Any, store: Store, experiment: Any, columns: Any) -> Any:
    """These columns of everything that all pages show."""
    items, cursor = [], None
    while True:
        page = read(store, experiment, limit=7, cursor=cursor)
        items += [chosen(each.model_dump(mode="json"), columns) for each in page.items]
        if (cursor := page.next) is None:
            return items


def own(found: Any, experiment: Any, *kinds: Any) -> Any:
    """The steps of these kinds of an experiment, by repetition and place."""
    return [row for row in found["step"] if row["experiment_id"] == experiment and row["kind"] in kinds]


def kept_samples(found: Any, experiment: Any) -> Any:
    """In the order of the log: the sample of an iteration before its probe."""
    genomes = {
        (row["repetition"], row["iteration"]): row["body"]["genome"] for row in own(found, experiment, "transferred")
    }
    samples = [
        row
        | {"kind": "sample" if row["kind"] == "measured" else "probe"}
        | {"genome": row["body"].get("genome") or genomes[row["repetition"], row["iteration"]]}
        for row in own(found, experiment, "measured", "probed")
    ]
    return [chosen(row, SAMPLE) for row in samples]


def kept_simulators(found: Any, experiment: Any) -> Any:
    names = [each["name"] for each in experiment["spec"]["tunables"]]
    return [
        chosen(
            row | {"rank": rank, "parameters": dict(zip(names, each["parameters"], strict=True))} | errors, SIMULATOR
        )
        for row in own(found, experiment["id"], "tuned")
        for rank, each in enumerate(row["body"]["simulators"])
        for errors in [{"squared_error": each["squared_error"]}]
    ]


def points(curve: Any) -> Any:
    """The values of a curve, by real-world evaluations and repetition."""
    return exact({(at.evaluations, number): value for at in curve.points for number, value in enumerate(at.values)})


def kept_points(found: Any, experiment: Any) -> Any:
    return exact({(row["iteration"], row["repetition"]): row["recorded"] for row in own(found, experiment, "probed")})


def test_every_study_is_kept_and_small() -> None:
    assert set(STUDIES) == set(KEPT)
    assert sum(file.stat().st_size for file in FOLDER.iterdir()) < 1_000_000


@pytest.mark.parametrize("kind", ["measured", "tuned", "transferred", "probed"])
def test_the_last_bit_of_a_float_makes_a_difference(kind: Any) -> None:
    found = tables(archive("options"))
    before = numbers(found)
    row = next(row for row in found["step"] if row["kind"] == kind)
    place = row if row["fitness"] is not None else row["body"]["simulators"][0]
    column = "fitness" if place is row else "squared_error"

    place[column] = float(np.nextafter(place[column], 1e9))

    assert numbers(found) != before
