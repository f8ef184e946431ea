"""What stored results show: curves, misfit, tuned simulators, costs."""
