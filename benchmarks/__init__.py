"""Commands that print figures: `python -m benchmarks` for speed, `python -m benchmarks.robot` for the robot."""
