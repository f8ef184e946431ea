"""Controllers: one file in this folder is one controller."""

from gaplab.services.core.controllers.base import Controller
from gaplab.services.core.registry import Registry

controllers: Registry[Controller] = Registry("controller", __name__, Controller)
