"""How many tosses of a real cube tune its contact: `python -m benchmarks.cube PATH` of the tosses of ContactNets.

The data are of DAIRLab (BSD-3): https://github.com/DAIRLab/contact-nets. PATH is a table, CSV or Parquet, with a line
for each time, and the columns `toss, time_s, x_m … z_m, qw … qz`, velocities in the world, and turning in the body's
frame. An archive that is there already is not computed again.
"""

import json
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.kept import kept, strategy
from gaplab.api.library.pools import PoolOptions, import_pool
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.robots.importing import import_robot
from gaplab.services.robots.options import ImportOptions
from gaplab.services.specs.assembly import simulation_of
from gaplab.services.specs.recorded import held_out, pool_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import spec_of

WIDTH_M = 0.1048
CUBE = f"""<robot name="cube"><link name="cube"><inertial><mass value="0.37"/>
<inertia ixx="0.00081" ixy="0" ixz="0" iyy="0.00081" iyz="0" izz="0.00081"/></inertial>
<collision><geometry><box size="{WIDTH_M} {WIDTH_M} {WIDTH_M}"/></geometry></collision></link></robot>"""
TUNABLES: list[dict[str, Any]] = [
    {"name": "friction", "lower": 0.02, "upper": 1.0},  # of a cube whose static and dynamic coefficients are 1
    {"name": "restitution", "lower": 0.0, "upper": 0.6},
    {"name": "ground_height", "lower": -0.003, "upper": 0.003},
]
ROUNDS = 6
NAMES = [each["name"] for each in TUNABLES]


def widths(stored: dict[str, Any], simulators: FloatArray) -> FloatArray:
    """Return `(m,)`: the mean position error of simulators `(m, p)` over the held-out tosses, in widths of the cube."""
    spec = spec_of(stored)
    robot, pool, numbers = robot_of(spec), pool_of(spec), held_out(spec)
    outcomes = simulation_of(spec, robot).sense(frozen([[number] for number in numbers]), simulators)
    real = np.array([pool.readings(number)[:, :3] for number in numbers])
    away = np.linalg.norm(robot.sensors.values(outcomes[..., 1:])[..., :3] - real[:, None], axis=-1)
    return np.asarray(np.nanmean(away, axis=2).mean(axis=0) / WIDTH_M)


def spec_for(given: Namespace, folder: Path) -> dict[str, Any]:
    """Return the spec of the study, whose robot and pool are written into a folder."""
    file, robot, pool = folder / "cube.urdf", folder / "cube.json", folder / "tosses.json"
    file.write_text(CUBE, "utf-8")
    imported = import_robot(file, ImportOptions(static_friction=1.0, dynamic_friction=1.0))
    robot.write_text(json.dumps(imported.robot.content), "utf-8")
    options = PoolOptions(recording="toss", sensors=["place"], every_s=0.05, seconds=1.0)
    pool.write_text(import_pool(given.path, str(robot), "tosses", options).text, "utf-8")
    return {
        "name": f"cube in {given.engine}",
        "engine": given.engine,
        "strategies": given.strategies,
        "repetitions": given.orders,
        "direct_repetitions": 1,
        "iterations": given.tosses,
        "robot": str(robot),
        "tunables": TUNABLES,
        "tuner": {"name": "gauss_newton", "options": {"evaluations": given.evaluations, "rounds": ROUNDS}},
        "seed": given.seed,
        "budget": {"preset": "smoke", "simulator_evaluations": given.evaluations},
        "reality": {"kind": "recorded", "pool": str(pool)},
    }


def main() -> None:
    """Import the tosses, run the study, and print its verdict and what its simulators err by."""
    asked = ArgumentParser(description=__doc__)
    asked.add_argument("path", type=Path)
    asked.add_argument("--engine", default="mujoco")
    asked.add_argument("--strategies", nargs="+", type=strategy, default=["random", "direct"])
    asked.add_argument("--orders", type=int, default=40)
    asked.add_argument("--tosses", type=int, default=10)
    asked.add_argument("--evaluations", type=int, default=90)
    asked.add_argument("--seed", type=int, default=0)
    asked.add_argument("--output", type=Path, default=Path("cube.zip"))
    given = asked.parse_args()
    result = kept(given.output, lambda folder: spec_for(given, folder))
    print(result.verdict)
    best = result.simulators.query("rank == 0").copy()
    best["widths"] = widths(result.study.experiments[0].spec, frozen(best[NAMES]))
    shown = [*NAMES, "friction_lower", "friction_upper", "widths"]
    print(best.groupby(["name", "iteration"])[shown].mean().to_string())


if __name__ == "__main__":
    main()
