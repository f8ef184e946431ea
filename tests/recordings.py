"""Pools that an engine makes of motions, in place of a real robot."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gaplab.api.library.robots import read_robot
from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.arrays import frozen
from gaplab.services.specs.assembly import edits_of, engine_of
from gaplab.services.specs.simulation import Simulation
from gaplab.services.world import robot_library
from gaplab.services.world.pools import Channel, Pool, Recorded
from tests.drawn_arm import imported

TIMES_S = tuple((np.arange(1, 11) * 0.1).round(6).tolist())
PLACE = tuple(Channel(name=axis, unit="m", noise=0.0005) for axis in "xyz")
TRUTH = {"mass(tool)": 1.2, "joint_damping": 0.4}


def swings(count: int, joints: int = 2, seed: int = 0) -> list[Recorded]:
    """Recordings without readings: of each, two targets of each joint, and fewer times than the one before."""
    rng = np.random.default_rng(seed)
    return [
        Recorded(
            name=f"swing {number}",
            times_s=(0.0, 0.4),
            commands=tuple(map(tuple, rng.uniform(-0.8, 0.8, (2, joints)).round(6).tolist())),
            readings=((None,) * 3,) * (len(TIMES_S) - number % 3),
        )
        for number in range(count)
    ]


def simulated(
    robot: str | Path,
    recordings: Sequence[Recorded],
    truth: Mapping[str, float],
    *,
    engine: str = "mujoco",
    **parts: Any,
) -> Pool:
    """Return the pool of what sensors say of recordings in a simulator, with their noise."""
    fields: dict[str, Any] = {
        "name": "swings",
        "sensors": PLACE,
        "times_s": TIMES_S,
        "actuators": ("shoulder", "elbow"),
    } | parts
    pool = Pool(recordings=tuple(recordings), **fields)
    robot_library.learn([pool.text])
    own = PluginRef(name="recorded", options={"sha256": pool.sha256, "name": pool.name})
    driven = read_robot(str(robot), controller=own, task=own)
    simulation = Simulation(driven, engine_of(PluginRef(name=engine)), edits_of(truth))
    genomes = frozen([[number] for number in range(len(recordings))])
    outcomes = simulation.sense(genomes, frozen([list(truth.values())]))[:, 0, 1:]
    noisy = outcomes + np.random.default_rng(1).normal(size=outcomes.shape)
    values = driven.sensors.values(noisy).round(6).tolist()
    found = [
        each.model_copy(update={"readings": tuple(map(tuple, rows[: len(each.readings)]))})
        for each, rows in zip(recordings, values, strict=True)
    ]
    return pool.model_copy(update={"recordings": tuple(found)})


def written(folder: Path, pool: Pool) -> Path:
    """Return the file of a pool."""
    file = folder / f"{pool.name}.pool.json"
    file.write_text(pool.text, encoding="utf-8")
    return file


def arm_and_pool(folder: Path, count: int = 8) -> tuple[Path, Path]:
    """Return the files of the arm, and of what it did with a heavier tool and more damping."""
    arm = imported(folder)
    return arm, written(folder, simulated(arm, swings(count), TRUTH))
