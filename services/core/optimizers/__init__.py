"""Optimizers: one file in this folder is one optimizer."""

from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.registry import Registry

optimizers: Registry[Optimizer] = Registry("optimizer", __name__, Optimizer)
