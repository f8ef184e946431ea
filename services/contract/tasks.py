"""The contract of a task."""

from gaplab.services.contract import promises
from gaplab.services.core.tasks.base import Task

Plugin = type[Task]


def is_described(plugin: Plugin) -> None:
    """Has a unit, and a docstring of its own whose first line is a sentence."""
    promises.is_described(plugin)
    assert getattr(plugin, "unit", ""), "it has no unit"


def observes_at_times_that_ascend(plugin: Plugin) -> None:
    """Observes at times that ascend, in arrays of float64, the last of them above 0; its sensors are read within."""
    task = plugin()
    promises.check_times(task.observe_s, task.sensors)


def rates_many_trajectories_as_each(plugin: Plugin) -> None:
    """Returns for many trajectories at once the fitness of each."""
    task = plugin()
    promises.check_rates_many(task, task.observe_s)


def has_no_fitness_of_failed_physics(plugin: Plugin) -> None:
    """Returns nan for a trajectory of nan."""
    task = plugin()
    promises.check_failed_physics(task, task.observe_s)


def reads_its_sensors(plugin: Plugin) -> None:
    """Reads each sensor at each of its times, and many trajectories as each."""
    task = plugin()
    if task.sensors.size:
        assert plugin.sense is not Task.sense, "it has sensors, but no `sense` that reads them"
        promises.check_sensors(task)


CHECKS = (
    is_described,
    observes_at_times_that_ascend,
    rates_many_trajectories_as_each,
    has_no_fitness_of_failed_physics,
    reads_its_sensors,
)
