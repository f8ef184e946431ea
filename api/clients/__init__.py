"""What the Python client is put together from; `gaplab.api.clients.client` is what programs import."""
