"""Specs: from a submitted spec to the simulation that runs."""
