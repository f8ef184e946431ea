"""External plug-ins, and the catalogue of all plug-ins."""
