"""Notes: Markdown by people, rendered as HTML that is safe on a page.

HTML in notes is shown as text. Addresses lead to http, https and mailto alone, and images are links: a note makes no
reader's browser send a request.
"""

from collections.abc import MutableMapping
from functools import cache
from typing import Any
from urllib.parse import urlsplit

from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token
from markdown_it.utils import OptionsDict

from gaplab.schemas.editing import NotesRead
from gaplab.services.store.queries.experiments import whole
from gaplab.services.store.session import Session, snapshot

_SCHEMES = {"http", "https", "mailto"}


@snapshot
def read(session: Session, id_: str) -> NotesRead:
    """Return the notes of a study as HTML.

    Raises:
        NotFound: no such study.
        Conflict: the id is that of one of its experiments.
    """
    return NotesRead(html=render(whole(session, id_).study.notes or ""))


def render(notes: str) -> str:
    """Return Markdown as HTML."""
    html: str = _markdown().render(notes)
    return html


@cache
def _markdown() -> MarkdownIt:
    markdown = MarkdownIt("js-default", {"html": False, "linkify": False, "maxNesting": 20}).disable("image")
    markdown.validateLink = _is_harmless  # type: ignore[method-assign, assignment]  # the library's documented way
    markdown.add_render_rule("link_open", _opened_link)
    return markdown


def _is_harmless(address: str) -> bool:
    """Return whether a link may lead to the address: a page elsewhere, or a place of the page itself."""
    try:
        parts = urlsplit(address.strip())
    except ValueError:
        return False
    return parts.scheme.lower() in _SCHEMES if parts.scheme else address.startswith("#")


def _opened_link(
    renderer: RendererHTML,
    tokens: list[Token],
    index: int,
    options: OptionsDict,
    env: MutableMapping[str, Any],
) -> str:
    """Return the opening tag of a link, which leaks no address and cannot reach the page."""
    token = tokens[index]
    if not str(token.attrGet("href") or "").startswith("#"):
        token.attrSet("rel", "noopener noreferrer nofollow")
        token.attrSet("target", "_blank")
    return renderer.renderToken(tokens, index, options, env)
