"""Ray: a supervisor that claims repetitions, and the task that runs a repetition. Start with `supervisor`."""
