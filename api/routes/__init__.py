"""The endpoints, a module for each noun. Each is a translation: HTTP in, one call of `services`, HTTP out."""
