"""Errors of the workers, in a module that does not import Ray."""

from gaplab.services.core.errors import GaplabError


class ClusterUnusable(GaplabError):
    """Ray is unreachable, or one of its nodes would compute other numbers or fail."""


class RayGone(ClusterUnusable):
    """The Ray of this process died or does not answer; calls to it may never return."""


class TaskLost(GaplabError):
    """The process that computed a repetition is gone, and another must continue it; the message says how it ended."""
