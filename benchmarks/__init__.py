"""Commands that print measurements: `python -m benchmarks` for speed, `python -m benchmarks.robot` for the robot."""
