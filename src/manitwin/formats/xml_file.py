"""XML parsing and writing: untrusted XML is read without document types, entities, includes or network access.

Written XML is deterministic. All XML of the package is parsed here, except for documents too large for a tree (``xml_walk``).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from pathlib import Path
from xml.parsers import expat

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.errors import AssetError, ExportError
from manitwin.formats.bounded_file import Refusal, read_bytes
from manitwin.formats.markdown import one_line

MAX_XML_BYTES = 64 << 20
_HYPHENS_IN_COMMENT = "ERR_HYPHEN_IN_COMMENT"
_BARE_AMPERSAND = ("ERR_NAME_REQUIRED", "ERR_ENTITYREF_SEMICOL_MISSING")
_UNKNOWN_PREFIX = "NS_ERR_UNDEFINED_NAMESPACE"
_LESS_IN_VALUE = "ERR_LT_IN_ATTRIBUTE"
_AFTER_THE_ROOT = "ERR_DOCUMENT_END"
"""TinyXML uses the first root and ignores what follows it."""
_HEAD_BYTES, _DECLARATION_BYTES = 1 << 16, 1 << 10
MAX_NUMBER = 1e9  # larger than any length, mass or moment of an object for a gripper


def read_xml(
    path: Path,
    tag: str,
    *,
    name: str | None = None,
    refusal: Refusal = AssetError,
    comments: bool = True,
    inside: Path | None = None,
) -> etree._Element:
    """Return the root element of a file, which must be ``tag``; raises ``refusal`` for defects.

    ``name`` is what messages call the file (default: its own name). ``inside``: a folder that a link may not leave.
    """
    name = name or path.name
    data = read_bytes(path, MAX_XML_BYTES, refusal, inside=inside, name=name)
    return parse_xml(data, tag, name, refusal=refusal, comments=comments)


def parse_xml(
    data: bytes | str,
    tag: str,
    name: str,
    *,
    refusal: Refusal = AssetError,
    comments: bool = True,
    max_bytes: int | None = MAX_XML_BYTES,
) -> etree._Element:
    """Return the root element of a document, which must be ``tag`` in any namespace.

    Raises ``refusal`` with a message starting with ``name``: broken XML, another root, a document type, or more than
    ``max_bytes`` (None: the caller has limited the size, and long texts are allowed). Entities and XIncludes stay unexpanded,
    and nothing else is opened.
    """
    data = data.encode() if isinstance(data, str) else data
    if max_bytes is not None and len(data) > max_bytes:
        raise refusal(f"{name}: more than {max_bytes >> 20} MiB of XML; it is no single object")
    data = _declared_first(data)
    declares_type = _declares_document_type(data)
    if declares_type:
        raise refusal(f"{name}: its XML declares a document type, which is not read; remove it")
    # huge_tree also lifts libxml2's limit on expanding entities
    huge_tree = max_bytes is None and declares_type is False
    parser = _parser(comments, huge_tree)
    try:
        root = etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        kinds = {entry.type_name for entry in parser.error_log}
        if _HYPHENS_IN_COMMENT in kinds and (mended := _with_sound_comments(data)) != data:
            return parse_xml(mended, tag, name, refusal=refusal, comments=comments, max_bytes=max_bytes)
        if _LESS_IN_VALUE in kinds and (mended := _with_sound_values(data)) != data:
            return parse_xml(mended, tag, name, refusal=refusal, comments=comments, max_bytes=max_bytes)
        if (mended := _without_declarations(data)) != data:
            return parse_xml(mended, tag, name, refusal=refusal, comments=comments, max_bytes=max_bytes)
        if kinds.intersection(_BARE_AMPERSAND) and (mended := _with_sound_ampersands(data)) != data:
            return parse_xml(mended, tag, name, refusal=refusal, comments=comments, max_bytes=max_bytes)
        if not kinds <= {_UNKNOWN_PREFIX, _AFTER_THE_ROOT}:
            raise refusal(f"{name}: its XML is broken ({' '.join(str(error).split())[:120]}); mend it") from error
        root = _without_unknown_prefixes(etree.fromstring(data, _parser(comments, huge_tree, recover=True)))
    if root.getroottree().docinfo.doctype:
        raise refusal(f"{name}: its XML declares a document type, which is not read; remove it")
    if root.tag.rpartition("}")[2] != tag:
        raise refusal(f"{name}: its XML is <{str(root.tag)[:40]}>, not <{tag}>; give a file of that kind")
    return root


def _parser(comments: bool, huge_tree: bool, recover: bool = False) -> etree.XMLParser:
    return etree.XMLParser(
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        remove_comments=not comments,
        huge_tree=huge_tree,
        recover=recover,
    )


def _with_sound_comments(data: bytes) -> bytes:
    """Separate double hyphens within comments, which TinyXML, and with it Gazebo, PyBullet and MuJoCo, accept."""

    def apart(comment: re.Match[bytes]) -> bytes:
        inside = re.sub(rb"-(?=-)", b"- ", comment.group(1))
        return b"<!--" + inside + (b" -->" if inside.endswith(b"-") else b"-->")

    return re.sub(rb"<!--(.*?)-->", apart, data, flags=re.DOTALL)


def _with_sound_values(data: bytes) -> bytes:
    """Escape ``<`` in attribute values, which TinyXML and with it Gazebo accept."""
    return re.sub(rb'="[^"\n]*"', lambda value: value.group().replace(b"<", b"&lt;"), data)


def _without_declarations(data: bytes) -> bytes:
    """Remove invalid markup that begins with ``<!``, which TinyXML skips."""
    return re.sub(rb"<!(?!--|\[CDATA\[|DOCTYPE)[^<>]*>", b"", data)


def _with_sound_ampersands(data: bytes) -> bytes:
    """Escape ampersands that begin no reference, which TinyXML and with it Gazebo accept."""
    return re.sub(rb"&(?!#?\w+;)", b"&amp;", data)


def _without_unknown_prefixes(root: etree._Element) -> etree._Element:
    """Remove elements and attributes with an undeclared prefix: private additions of tools, which other loaders skip."""
    for element in list(root.iter(etree.Element)):
        if ":" in element.tag.rpartition("}")[2] and element is not root:
            element.getparent().remove(element)
        for key in [key for key in element.attrib if ":" in key.rpartition("}")[2]]:
            del element.attrib[key]
    return root


def _declared_first(data: bytes) -> bytes:
    """Move the XML declaration to the start of a document and set it to version 1.0.

    Blank lines and comments above it, and versions such as 0.0, are common in robot descriptions and accepted by PyBullet,
    MuJoCo and Gazebo.
    """
    start = data.find(b"<?xml", 0, _HEAD_BYTES)
    end = data.find(b"?>", start, start + _DECLARATION_BYTES)
    if start < 0 or end < 0:
        return data
    above, declaration, below = data[:start], data[start:end], data[end + 2 :]
    if declaration.startswith((b'<?xml version="1.0"', b"<?xml version='1.0'")) and above in (b"", b"\xef\xbb\xbf"):
        return data
    blank = above.removeprefix(b"\xef\xbb\xbf")
    while (comment := blank.find(b"<!--")) >= 0:
        closed = blank.find(b"-->", comment)
        blank = blank[:comment] + (blank[closed + 3 :] if closed >= 0 else b"<")
    if blank.strip():
        return data
    encoding = re.search(rb"""encoding\s*=\s*["']([A-Za-z][\w.-]{0,40})""", declaration)
    said = encoding.group(1) if encoding else b"utf-8"
    return b'<?xml version="1.0" encoding="' + said + b'"?>' + above.removeprefix(b"\xef\xbb\xbf") + below


