"""Commands that print measurements: `python -m benchmarks` for speed, `python -m benchmarks.robot` for the robot."""

import gaplab  # noqa: F401 - before NumPy, which it tells what code to run
