"""Commands that print measurements: `python -m benchmarks` for speed, the others for the figures of documents."""

import gaplab  # noqa: F401 - before NumPy, which it tells what code to run
