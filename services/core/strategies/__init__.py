"""Strategies: each file in this folder is one strategy."""

from gaplab.services.core.registry import Registry
from gaplab.services.core.strategies.base import Strategy

strategies: Registry[Strategy] = Registry("strategy", __name__, Strategy)
