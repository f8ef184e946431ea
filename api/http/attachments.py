"""Texts that a browser saves as files."""

from urllib.parse import quote

from fastapi import Response


def attachment(text: str, media_type: str, name: str) -> Response:
    """Return a text as a file of this name."""
    return Response(text, media_type=media_type, headers={"Content-Disposition": f'attachment; filename="{name}"'})


def saved_as(name: str) -> str:
    """Return the Content-Disposition of a file that a browser saves under this name, in any script.

    Source: RFC 6266, section 4.3, and RFC 8187: `filename` is ASCII, for what does not know `filename*`.
    """
    clean = "".join(sign if sign.isprintable() and sign not in "/\\" else "_" for sign in name)
    plain = "".join(sign if sign.isascii() and (sign.isalnum() or sign in "._-") else "_" for sign in clean)
    return f"attachment; filename=\"{plain}\"; filename*=UTF-8''{quote(clean, safe='')}"
