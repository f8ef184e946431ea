"""What HTTP needs beside the endpoints."""
