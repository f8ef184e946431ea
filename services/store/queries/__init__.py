"""Loads and saves by subject, in a given session; they decide nothing and commit nothing.

`steps` appends to the logs of repetitions, `logs` reads them, `checkpoints` keeps parts of the next step, and `events`
records events. `experiments` finds and locks studies and experiments.
"""
