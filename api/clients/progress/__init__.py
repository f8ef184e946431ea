"""The progress of a study or an experiment: one model, shown in a terminal, a log or a notebook."""
