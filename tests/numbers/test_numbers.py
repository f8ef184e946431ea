"""The same spec and seed give the numbers that they gave when the archives were kept, to the last bit.

Only a change whose CHANGELOG entry announces other numbers may write the archives again: `tests/numbers/keep.py`.
"""

from io import BytesIO
from math import isfinite
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.archives import export, import_archive
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Measured, Probed, Selected, Transferred, Tuned
from gaplab.services.experiments import reading
from gaplab.services.results import curves
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve
from gaplab.services.store.session import Store
from tests.numbers.kept_numbers import (
    FOLDER,
    ITERATION,
    archive,
    exact,
    members,
    numbers,
    other_machine,
    other_versions,
)
from tests.numbers.specs import STUDIES
from tests.parameters import few

SAMPLE = ("repetition", "iteration", "kind", "genome", "fitness")
SIMULATOR = ("repetition", "iteration", "rank", "parameters", "squared_error")
KEPT = sorted(file.stem for file in FOLDER.glob("*.zip"))


def rows(steps: Any) -> Any:
    """The rows that an archive has of the steps of one repetition, in exact floats."""
    iterations, samples, simulators = {}, [], []  # type: ignore[var-annotated]
    for step in steps:
        row = iterations.setdefault(step.iteration, {"number": step.iteration, **dict.fromkeys(ITERATION)})
        match step:
            case Selected():
                row |= {"selected_genome": vector(step.genome), **cost("selection", step)}
            case Measured():
                samples.append((step.iteration, "sample", vector(step.sample.genome), number(step.sample.fitness)))
            case Tuned():
                row |= cost("tuning", step)
                simulators += [
                    (step.iteration, rank, vector(each.parameters), number(each.squared_error))
                    for rank, each in enumerate(step.simulators)
                ]
            case Transferred():
                row |= {"transferred_genome": vector(step.genome), "simulated_fitness": number(step.fitness)}
                row |= cost("transfer", step)
            case Probed():
                samples.append((step.iteration, "probe", row["transferred_genome"], number(step.fitness)))
                row["recorded_fitness"] = number(step.recorded)
    costs = [step.cost for step in steps if hasattr(step, "cost")]
    tally = {
        "steps": len(steps),
        "iterations_done": len(iterations),
        "rollouts_done": sum(each.rollouts for each in costs),
        "rollouts_failed": sum(each.failures for each in costs),
        "rollouts_saved": sum(each.saved for each in costs),
    }
    return {
        "repetition": [tally],
        "iteration": list(iterations.values()),
        "measurement": [dict(zip(("iteration", "kind", "genome", "fitness"), each, strict=True))
                        for each in sorted(samples, key=lambda sample: sample[:2])],
        "simulator": [dict(zip(("iteration", "rank", "parameters", "squared_error"), each, strict=True))
                      for each in simulators],
    }  # fmt: skip


def vector(values: Any) -> Any:
    assert values.dtype == np.float64
    return exact(values.tolist())


def number(value: Any) -> Any:
    """As a database has it: without nan, infinities, and the sign of a zero."""
    return exact(float(value) + 0.0) if isfinite(value) else None


def cost(phase: Any, step: Any) -> Any:
    return {f"{phase}_{name}": getattr(step.cost, name) for name in ("rollouts", "failures", "saved")}


WITH_BODIES = {"mujoco", "physx", "pybullet"}
"""Archives of engines that take seconds for a repetition; the others have the numbers of each strategy."""


def in_part(name: Any, spec: Any) -> Any:
    """Whether an experiment is computed for every change."""
    return name not in WITH_BODIES or spec.strategy.name in {"simulated_fit_and_informative", "direct"}


@pytest.mark.parametrize("name", KEPT)
@pytest.mark.parametrize("whole", [False, pytest.param(True, marks=pytest.mark.release)], ids=["part", "whole"])
def test_the_pure_loop_computes_the_kept_numbers(name: Any, whole: Any) -> None:
    found = members(archive(name))
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
    kept = numbers(members(archive(name)))

    computed = computed_from(resolve(STUDIES[name]))

    if computed != kept and (other := other_machine()):
        pytest.skip(f"the numbers differ, and so does the machine: {other}")
    assert computed == kept


