"""Discrepancies: one file in this folder is one discrepancy."""

from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.registry import Registry

discrepancies: Registry[Discrepancy] = Registry("discrepancy", __name__, Discrepancy)
