"""Overhead of gaplab beside physics: time of an evolution step, and memory of a worker."""

import resource
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np

from benchmarks.measure import Row, rates, ratio
from benchmarks.physics import genomes, simulation
from gaplab.services.core.arrays import FloatArray, Genomes, Parameters
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.core.search import Question, maximise
from gaplab.services.core.streams import stream
from gaplab.services.engines.base import Engine
from gaplab.services.engines.mujoco import MuJoCo
from gaplab.services.engines.pybullet.engine import PyBullet

STEPS = 20_000
ROLLOUTS = 5_000
PAGE = resource.getpagesize()


def evolution_step_s() -> float:
    """Return seconds of one step of the paper's evolution (ask, replacement, tell) without the cost of fitness."""

    def free(asked: Question) -> FloatArray:
        return asked.genomes[:, 0]

    begun = perf_counter()
    maximise(SteadyState(), Quadruped().space, free, STEPS, stream(0, "benchmark"))
    return (perf_counter() - begun) / STEPS


def resident_bytes() -> int:
    """Return the current memory of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


def memory(rollouts: int = ROLLOUTS) -> tuple[int, int, float]:
    """Return bytes after a tenth of the rollouts, bytes after all, and seconds a rollout; each simulator differs."""
    simulate, drawn, rng = simulation(), genomes(100), np.random.default_rng(0)
    early, begun = 0, perf_counter()
    for index in range(rollouts):
        simulate(drawn[[index % len(drawn)]], rng.random((1, 3)) * [1.5, 1.5, 0.6])
        if index == rollouts // 10:
            early = resident_bytes()
    return early, resident_bytes(), (perf_counter() - begun) / rollouts


def sensing(engine: Engine, rounds: int = 7) -> Row:
    """Return the rate of rollouts with readings beside those without, one controller in one simulator a call."""
    simulate, drawn, nominal = simulation(engine), genomes(40), np.array([[1.0, 0.8, 0.0]])

    def all_by(ask: Callable[[Genomes, Parameters], FloatArray]) -> Callable[[], int]:
        def work() -> int:
            for index in range(len(drawn)):
                ask(drawn[[index]], nominal)
            return len(drawn)

        return work

    found = rates({"with": all_by(simulate.sense), "without": all_by(simulate)}, rounds)
    share = ratio(found["with"], found["without"])
    return Row(f"readings, {engine.name}", f"{median(found['with']):.0f}/s", share, "without readings", "≥ 0.97")


def rows() -> list[Row]:
    """Measure an evolution step as a share of a rollout, memory over many rollouts, and the cost of readings."""
    step_s = evolution_step_s()
    early, late, rollout_s = memory()
    mebibyte = 2**20
    return [
        Row("evolution, one step", f"{1e6 * step_s:.0f} µs", step_s / rollout_s, "a PyBullet rollout", "≤ 0.01"),
        Row(
            f"memory of a process after {ROLLOUTS:,} rollouts",
            f"{late / mebibyte:.1f} MiB",
            late / early,
            f"after {ROLLOUTS // 10:,}: {early / mebibyte:.1f} MiB",
            "flat",
        ),
        sensing(PyBullet()),
        *([sensing(MuJoCo())] if MuJoCo.available() else []),
    ]
