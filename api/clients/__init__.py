"""Parts of the client, each about one subject."""
