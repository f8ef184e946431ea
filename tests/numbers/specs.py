"""Experiments whose numbers are kept: every strategy on every engine, both optimizers, other options than the defaults.

They state the options with which their numbers were kept; the defaults are others.

The budgets are tiny, so that all of it together is computed in seconds. A change here takes effect with the next
`python -m tests.numbers.keep`; the tests read what the archives hold.
"""

from typing import Any

from gaplab.schemas.spec import ExperimentSpec, StudySpec

_WEIGHTS = {"least_error": 0.03}
_ENSEMBLE = {"simulators": 3} | _WEIGHTS
_UNIQUE = {"name": "simulated_fit_and_unique", "options": {"distances": "plain"}}
_ALL: Any = [
    "simulated_fit",
    _UNIQUE,
    {"name": "informative", "options": _WEIGHTS},
    {"name": "simulated_fit_and_informative", "options": _WEIGHTS},
    "random",
    "known_fit",
    "direct",
]
_QUADRUPED: dict[str, Any] = {
    "robot": "quadruped",
    "optimizer": {"name": "steady_state", "options": {"population": 4}},
    "iterations": 2,
    "repetitions": 2,
    "direct_repetitions": 3,
    "budget": {
        "controller_evaluations": 8,
        "selection_evaluations": 6,
        "simulator_evaluations": 6,
        "reuse_transfer": True,
    },
    "seed": 2012,
    "strategies": [
        "simulated_fit",
        _UNIQUE,
        {"name": "informative", "options": _ENSEMBLE},
        {"name": "simulated_fit_and_informative", "options": _ENSEMBLE},
        "random",
        "known_fit",
        "direct",
    ],
}
_TOY: dict[str, Any] = {
    "robot": "toy_function",
    "iterations": 2,
    "repetitions": 2,
    "budget": {
        "controller_evaluations": 40,
        "selection_evaluations": 30,
        "simulator_evaluations": 40,
        "reuse_transfer": True,
    },
    "strategies": _ALL,
}

STUDIES = {
    name: StudySpec.model_validate({"name": name, **study})
    for name, study in {
        "analytic": {**_TOY, "direct_repetitions": 3, "seed": 2012},
        "pybullet": {**_QUADRUPED, "engine": "pybullet", "repetitions": 1, "direct_repetitions": 2},
        "mujoco": {**_QUADRUPED, "engine": "mujoco"},
        "physx": {**_QUADRUPED, "engine": "physx", "repetitions": 1, "direct_repetitions": 2},
        "cma_es": {
            **_TOY,
            "iterations": 3,
            "optimizer": {"name": "cma_es", "options": {"population": 6, "initial_scale": 0.2, "members": 4}},
            "seed": 2**64 - 1,
            "strategies": [
                "simulated_fit",
                _UNIQUE,
                {"name": "simulated_fit_and_informative", "options": _WEIGHTS},
                "direct",
            ],
        },
        "options": {
            **_TOY,
            "budget": {**_TOY["budget"], "reuse_transfer": False},
            "optimizer": {"name": "steady_state", "options": {"population": 7, "tournament": 2, "crossover": 0.8}},
            "tunables": [
                {"name": "dynamic_friction", "lower": 0.1, "upper": 1.0},
                {"name": "static_friction", "lower": 0.2, "upper": 1.2},
            ],
            "reality": {"parameters": {"static_friction": 0.5, "dynamic_friction": 0.35}},
            "seed": 7,
            "strategies": [
                "simulated_fit",
                {"name": "informative", "options": {"simulators": 4, "least_error": 0.2}},
                {
                    "name": "simulated_fit_and_informative",
                    "options": _WEIGHTS | {"simulators": 5, "fit_weight": 0.5, "informative_weight": 4.0},
                },
                {"name": "known_fit", "options": {"spread": 0.6}},
            ],
        },
        "elsewhere": {
            **_QUADRUPED,
            "robot": {"name": "quadruped", "options": {"counted_s": 3.0}},
            "engine": {"name": "mujoco", "options": {"threads": 2}},
            "optimizer": {"name": "cma_es", "options": {"population": 4, "members": 3}},
            "tunables": ["restitution", {"name": "static_friction", "lower": 0.3, "upper": 2.5}],
            "reality": {"engine": "physx", "parameters": {"restitution": 0.2}},
            "seed": 41,
            "strategies": ["simulated_fit", {"name": "simulated_fit_and_informative", "options": _ENSEMBLE}, "direct"],
        },
        "long": {
            **_TOY,
            "iterations": 1,
            "repetitions": 2,
            "budget": {
                "controller_evaluations": 1_000,
                "selection_evaluations": 300,
                "simulator_evaluations": 300,
                "reuse_transfer": True,
            },
            "seed": 3,
            "strategies": [{"name": "simulated_fit_and_informative", "options": _WEIGHTS}],
        },
    }.items()
}
"""By the name of the archive. `long` takes seconds, so that a test has time to kill it."""

HALF_WAY = ExperimentSpec.model_validate(
    STUDIES["long"].model_dump(exclude={"strategies", "direct_repetitions"})
    | {"strategy": {"name": "simulated_fit_and_informative", "options": _WEIGHTS}}
)
"""The experiment of `long`, which the kept database has half computed."""