def test_every_kept_spec_has_the_options_of_its_study() -> None:
    for name, study in STUDIES.items():
        stored = [ResolvedSpec.model_validate(each["spec"]) for each in members(archive(name))["experiment"]]
        for old, new in zip(stored, resolve(study), strict=True):
            assert old.budget == new.budget
            assert old.strategy == new.strategy


def test_a_search_of_its_own_gives_simulated_fit_other_numbers() -> None:
    (fit, *_) = resolve(STUDIES["analytic"])
    (kept, *_) = numbers(members(archive("analytic")))
    budget = fit.budget.model_copy(update={"reuse_transfer": False})

    (computed,) = computed_from([fit.model_copy(update={"budget": budget})])

    assert computed != kept


@pytest.fixture(scope="module", params=few(KEPT, {"analytic", "mujoco"}.__contains__))
def kept(request: pytest.FixtureRequest) -> Any:
    """A kept archive: its bytes, and what is in it."""
    data = archive(request.param)
    return data, members(data)


def test_an_import_shows_and_exports_the_kept_numbers(kept: Any, store: Store) -> None:
    data, found = kept

    imported = import_archive(store, BytesIO(data))

    assert imported.experiments == tuple(each["id"] for each in found["experiment"])
    assert not imported.called_off
    assert_shown(store, found)
    with export(store, imported.study).file as file:
        assert_exported(members(file.read()), found)


def assert_shown(store: Store, found: Any) -> None:
    for experiment, curve in zip(found["experiment"], found["curves"], strict=True):
        id_ = experiment["id"]
        assert reading.read_experiment(store, id_).spec == experiment["spec"]
        assert pages(reading.list_samples, store, id_, SAMPLE) == kept_samples(found, id_)
        assert pages(reading.list_simulators, store, id_, SIMULATOR) == kept_simulators(found, experiment)
        shown = curves.curve(store, id_)
        assert chosen(shown.model_dump(mode="json"), curve) == exact(curve)
        assert points(shown) == kept_points(found, id_)


def assert_exported(exported: Any, found: Any) -> None:
    assert exported["spec"] == found["spec"]
    for table in set(found) - {"manifest", "spec"}:
        pairs = zip(exported[table], found[table], strict=True)
        assert [chosen(row, old) for row, old in pairs] == exact(found[table])


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


def kept_samples(found: Any, experiment: Any) -> Any:
    """In the order of the log: the sample of an iteration before its probe."""
    own = [row for row in found["measurement"] if row["experiment"] == experiment]
    own.sort(key=lambda row: (row["repetition"], row["iteration"], row["kind"] == "probe"))
    return [chosen(row, SAMPLE) for row in own]


def kept_simulators(found: Any, experiment: Any) -> Any:
    names = [each["name"] for each in experiment["spec"]["tunables"]]
    own = [row for row in found["simulator"] if row["experiment"] == experiment["id"]]
    named = [row | {"parameters": dict(zip(names, row["parameters"], strict=True))} for row in own]
    return [chosen(row, SIMULATOR) for row in named]


def points(curve: Any) -> Any:
    """The values of a curve, by real-world evaluations and repetition."""
    return exact({(at.evaluations, number): value for at in curve.points for number, value in enumerate(at.values)})


def kept_points(found: Any, experiment: Any) -> Any:
    own = [row for row in found["iteration"] if row["experiment"] == experiment]
    return exact({(row["number"], row["repetition"]): row["recorded_fitness"] for row in own})


def test_every_study_is_kept_and_small() -> None:
    assert set(STUDIES) == set(KEPT)
    assert sum(file.stat().st_size for file in FOLDER.iterdir()) < 1_000_000


@pytest.mark.parametrize("table", ["iteration", "measurement", "simulator"])
def test_the_last_bit_of_a_float_makes_a_difference(table: Any) -> None:
    found = members(archive("options"))
    before = numbers(found)
    row, column = next((row, name) for row in found[table] for name in row if isinstance(row[name], float))

    row[column] = float(np.nextafter(row[column], 1e9))

    assert numbers(found) != before