class _RootFound(Exception):
    """Ends the parsing by expat."""


def _declares_document_type(data: bytes) -> bool | None:
    """Return whether there is a document type above the root element, before entities are expanded; None if undetermined."""
    parser = expat.ParserCreate()
    found: list[bool] = []

    def end(declared: bool) -> None:
        found.append(declared)
        raise _RootFound

    parser.StartDoctypeDeclHandler = lambda *_: end(True)
    parser.StartElementHandler = lambda *_: end(False)
    try:
        parser.Parse(data, True)
    except _RootFound:
        return found[0]
    except (expat.ExpatError, ValueError, LookupError):  # broken, or an encoding unknown to expat: lxml reports it
        return None
    return None


def number(text: str | None, what: str) -> float:
    """Return a finite number; raises AssetError naming ``what`` it is if missing or invalid."""
    try:
        value = float(text or "")
    except ValueError as error:
        raise AssetError(f"{what}: {(text or '')[:40]!r} is no number") from error
    if not math.isfinite(value) or abs(value) > MAX_NUMBER:
        raise AssetError(f"{what}: {value} is no number that an object can have")
    return value


def numbers(text: str | None, count: int, what: str) -> np.ndarray:
    """Return exactly ``count`` numbers ``(count,)``; raises AssetError naming ``what`` they are."""
    words = (text or "").split()
    if len(words) != count:
        raise AssetError(f"{what}: {(text or '')[:40]!r} are not {count} numbers")
    return np.array([number(word, what) for word in words])


