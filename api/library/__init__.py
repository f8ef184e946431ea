"""gaplab in one process: the same use cases, without a server and without Ray."""
