"""Results, computed from stored rows: curves and their costs, misfit, tuned simulators, the toy function, totals."""
