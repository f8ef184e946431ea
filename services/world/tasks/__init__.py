"""Tasks: one file in this folder is one task."""

from gaplab.services.core.registry import Registry
from gaplab.services.world.tasks.base import Task

tasks: Registry[Task] = Registry("task", __name__, Task)
