"""Ray: a supervisor that claims repetitions, and the task that runs one. Start with `supervisor`."""
