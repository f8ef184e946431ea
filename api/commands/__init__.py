"""The parts of the `gaplab` command; one file in this folder is a group of them."""
