"""Recognition of known file formats that are not supported as assets."""

from __future__ import annotations

import re
from pathlib import Path

from manitwin.errors import AssetError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.sniff import placeholder_description

_HEAD_BYTES = 1 << 16
_OPENRAVE = re.compile(rb"<(?:kinbody|environment)[\s>]", re.IGNORECASE)
_WORLD = re.compile(rb"<world[\s>]")


def unsupported_reason(file: Path) -> str | None:
    """Return what a file of a known but unsupported format is, and what to give instead; None for others. Raises AssetError."""
    if file.suffix.lower() not in (".world", ".xml", ".mjcf", ".sdf", ".urdf"):
        return None
    with open_regular(file, AssetError) as opened:
        head = opened.read(_HEAD_BYTES)
    if told := placeholder_description(head):
        return told
    if _WORLD.search(head):
        return "a world of Gazebo, whose things are the models that it includes; give their folder"
    if file.suffix.lower() == ".xml" and _OPENRAVE.search(head):
        return "a body of OpenRAVE, which is not read; give its URDF, or its mesh to `manitwin build`"
    return None
