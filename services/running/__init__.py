"""Repetitions and sensitivity checks, as supervisors run them."""
