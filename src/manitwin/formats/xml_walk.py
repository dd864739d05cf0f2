"""Event-based parsing of XML documents that are too large for a tree in memory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Protocol

from lxml import etree  # type: ignore[import-untyped]

from manitwin.formats.bounded_file import Refusal


class XmlWalker(Protocol):
    """Handler for the elements of a document, in order."""

    def start(self, tag: str, attributes: Mapping[str, str], namespaces: Mapping[str | None, str]) -> None:
        """Handle the start of an element: name and attributes, both without namespaces, and the prefixes that it declares."""

    def end(self, tag: str) -> None:
        """Handle the end of an element."""


def walk_xml(blocks: Iterable[bytes], walker: XmlWalker, name: str, *, refusal: Refusal) -> None:
    """Pass each element of a document that comes in ``blocks`` to a ``walker``.

    Raises ``refusal`` with a message starting with ``name``: broken XML, or a document type. Nothing else is opened.
    """
    parser = etree.XMLParser(
        target=_WalkerTarget(walker, name, refusal),
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
    )
    try:
        for block in blocks:
            parser.feed(block)
        parser.close()
    except etree.XMLSyntaxError as error:
        raise refusal(f"{name}: its XML is broken ({' '.join(str(error).split())[:120]}); export it again") from error


class _WalkerTarget:
    """Adapter from lxml's parser target to a walker."""

    def __init__(self, walker: XmlWalker, name: str, refusal: Refusal):
        self._walker, self._name, self._refusal = walker, name, refusal
        self._plain: dict[str, str] = {}  # names without namespace: there are millions of elements, but few names

    def start(self, tag: str, attributes: Mapping[str, str], namespaces: Mapping[str | None, str]) -> None:
        if any(key[0] == "{" for key in attributes):
            attributes = {self._without_namespace(key): value for key, value in attributes.items()}
        self._walker.start(self._without_namespace(tag), attributes, namespaces)

    def end(self, tag: str) -> None:
        self._walker.end(self._without_namespace(tag))

    def doctype(self, *_: object) -> None:
        raise self._refusal(f"{self._name}: its XML declares a document type, which is not read; remove it")

    def data(self, _: str) -> None:
        """Texts are ignored."""

    def close(self) -> None:
        """There is no result to return."""

    def _without_namespace(self, name: str) -> str:
        plain = self._plain.get(name)
        if plain is None:
            plain = self._plain[name] = name.rpartition("}")[2]
        return plain
