"""Appearance vectors of twins rendered from all sides in their placements, computed once and stored."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from manitwin.dataset.search.vector_store import StoredVectors, VectorStore
from manitwin.errors import UsageError
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.models.embedders.appearance import GREY, LENGTH, VERSION, appearance_descriptor
from manitwin.render.cameras import Camera, framing_camera
from manitwin.render.renderer import shared_renderer
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.record import Placement
from manitwin.twin.resting import resting_poses
from manitwin.twin.store import sha256_of_json

PLACEMENTS, AROUND = 3, 12
ELEVATIONS_DEG = (15.0, 35.0, 60.0)
"""Camera elevations: seated at a table, standing, and from above."""
PICTURE_PX, FOV_Y_DEG = 160, 30.0
SPACE = f"pictures-{VERSION}"


def load_appearance_vectors(
    root: DatasetRoot,
    revisions: dict[str, str],
    on_twin: Callable[[str], None] = lambda twin_id: None,
) -> Iterator[tuple[str, np.ndarray]]:
    """Yield id and appearance vectors ``(V, 1536) float32`` of each twin of ``revisions`` (id to revision in the index).

    Stored vectors stay valid while the twin's surface and placements are unchanged; others are computed. ``on_twin`` is called
    for each twin that is rendered, which takes a second of CPU time. Raises UsageError for a data set at a URL.
    """
    if root.local is None:
        raise UsageError(
            f"{root.url}: is at a URL; copy the data set to this machine, since its twins are rendered for the"
            f" comparison"
        )
    store = VectorStore(root, SPACE, LENGTH)
    for twin_id, revision in revisions.items():
        kept = store.read(twin_id)
        if kept is None or kept.revision != revision:
            twin = Twin(root.local / root.twin_name(twin_id))
            content = content_digest(twin)
            if kept is not None and kept.content == content:
                looks = kept.vectors
            else:
                on_twin(twin_id)
                looks = compute_appearance_vectors(twin)
            kept = store.write(twin_id, StoredVectors(twin.record.revision, content, looks))
        yield twin_id, kept.vectors


def content_digest(twin: Twin) -> str:
    """Return the digest of the data that determines a twin's appearance vectors: its surface and its placements."""
    resting = [list(placement.quaternion_wxyz) for placement in _placements(twin)]
    return sha256_of_json([SPACE, twin.record.files["visual.glb"], resting])


def compute_appearance_vectors(twin: Twin) -> np.ndarray:
    """Return the appearance vectors ``(V, 1536)`` of a twin from 12 sides in each of its three most likely settled placements."""
    points = np.concatenate([part.vertices for part in twin.visual])
    cameras = [
        camera
        for number, placement in enumerate(_placements(twin))
        for camera in _orbit_cameras(points, rotation_from_quaternion_wxyz(np.array(placement.quaternion_wxyz)), number)
    ]
    frames = shared_renderer().render(twin.visual, cameras, background=(GREY, GREY, GREY))
    return np.array([appearance_descriptor(frame.rgb, frame.coverage) for frame in frames])


def _placements(twin: Twin) -> list[Placement]:
    return [pose.placement for pose in resting_poses(twin.record.placements or [])[:PLACEMENTS]]


def _orbit_cameras(points_m: np.ndarray, object_to_plane: np.ndarray, number: int) -> Iterator[Camera]:
    """Yield cameras around an object at rest, in the object frame. The azimuths of other placements are offset between these."""
    resting, back = points_m @ object_to_plane.T, np.eye(4)
    back[:3, :3] = object_to_plane.T
    for place in range(AROUND):
        camera = framing_camera(
            resting,
            azimuth_deg=360 / AROUND * (place + number / PLACEMENTS),
            elevation_deg=ELEVATIONS_DEG[place % len(ELEVATIONS_DEG)],
            fov_y_deg=FOV_Y_DEG,
            width_px=PICTURE_PX,
            height_px=PICTURE_PX,
        )
        yield Camera(back @ camera.camera_to_object, camera.fov_y_rad, PICTURE_PX, PICTURE_PX)
