"""XML that others wrote: no document type, no entities, no network; every number finite."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from lxml import etree  # type: ignore[import-untyped]
from scipy.spatial.transform import Rotation

from manitwin.errors import AssetError
from manitwin.geometry.poses import transform

MAX_XML_BYTES = 64 << 20
MAX_NUMBER = 1e9  # no length, mass or moment of an object that a gripper meets comes near


def parse_xml(path: Path, tag: str) -> etree._Element:
    """Parse a file whose root element must be ``tag``; raises AssetError naming the file and what is wrong with it."""
    try:
        if path.stat().st_size > MAX_XML_BYTES:
            raise AssetError(f"{path.name}: more than {MAX_XML_BYTES >> 20} MiB of XML; it is no single object")
        parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, remove_comments=False)
        root = etree.fromstring(path.read_bytes(), parser)
    except OSError as error:
        raise AssetError(f"{path.name}: {error.strerror or error}; check the path") from error
    except etree.XMLSyntaxError as error:
        raise AssetError(f"{path.name}: its XML is broken ({' '.join(str(error).split())[:120]}); mend it") from error
    if root.getroottree().docinfo.doctype:
        raise AssetError(f"{path.name}: its XML declares a document type, which is not read; remove it")
    if root.tag != tag:
        raise AssetError(f"{path.name}: its XML is <{str(root.tag)[:40]}>, not <{tag}>")
    return root


def number(text: str | None, what: str) -> float:
    """Return a number that must be there and finite; raises AssetError saying ``what`` it is of."""
    try:
        value = float(text or "")
    except ValueError as error:
        raise AssetError(f"{what}: {(text or '')[:40]!r} is no number") from error
    if not math.isfinite(value) or abs(value) > MAX_NUMBER:
        raise AssetError(f"{what}: {value} is no number that an object can have")
    return value


def numbers(text: str | None, count: int, what: str) -> np.ndarray:
    """Return exactly ``count`` numbers ``(count,)``; raises AssetError saying ``what`` they are of."""
    words = (text or "").split()
    if len(words) != count:
        raise AssetError(f"{what}: {(text or '')[:40]!r} are not {count} numbers")
    return np.array([number(word, what) for word in words])


def origin_of(element: etree._Element, what: str) -> np.ndarray:
    """Return the ``<origin xyz rpy>`` of a URDF element as ``(4, 4)``; identity where it has none (URDF specification).

    Roll, pitch and yaw turn about fixed axes x, y, z in that order.
    """
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    rotation = Rotation.from_euler("xyz", numbers(origin.get("rpy", "0 0 0"), 3, f"{what} rpy")).as_matrix()
    return transform(rotation, numbers(origin.get("xyz", "0 0 0"), 3, f"{what} xyz"))


def text_of(element: etree._Element, path: str) -> str | None:
    """Return the text of a descendant in one line without quotes around it, or None where it is empty."""
    text = " ".join((element.findtext(path) or "").split()).strip("\"'")
    return text or None


def comments_before(root: etree._Element) -> tuple[str, ...]:
    """Return the comments above and directly below the root element, in order, each in one line."""
    above = [n.text for n in reversed(list(root.itersiblings(preceding=True))) if n.tag is etree.Comment]
    below = [n.text for n in root.iterchildren(etree.Comment)]
    return tuple(" ".join((text or "").split()) for text in [*above, *below])
