"""How few motions tune a real arm: `python -m benchmarks.so101 TABLE ROBOT` of the SO-101 of SAGE.

The data are of isaac-sim2real/sage, the robot of TheRobotStudio/SO-ARM100 (both Apache-2.0). TABLE is CSV or Parquet,
with a line for each time, and the columns `motion, time_s, command_J, position_J` of the joints below, in rad. ROBOT is
the MJCF.
"""

from argparse import ArgumentParser
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gaplab
from gaplab.api.library.pools import PoolOptions, import_pool

JOINTS = {
    "shoulder_pan": "Rotation",
    "shoulder_lift": "Pitch",
    "elbow_flex": "Elbow",
    "wrist_flex": "Wrist_Pitch",
    "wrist_roll": "Wrist_Roll",
    "gripper": "Jaw",
}
EACH = {
    "kp({})": (0.001, 0.03),
    "joint_friction({})": (0.0, 0.6),
    "joint_damping({})": (0.0, 1.0),
    "bias({})": (-0.1, 0.1),
}
SHARED = {"armature": (0.0, 0.1), "delay": (0.0, 0.1)}


def tunables() -> list[dict[str, Any]]:
    """Return gain, friction, damping and bias of each joint, and one armature and delay."""
    every = {label.format(joint): bounds for joint in JOINTS for label, bounds in EACH.items()}
    return [{"name": name, "lower": low, "upper": high} for name, (low, high) in (every | SHARED).items()]


def main() -> None:
    """Import the motions, run the study, and print its verdict and curve."""
    asked = ArgumentParser(description=__doc__)
    asked.add_argument("table", type=Path)
    asked.add_argument("robot", type=Path)
    asked.add_argument("--engine", default="mujoco")
    asked.add_argument("--strategies", nargs="+", default=["random", "farthest", "informative", "direct"])
    asked.add_argument("--orders", type=int, default=10)
    asked.add_argument("--motions", type=int, default=5)
    asked.add_argument("--seconds", type=float, default=20.0)
    asked.add_argument("--evaluations", type=int, default=400)
    asked.add_argument("--output", type=Path, default=Path("so101.zip"))
    given = asked.parse_args()
    with TemporaryDirectory() as folder:
        pool = Path(folder) / "motions.json"
        options = PoolOptions(columns=JOINTS, recording="motion", every_s=0.1, seconds=given.seconds)
        pool.write_text(import_pool(given.table, str(given.robot), "motions", options).text, "utf-8")
        result = gaplab.run(
            {
                "name": "SO-101",
                "robot": str(given.robot),
                "engine": given.engine,
                "strategies": given.strategies,
                "repetitions": given.orders,
                "iterations": given.motions,
                "tunables": tunables(),
                "tuner": "gauss_newton",
                "budget": {"preset": "smoke", "simulator_evaluations": given.evaluations},
                "reality": {"kind": "recorded", "pool": str(pool)},
            }
        )
    result.save(given.output)
    print(result.verdict)
    print(result.curve.to_string())


if __name__ == "__main__":
    main()
