"""Robots and their worlds, without an engine: what is simulated, how it moves and is sensed; and plug-ins of both."""
