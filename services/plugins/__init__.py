"""Plug-ins of one's own, and the catalogue of all plug-ins."""
