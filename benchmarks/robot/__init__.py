"""Evidence that the quadruped is worth tuning: the figures of docs/robot.md."""
