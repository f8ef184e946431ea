"""The parts of the Python client; programs import `gaplab.Client`."""
