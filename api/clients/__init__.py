"""Parts of the Python client, each about one thing; `api.client` puts them together."""
