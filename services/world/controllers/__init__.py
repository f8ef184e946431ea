"""Controllers: one file in this folder is one controller."""

from gaplab.services.core.registry import Registry
from gaplab.services.world.controllers.base import Controller

controllers: Registry[Controller] = Registry("controller", __name__, Controller)
