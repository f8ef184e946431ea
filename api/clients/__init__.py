"""The parts of the client; one file in this folder is a group of what it can do."""
