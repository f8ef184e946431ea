"""Engines: each module or package in this folder is one engine."""

from gaplab.services.core.registry import Registry
from gaplab.services.engines.base import Engine

engines: Registry[Engine] = Registry("engine", __name__, Engine)
