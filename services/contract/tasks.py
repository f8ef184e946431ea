"""The contract of a task."""

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.motions import Trajectory
from gaplab.services.core.tasks.base import Task

Plugin = type[Task]


def is_described(plugin: Plugin) -> None:
    """Has a unit, and a docstring whose first line is a sentence."""
    described = plugin.describe()
    assert described.summary.endswith("."), f"its summary is {described.summary!r}; end it with a full stop"
    assert plugin.unit, "it has no unit"


def observes_at_times_that_ascend(plugin: Plugin) -> None:
    """Observes at times that ascend, the last of them above 0; its sensors are read within them."""
    task = plugin()
    times, read = np.asarray(task.observe_s), np.asarray(task.sensors.times_s)
    assert times.ndim == 1, f"observe_s has the shape {times.shape}"
    assert len(times), "observe_s is empty"
    assert times[0] >= 0, f"observe_s begins at {times[0]}"
    assert times[-1] > 0, f"observe_s ends at {times[-1]}"
    assert np.all(np.diff(times) > 0), f"observe_s does not ascend: {times.tolist()}"
    within = not len(read) or bool(read[0] >= 0 and read[-1] <= times[-1] + 1e-9)
    assert within, f"its sensors are read at {read.tolist()}, and a rollout ends at {times[-1]}"


def rates_many_trajectories_as_each(plugin: Plugin) -> None:
    """Returns for many trajectories at once the fitness of each."""
    task = plugin()
    many = _some(task.observe_s)
    together = np.asarray(task.fitness(many))
    one_by_one = [[float(task.fitness(_one(many, row, column))) for column in range(5)] for row in range(4)]
    assert together.shape == (4, 5), f"its fitness of (4, 5) trajectories has the shape {together.shape}"
    assert np.allclose(together, one_by_one), "its fitness of many trajectories differs from that of each"


def has_no_fitness_of_failed_physics(plugin: Plugin) -> None:
    """Returns nan for a trajectory of nan."""
    task = plugin()
    count = len(task.observe_s)
    fitness = float(task.fitness(Trajectory(task.observe_s, np.full((count, 3), np.nan), np.full((count, 4), np.nan))))
    assert np.isnan(fitness), f"its fitness of a trajectory of nan is {fitness}"


def reads_its_sensors(plugin: Plugin) -> None:
    """Reads each sensor at each of its times, and many trajectories as each."""
    task = plugin()
    sensors = task.sensors
    if not sensors.size:
        return
    assert len(sensors.units) == len(sensors.noises) == len(sensors.names), "its sensors lack units or noises"
    assert np.all(sensors.noises > 0), f"noises must be above 0, and are {sensors.noises.tolist()}"
    many = _some(sensors.times_s)
    values = np.asarray(task.sense(many))
    expected = (4, 5, len(sensors.times_s), len(sensors.names))
    assert values.shape == expected, f"its readings have the shape {values.shape}, not {expected}"
    assert np.allclose(values[2, 3], task.sense(_one(many, 2, 3))), "its readings of many differ from those of each"


def _some(times_s: FloatArray) -> Trajectory:
    """Return `(4, 5)` trajectories."""
    rng = np.random.default_rng(0)
    turns = rng.normal(size=(4, 5, len(times_s), 4))
    return Trajectory(
        times_s, rng.normal(size=(4, 5, len(times_s), 3)), turns / np.linalg.norm(turns, axis=-1, keepdims=True)
    )


def _one(many: Trajectory, row: int, column: int) -> Trajectory:
    return Trajectory(many.times_s, many.positions_m[row, column], many.orientations[row, column])


CHECKS = (
    is_described,
    observes_at_times_that_ascend,
    rates_many_trajectories_as_each,
    has_no_fitness_of_failed_physics,
    reads_its_sensors,
)
