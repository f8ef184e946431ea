"""`python -m benchmarks.bench_robot`: the quadruped on a bench, pretended by another process, measured once or thrice.

First without noise: the tuned simulators must equal those of the same engine as reality, to the bit. Then with noise,
wear, a battery and falls: simulators are tuned on one value a controller, on the mean of three, and on one value of
three times as many controllers, which costs the robot as many runs as three repeats. The table has the distance of the
best simulator from the truth, and what the last transferred controllers reach in a reality without noise, as a share of
the fitness that evolution directly in that reality reaches.
"""

import json
import os
import subprocess
import sys
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from gaplab.api.process.local_service import LocalService, local_service
from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.specs.assembly import engine_of
from tests.pretended_robot import SETTINGS

DRIVER = Path(__file__).parents[1] / "tests" / "pretended_robot.py"

ENGINE = "mujoco"

FAULTS = {"noise": 0.03, "latency_s": 0.05, "wear": 0.002, "battery": 40, "sag": 0.1, "falls": 0.02}
"""Of the pretended robot: noise in m/s, pause of a run in s, wear of friction a run, runs of a battery, lost amplitude,
share of falls."""


@dataclass(frozen=True)
class Arm:
    """A way to spend runs of the robot."""

    name: str
    repeats: int
    iterations: int


def main() -> None:
    """Run both parts, and print what they show; exit with 1 if the first finds another number."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=10)
    parser.add_argument("--iterations", type=int, default=3, help="of the arms with three repeats")
    parser.add_argument("--evaluations", type=int, default=200, help="of each search for a controller")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    spec = {
        "robot": "quadruped",
        "engine": ENGINE,
        "repetitions": given.repetitions,
        "seed": given.seed,
        "budget": {
            "controller_evaluations": given.evaluations,
            "selection_evaluations": given.evaluations,
            "simulator_evaluations": given.evaluations // 2,
        },
    }
    few, many = given.iterations, 3 * given.iterations
    arms = [Arm("one value", 1, few), Arm("one value, thrice the controllers", 1, many), Arm("three values", 3, few)]
    console = Console()
    with TemporaryDirectory(prefix="gaplab-bench-") as folder, local_service(folder) as service:
        equal = without_noise(service, Path(folder), spec | {"repetitions": 2, "iterations": 2})
        console.print(
            "Without noise, the simulators equal those of the engine to the bit." if equal else "They differ!"
        )
        direct = service.submit(spec | {"strategy": "direct", "iterations": few})
        console.print(with_noise(service, Path(folder), spec, arms, direct.id))
    sys.exit(not equal)


def without_noise(service: LocalService, folder: Path, spec: Mapping[str, Any]) -> bool:
    """Return whether a robot without noise gives the simulators that its engine gives."""
    strategy = {"strategy": "simulated_fit_and_informative"}
    engine = service.submit(dict(spec) | strategy)
    physical = service.submit(dict(spec) | strategy | {"reality": {"kind": "physical", "probes": "each"}})
    drive(service, physical.id, folder / "exact", {})
    service.wait(engine.id)
    mine, theirs = service.simulators(physical.id), service.simulators(engine.id)
    return bool(mine[list(theirs.columns)].equals(theirs))


def with_noise(service: LocalService, folder: Path, spec: Mapping[str, Any], arms: list[Arm], direct: str) -> Table:
    """Return a row for each arm: runs, distance from the truth and real fitness over direct, with 95 % intervals."""
    table = Table(title=f"A robot with {', '.join(f'{name} {value:g}' for name, value in FAULTS.items())}")
    for column in ("", "runs", "distance from the truth", "fitness over direct"):
        table.add_column(column, justify="left" if not column else "right")
    service.wait(direct)
    truth, best = service.experiment(direct).spec["reality"]["parameters"], float(np.mean(reached(service, direct)))
    for arm in arms:
        reality = {"kind": "physical", "probes": "last", "repeats": arm.repeats, "bench": arm.name}
        own = {"strategy": "simulated_fit_and_informative", "iterations": arm.iterations, "reality": reality}
        experiment = service.submit(dict(spec) | own).id
        drive(service, experiment, folder / arm.name.replace(" ", "-").replace(",", ""), FAULTS)
        share = np.array(reached(service, experiment)) / best
        runs = arm.repeats * (arm.iterations + 1)
        table.add_row(arm.name, f"{runs}", _interval(distances(service, experiment, truth)), _interval(list(share)))
    return table


def drive(service: LocalService, experiment: str, journal: Path, settings: Mapping[str, Any]) -> None:
    """Let the pretended robot measure what the experiment asks for, to its end."""
    counted = {"engine": ENGINE, "journal": str(journal.with_suffix(".runs"))} | dict(settings)
    command = [sys.executable, "-m", "gaplab", "drive", experiment, "--driver", str(DRIVER), "--journal", str(journal)]
    command += ["--limit-s", "600"]  # of a machine that does other work too
    environment = os.environ | {SETTINGS: json.dumps(counted), "GAPLAB_URL": service.url}
    done = subprocess.run(command, env=environment, cwd=journal.parent, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"gaplab drive ended with {done.returncode}: {done.stderr}")


def distances(service: LocalService, experiment: str, truth: Mapping[str, float]) -> list[float]:
    """Return the distance of each repetition's last best simulator from the truth, in shares of the bounds."""
    table = service.simulators(experiment)
    last = table[(table["rank"] == 0) & (table["iteration"] == table["iteration"].max())]
    spec = service.experiment(experiment).spec
    extent = {each["name"]: each["upper"] - each["lower"] for each in spec["tunables"]}
    off = [(last[name] - truth[name]) / extent[name] for name in extent]
    return [float(each) for each in np.linalg.norm(off, axis=0)]


def reached(service: LocalService, experiment: str) -> list[float]:
    """Return the fitness of the last controller that each repetition transfers, in a reality without noise, in m/s."""
    table = service.samples(experiment, kind="probe")
    last = table[table["iteration"] == table["iteration"].max()]
    genes = [name for name in last.columns if name.startswith("gene_")]
    robot, engine = Quadruped(), engine_of(PluginRef(name=ENGINE))
    motions = [robot.motion(genome) for genome in last[genes].to_numpy(float)]
    return [float(value) for value in robot.fitness(engine.rollouts([robot.world], motions))[:, 0]]


def _interval(found: Sequence[float]) -> str:
    """Return the mean with the half width of its 95 % interval by bootstrap."""
    values = np.array(found)
    means = np.random.default_rng(0).choice(values, (10_000, len(values))).mean(1)
    return f"{values.mean():.3f} ± {np.ptp(np.quantile(means, [0.025, 0.975])) / 2:.3f}"


if __name__ == "__main__":
    main()
