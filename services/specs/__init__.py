"""From a submitted spec to what runs."""
