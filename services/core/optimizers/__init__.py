"""Optimizers: one file in this folder is one optimizer."""

from services.core.optimizers.base import Optimizer
from services.core.registry import Registry

optimizers: Registry[Optimizer] = Registry("optimizer", __name__, Optimizer)
