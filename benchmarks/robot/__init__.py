"""Evidence that the quadruped is worth tuning: the tables of docs/robot.md."""
