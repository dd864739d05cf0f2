"""Poses of an SDF model: of its links, frames and joints, resolved to the model's own frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from lxml import etree  # type: ignore[import-untyped]
from scipy.spatial.transform import Rotation

from manitwin.errors import AssetError
from manitwin.formats.xml_file import numbers
from manitwin.geometry.poses import transform

MODEL_FRAME = "__model__"


def pose_of(element: etree._Element, what: str) -> np.ndarray:
    """Return the ``<pose>`` of an element ``(4, 4)``, relative to whatever it says; identity where it has none.

    Roll, pitch and yaw turn about fixed axes x, y, z in that order, in radians unless ``degrees`` says otherwise;
    ``rotation_format`` may be ``quat_xyzw``. Source: the SDFormat specification, version 1.9, ``pose``.
    """
    pose = element.find("pose")
    if pose is None or not (pose.text or "").strip():
        return np.eye(4)
    if pose.get("rotation_format", "euler_rpy") == "quat_xyzw":
        values = numbers(pose.text, 7, f"{what} pose")
        length = float(np.linalg.norm(values[3:]))
        if length == 0:
            raise AssetError(f"{what} pose: a quaternion of length 0 is no rotation")
        return transform(Rotation.from_quat(values[3:] / length).as_matrix(), values[:3])
    values = numbers(pose.text, 6, f"{what} pose")
    degrees = pose.get("degrees", "false").strip().lower() in ("true", "1")
    return transform(Rotation.from_euler("xyz", values[3:], degrees=degrees).as_matrix(), values[:3])


class ModelFrames:
    """The named frames of one model: its links, its ``<frame>`` elements and its joints."""

    def __init__(self, file: Path, model: etree._Element):
        self._file = file
        self._base: dict[str, str] = {}
        self._pose: dict[str, np.ndarray] = {}
        self._attached: dict[str, str] = {}
        for element in (*model.findall("link"), *model.findall("frame"), *model.findall("joint")):
            name = element.get("name") or ""
            what = f"{file.name}: {element.tag} {name!r}"
            if not name or name in self._base:
                raise AssetError(f"{what}: without a name, or with that of another")
            default = element.get("attached_to") or MODEL_FRAME
            if element.tag == "joint":
                default = (element.findtext("child") or "").strip()
            if element.tag != "link":
                self._attached[name] = default
            pose = element.find("pose")
            said = None if pose is None else pose.get("relative_to")
            self._base[name] = said or default
            self._pose[name] = pose_of(element, what)

    def to_model(self, name: str) -> np.ndarray:
        """Return a frame's pose in the model's frame ``(4, 4)``; raises AssetError where its chain does not end there."""
        chain: list[np.ndarray] = []
        seen: set[str] = set()
        at = name
        while at != MODEL_FRAME:
            if at in seen or at not in self._base:
                why = "goes in a circle" if at in seen else f"leads to {at[:60]!r}, which is no frame of the model"
                raise AssetError(f"{self._file.name}: the pose of {name!r} {why}")
            seen.add(at)
            chain.append(self._pose[at])
            at = self._base[at]
        result = np.eye(4)
        for pose in chain:
            result = pose @ result
        return result

    def link_of(self, name: str) -> str:
        """Return the link that a frame is attached to, by name; a link is its own, and an unknown name stays."""
        seen: set[str] = set()
        while name in self._attached and name not in seen:
            seen.add(name)
            name = self._attached[name]
        return name
