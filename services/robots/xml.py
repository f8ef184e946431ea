"""XML that keeps its comments, its namespaces and its ends of lines while single values change."""

import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Sequence
from typing import Any, TypeAlias

from lxml import etree

Element: TypeAlias = Any  # lxml has no types

_HEAD = re.compile(r"(\s|<!--.*?-->|<\?.*?\?>|<!DOCTYPE[^>\[]*(\[.*?\]\s*)?>)*", re.DOTALL)
"""What may be before the root."""

_DASHES = re.compile(r"(?<=<!--)(.*?)-*(?=-->)", re.DOTALL)
"""The inside of a comment, in which ROS reads two dashes."""

_ENCODING = re.compile(r"""\A(\s*<\?xml[^>]*?\bencoding\s*=\s*["'])(?!utf-8["'])[^"']*""", re.IGNORECASE)
"""A declaration of another encoding than UTF-8."""


def decoded(content: bytes) -> str:
    """Return a text in UTF-8, in UTF-16 with its mark, or else in Latin-1, which every file is in."""
    if content.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


class Document:
    """An XML text as a tree, from its `root`."""

    def __init__(self, text: str) -> None:
        self._line_end = "\r\n" if "\r\n" in text else "\n"
        text = text.replace("\r\n", "\n")
        found = _HEAD.match(text)
        at = found.end() if found else 0
        self._head, self.root = _ENCODING.sub(r"\1UTF-8", text[:at], count=1), tree(text[at:])

    def text(self, comments: Sequence[str]) -> str:
        """Return the text, to be written in UTF-8, with comments at the start of the root."""
        before = self.root.text or "\n  "
        for comment in reversed(comments):
            node = etree.Comment(f" {comment.replace('--', '—')} ")
            node.tail = before
            self.root.insert(0, node)
        self.root.text = before
        parts = [self.root, *self.root.itersiblings()]
        lines = [etree.tostring(each, encoding="unicode", with_tail=False) for each in parts]
        return (self._head + "\n".join(lines) + "\n").replace("\n", self._line_end)


def tree(text: str) -> Element:
    """Return the root of an XML text, with comments; no file is read, and nothing is fetched.

    A prefix need not be declared: ROS does not ask for it.

    Raises:
        SyntaxError: it is not XML; the message has the line.
    """
    text = re.sub(r"^\s*<\?xml[^>]*\?>", "", text)  # some files declare a version of XML that does not exist
    text = _DASHES.sub(lambda found: re.sub("-(?=-)", "- ", found[1]), text)
    parser = etree.XMLParser(resolve_entities=False, no_network=True)
    try:
        return etree.fromstring(text.encode(), parser)
    except etree.XMLSyntaxError:
        if any(each.type != etree.ErrorTypes.NS_ERR_UNDEFINED_NAMESPACE for each in parser.error_log):
            raise
        return etree.fromstring(text.encode(), etree.XMLParser(resolve_entities=False, no_network=True, recover=True))


def child(parent: Element, tag: str) -> Element:
    """Return the first child with a tag, which is made if there is none."""
    found = parent.find(tag)
    return etree.SubElement(parent, tag) if found is None else found


def numbers(*values: float) -> str:
    """Return numbers as text, with all their digits."""
    return " ".join(repr(float(value)) for value in values)


def scaled(element: Element, name: str, factor: float) -> None:
    """Multiply an attribute."""
    element.set(name, repr(float(element.get(name, "0")) * factor))
