"""What the Python client is put together from; `api.client` is what programs import."""
