"""Fake pose estimator, as a server and a program, for the contract of ``models/pose_estimators/protocol.py``.

Its poses are deliberately coarse: the model's centre is placed at the mean of the masked depth points, with the rotations of a
cube composed with an arbitrary rotation. The client has to check which poses explain the picture.

    python -m manitwin.models.fakes.pose_estimator REQUEST OUT
"""

from __future__ import annotations

import base64
import binascii
import json
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.server import Request, Response
from manitwin.models.fakes.vendor import with_outages
from manitwin.models.pose_estimators.protocol import MOST_POSES, PROTOCOL

NAME = "rehearsal"
FILES = ("mesh", "visual", "depth", "mask", "rgb")
CAMERA = ("fx", "fy", "cx", "cy", "width", "height")
REFUSALS: dict[str, tuple[int, Any]] = {
    "unauthorized": (401, {"error": "no valid key"}),
    "rate_limited": (429, {"error": "busy"}),
    "server_error": (500, {"error": "out of memory"}),
}


@dataclass
class FakePoseEstimator:
    """``POST /estimate`` on this machine."""

    faults: Faults = field(default_factory=Faults)

    def answer(self, request: Request, base_url: str) -> Response:
        """Answer a request."""
        return with_outages(self.faults, REFUSALS, lambda: _answer(request))


def _answer(request: Request) -> Response:
    if (request.method, request.path) != ("POST", "/estimate"):
        return Response(404, {"error": "POST /estimate"})
    try:
        body = request.json()
        content = {name: base64.b64decode(text, validate=True) for name, text in body["content"].items()}
        return Response(200, guesses(body, content))
    except (ValueError, KeyError, TypeError, AttributeError, binascii.Error) as error:
        return Response(400, {"error": f"no question of {PROTOCOL}: {error}"})


def guesses(document: dict[str, Any], content: dict[str, bytes]) -> dict[str, Any]:
    """Return the answer to a request; raises ValueError or KeyError for a request that violates the protocol."""
    if (
        document["protocol"] != PROTOCOL
        or set(document["files"]) != set(FILES)
        or set(document["camera"]) != set(CAMERA)
    ):
        raise ValueError("protocol, files or camera")
    named = {name: file for name, file in document["files"].items() if file is not None}
    if set(named.values()) != set(content):
        raise ValueError("files that are named and not there, or the other way")
    depth, mask = (_numbers(content[named[name]]) for name in ("depth", "mask"))
    camera = document["camera"]
    if depth.shape != mask.shape or depth.shape != (camera["height"], camera["width"]):
        raise ValueError("pictures of other sizes than the camera's")
    rows, columns = np.nonzero((mask > 0) & (depth > 0))
    if not len(rows):
        raise ValueError("a mask without depths")
    z = depth[rows, columns] * document["depth_unit_m"]
    seen = np.stack([(columns - camera["cx"]) / camera["fx"] * z, (rows - camera["cy"]) / camera["fy"] * z, z], 1).mean(
        0
    )
    mesh = trimesh.load_mesh(trimesh.util.wrap_as_stream(content[named["mesh"]]), file_type="ply")
    vertices = np.asarray(mesh.vertices)
    middle = (vertices.min(0) + vertices.max(0)) / 2
    seen += seen / np.linalg.norm(seen) * document["diameter_m"] / 4  # the visible points lie on the near side
    turn = Rotation.from_rotvec([0.2, 0.5, 0.3])
    poses = []
    for rotation in (turn * Rotation.create_group("O")).as_matrix():
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation, seen - rotation @ middle
        poses.append({"object_to_camera": pose.tolist()})
    return {"model": NAME, "poses": poses[: min(MOST_POSES, document["most_poses"])]}


def _numbers(png: bytes) -> np.ndarray:
    found = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
    if found is None or found.ndim != 2:
        raise ValueError("a picture that is no PNG of one channel")
    return np.asarray(found)


def main(request: Path, out: Path) -> None:
    """Answer the request in a folder."""
    document = json.loads((request / "request.json").read_text())
    content = {path.name: path.read_bytes() for path in request.iterdir() if path.name != "request.json"}
    out.write_text(json.dumps(guesses(document, content)))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
