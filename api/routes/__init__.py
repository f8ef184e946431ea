"""The endpoints, one module for each noun. Each translates: HTTP in, one call of a service, HTTP out."""
