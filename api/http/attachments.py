"""Texts that a browser saves as files."""

from fastapi import Response


def attachment(text: str, media_type: str, name: str) -> Response:
    """Return a text as a file of this name."""
    return Response(text, media_type=media_type, headers={"Content-Disposition": f'attachment; filename="{name}"'})
