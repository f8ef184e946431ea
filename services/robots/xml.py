"""XML that keeps its comments and its head while single values change."""

import re
from collections.abc import Sequence
from xml.etree import ElementTree

Element = ElementTree.Element


HEAD = re.compile(r"(\s|<!--.*?-->|<\?.*?\?>|<!DOCTYPE[^>\[]*(\[.*?\]\s*)?>)*", re.DOTALL)
"""What may be before the root."""


def decoded(content: bytes) -> str:
    """Return a text in UTF-8, or else in Latin-1, which every file is in."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


class Document:
    """An XML text as a tree.

    Attributes:
        root: its root.
    """

    def __init__(self, text: str) -> None:
        found = HEAD.match(text)
        at = found.end() if found else 0
        self._head, body = text[:at], text[at:]
        self.root = tree(body)

    def text(self, comments: Sequence[str]) -> str:
        """Return the text, with comments at the start of the root."""
        for comment in reversed(comments):
            node = ElementTree.Comment(f" {comment.replace('--', '—')} ")
            node.tail = "\n  "
            self.root.insert(0, node)
        self.root.text = "\n  "
        return self._head + ElementTree.tostring(self.root, encoding="unicode") + "\n"


def tree(text: str) -> Element:
    """Return the root of an XML text, with comments."""
    text = re.sub(r"^\s*<\?xml[^>]*\?>", "", text)  # some files declare a version of XML that does not exist
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))  # noqa: S314 - the user's own
    return ElementTree.fromstring(text, parser)  # noqa: S314


def child(parent: Element, tag: str) -> Element:
    """Return the first child with a tag, which is made if there is none."""
    found = parent.find(tag)
    return ElementTree.SubElement(parent, tag) if found is None else found


def numbers(*values: float) -> str:
    """Return numbers as text, with all their digits."""
    return " ".join(repr(float(value)) for value in values)


def scaled(element: Element, name: str, factor: float) -> None:
    """Multiply an attribute."""
    element.set(name, repr(float(element.get(name, "0")) * factor))
