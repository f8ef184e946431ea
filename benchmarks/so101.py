"""How few motions tune a real arm: `python -m benchmarks.so101 TABLE ROBOT` of the SO-101 of SAGE.

The data are of isaac-sim2real/sage, the robot of TheRobotStudio/SO-ARM100 (both Apache-2.0). TABLE is CSV or Parquet,
with a line for each time, and the columns `motion, time_s, command_J, position_J` of the joints below, in rad. ROBOT is
the MJCF. Errors are root mean squares over time, and their mean over joints and held-out motions. With `--sysid N`, the
motions of the first N orders are given to `mujoco.sysid`, too. An archive that is there already is not computed again.
"""

import json
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

import numpy as np

import gaplab
from benchmarks.kept import kept, strategy
from gaplab.api.library.pools import PoolOptions, import_pool
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.robots.importing import import_robot
from gaplab.services.robots.options import ImportOptions
from gaplab.services.specs.assembly import engine_of, simulation_of
from gaplab.services.specs.recorded import held_out, pool_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.simulation import Simulation
from gaplab.services.specs.stored_specs import spec_of

JOINTS = {
    "shoulder_pan": "Rotation",
    "shoulder_lift": "Pitch",
    "elbow_flex": "Elbow",
    "wrist_flex": "Wrist_Pitch",
    "wrist_roll": "Wrist_Roll",
    "gripper": "Jaw",
}
STEP_S = 0.005
BELOW_M = -1.0
"""Height of the ground, out of reach: the arm goes below its base, where its file has nothing."""
EACH = {
    "kp({}, as=value)": (0.5, 40.0),
    "joint_damping({})": (0.0, 3.0),
    "joint_friction({})": (0.0, 1.0),
    "joint_static_friction({})": (0.0, 0.5),
    "armature({})": (0.0, 0.1),
    "bias({})": (-0.1, 0.1),
}
SHARED = {"delay": (0.0, 0.1), "kd(as=value)": (0.0, 0.3)}
BOUNDS = {label.format(joint): bounds for joint in JOINTS for label, bounds in EACH.items()} | SHARED


def errors(stored: dict[str, Any], simulators: FloatArray | None) -> FloatArray:
    """Return `(m,)`: errors on held-out motions of simulators `(m, p)`, or of the robot as its file has it, rad."""
    spec = spec_of(stored)
    robot, pool, numbers = robot_of(spec), pool_of(spec), held_out(spec)
    simulation = simulation_of(spec, robot)
    if simulators is None:
        simulation, simulators = Simulation(robot, engine_of(spec.engine), []), np.empty((1, 0))
    outcomes = simulation.sense(frozen([[number] for number in numbers]), frozen(simulators))
    away = robot.sensors.values(outcomes[..., 1:]) - np.array([pool.readings(number) for number in numbers])[:, None]
    squares = np.nanmean((away**2).reshape(*away.shape[:2], -1, len(JOINTS)), axis=2)
    return np.asarray(np.sqrt(squares).mean(axis=(0, 2)))


def compared(result: gaplab.Result, robot: Path, orders: int, motions: int) -> None:
    """Print the errors of gaplab and of `mujoco.sysid` on the motions that the first strategy chose."""
    from benchmarks.sysid import Arm  # an extra of MuJoCo, for this alone

    one = result.study.experiments[0]
    spec = spec_of(one.spec)
    arm = Arm(robot, pool_of(spec), {name.replace(", as=value", ""): bounds for name, bounds in BOUNDS.items()}, STEP_S)
    unseen = held_out(spec)
    print(f"mujoco.sysid, untuned: {arm.errors(unseen).mean():.5f} rad")
    some = f"name == {one.name!r} and iteration"
    chosen = result.samples.query(f"{some} <= {motions}").groupby("repetition")
    for number, rows in list(chosen)[:orders]:
        fitted = [int(each) for each in rows["gene_0"]]
        best = result.simulators.query(f"{some} == {motions} and rank == 0 and repetition == {number}")
        ours = errors(one.spec, _parameters(best))[0]
        theirs = arm.errors(unseen, fitted).mean()
        print(f"order {number}, motions {fitted}: gaplab {ours:.5f}, sysid {theirs:.5f} rad, ratio {ours / theirs:.3f}")


def _parameters(rows: Any) -> FloatArray:  # noqa: ANN401 - a data frame
    return frozen(rows[list(BOUNDS)])


def spec_for(given: Namespace, folder: Path) -> dict[str, Any]:
    """Return the spec of the study, whose robot and pool are written into a folder."""
    robot, pool = folder / "so101.json", folder / "motions.json"
    imported = import_robot(given.robot, ImportOptions(name="so101", time_step_s=STEP_S, ground_m=BELOW_M))
    robot.write_text(json.dumps(imported.robot.content), "utf-8")
    options = PoolOptions(columns=JOINTS, recording="motion", every_s=0.1, seconds=given.seconds)
    pool.write_text(import_pool(given.table, str(robot), "motions", options).text, "utf-8")
    return {
        "name": "SO-101",
        "robot": str(robot),
        "engine": "mujoco",
        "strategies": given.strategies,
        "repetitions": given.orders,
        "direct_repetitions": 1,
        "iterations": given.motions,
        "tunables": [{"name": name, "lower": low, "upper": high} for name, (low, high) in BOUNDS.items()],
        "tuner": "least_squares",
        "seed": given.seed,
        "budget": {"preset": "smoke", "simulator_evaluations": given.evaluations},
        "reality": {"kind": "recorded", "pool": str(pool)},
    }


def main() -> None:
    """Import the motions, run the study, and print its verdict, curve and errors."""
    asked = ArgumentParser(description=__doc__)
    asked.add_argument("table", type=Path)
    asked.add_argument("robot", type=Path)
    asked.add_argument(
        "--strategies", nargs="+", type=strategy, default=["random", "farthest", "informative", "direct"]
    )
    asked.add_argument("--orders", type=int, default=10)
    asked.add_argument("--motions", type=int, default=5)
    asked.add_argument("--seconds", type=float, default=20.0)
    asked.add_argument("--evaluations", type=int, default=240)
    asked.add_argument("--seed", type=int, default=0)
    asked.add_argument("--sysid", type=int, default=0)
    asked.add_argument("--output", type=Path, default=Path("so101.zip"))
    given = asked.parse_args()
    result = kept(given.output, lambda folder: spec_for(given, folder))
    print(result.verdict)
    best = result.simulators.query("rank == 0").copy()
    stored = {each.name: each.spec for each in result.study.experiments}
    for name, rows in best.groupby("name"):
        best.loc[rows.index, "rad"] = errors(stored[str(name)], _parameters(rows))
    print(f"as its file has it: {errors(next(iter(stored.values())), None)[0]:.5f} rad")
    print(best.groupby(["name", "iteration"])["rad"].agg(["mean", "std", "count"]).to_string())
    if given.sysid:
        compared(result, given.robot, given.sysid, min(3, given.motions))


if __name__ == "__main__":
    main()
