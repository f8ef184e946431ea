"""The processes of the service: the API, its supervisor, and a service on this machine for one program."""
