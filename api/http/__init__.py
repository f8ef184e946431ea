"""What HTTP needs besides the endpoints."""
