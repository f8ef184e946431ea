"""Tuners: one file in this folder is one tuner."""

from gaplab.services.core.registry import Registry
from gaplab.services.core.tuners.base import Tuner

tuners: Registry[Tuner] = Registry("tuner", __name__, Tuner)
