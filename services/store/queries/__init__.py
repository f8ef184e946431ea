"""Loads and saves by subject, in the session that they are given; they decide nothing and commit nothing.

`steps` appends to the logs of repetitions, `logs` reads them, `checkpoints` keeps parts of the next step, and `events`
notes what happens. `experiments` finds and locks what the others are about.
"""
