"""The numbers that the tutorial prints."""

import re
from pathlib import Path

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.experiments import reading
from gaplab.services.store.session import Store
from tests.experiments import submit_one
from tests.integration.test_bench import compute

ROOT = Path(__file__).parents[2]


def test_the_first_experiment_has_the_fitness_that_the_tutorial_says(sqlite_store: Store) -> None:
    spec = ExperimentSpec.model_validate_json((ROOT / "examples" / "smoke.json").read_text())
    submitted = submit_one(sqlite_store, spec)

    compute(sqlite_store)

    fitness = reading.read_experiment(sqlite_store, submitted.id).fitness
    assert fitness is not None
    said = re.findall(r'"([\d.]+ at \d+)"', (ROOT / "docs" / "tutorial.md").read_text())
    assert said == [f"{fitness.mean:.3g} at {fitness.evaluations}"]