def text_of(element: etree._Element, path: str) -> str | None:
    """Return the text of a descendant as one line without enclosing quotes, or None if it is empty."""
    text = " ".join((element.findtext(path) or "").split()).strip("\"'")
    return text or None


def comments_before(root: etree._Element) -> tuple[str, ...]:
    """Return the comments above and directly below the root element, in order, with normalized white space in each line."""
    above = [n.text for n in reversed(list(root.itersiblings(preceding=True))) if n.tag is etree.Comment]
    below = [n.text for n in root.iterchildren(etree.Comment)]
    return tuple(
        "\n".join(" ".join(line.split()) for line in (text or "").strip().splitlines()) for text in [*above, *below]
    )


def new_element(tag: str, **attributes: str) -> etree._Element:
    """Return an element without parent; attributes keep their order."""
    return etree.Element(tag, attributes)


def add(parent: etree._Element, tag: str, text: str | None = None, **attributes: str) -> etree._Element:
    """Append an element and return it; attributes keep their order."""
    element = etree.SubElement(parent, tag, attributes)
    element.text = text
    return element


def number_text(*values: float) -> str:
    """Format numbers as the shortest text that restores them exactly. Raises ExportError for one that is not finite."""
    for value in values:
        if not math.isfinite(value):
            raise ExportError(f"{value} is no number that a simulator can use; build the twin again")
    return " ".join(repr(float(value) + 0.0) for value in values)  # + 0.0 avoids negative zeros


def document(root: etree._Element, comments: Iterable[str]) -> bytes:
    """Return the indented document with ``comments`` at the top of its root element."""
    for position, text in enumerate(comments):
        root.insert(position, etree.Comment(f" {_without_double_hyphen(one_line(text))} "))
    etree.indent(root)
    data: bytes = etree.tostring(root, xml_declaration=True, encoding="utf-8", pretty_print=True)
    return data


def edited_document(root: etree._Element) -> bytes:
    """Return a document that was parsed and edited, including the content around its root element."""
    data: bytes = etree.tostring(root.getroottree(), xml_declaration=True, encoding="utf-8")
    return data


def xml_text(element: etree._Element) -> str:
    """Return an element as text without declaration."""
    text: str = etree.tostring(element, encoding="unicode")
    return text


def _without_double_hyphen(text: str) -> str:
    """Return text for a comment, which may neither contain a double hyphen nor end with a hyphen (XML 1.0, section 2.5)."""
    while "--" in text:
        text = text.replace("--", "- -")
    return text.rstrip("-")
