"""Engines: one module in this folder is one engine."""

from services.core.registry import Registry
from services.engines.base import Engine

engines: Registry[Engine] = Registry("engine", __name__, Engine)
