"""The parts of the `gaplab` command; each module holds a group of commands, or what they share."""
