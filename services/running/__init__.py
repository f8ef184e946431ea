"""Repetitions and sensitivity checks: the work of supervisors."""
