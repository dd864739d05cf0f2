"""The built-in generator ``lift``: one matted photo to a closed textured mesh, without weights."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from manitwin.config import Resource
from manitwin.errors import Unavailable, Unsupported
from manitwin.formats.glb import write_glb
from manitwin.geometry.poses import GLTF_TO_OBJECT
from manitwin.models.generators.lift.lifting import Lifted, hint_from_name, lift
from manitwin.models.generators.lift.surface import unseen_share
from manitwin.models.generators.lift.texture import beside
from manitwin.models.generators.protocol import Asked, Generated, GenerationRequest, JobState

ROUGHNESS = 0.6


@dataclass(frozen=True)
class _Job:
    glb: bytes
    notes: dict[str, Any]
    unseen_share: float


class LiftGenerator:
    """Lift a silhouette to a solid: revolution, box or inflation.

    It sees one side only and no depth: a stand-in for tests, demonstrations and machines without a GPU, not to be compared
    with learned generators. ``submit`` does all the work; jobs live as long as this object.
    """

    name = "lift"
    model: str | None = None
    needs: Resource = "cpu"
    asked_with: frozenset[Asked] = frozenset({"image"})
    usd_per_job = 0.0

    def __init__(self) -> None:
        self._jobs: dict[str, _Job] = {}

    def submit(self, request: GenerationRequest) -> str:
        """Make the mesh; raises Unsupported for a text, Rejected for what ``lift`` cannot make."""
        if request.rgba is None:
            raise Unsupported(
                f"lift cannot make a mesh from text ({request.text!r}); give a photo, or choose another generator"
            )
        digest = hashlib.sha256(np.ascontiguousarray(request.rgba).tobytes() + (request.name or "").encode())
        job_id = digest.hexdigest()[:16]
        lifted = lift(request.rgba, hint_from_name(request.name))
        self._jobs[job_id] = _Job(write_glb([textured_part(lifted)]), lifted.notes, unseen_share(lifted.surface))
        return job_id

    def poll(self, job_id: str) -> JobState:
        """Return ``done``, or ``failed`` where this object does not know the job."""
        if job_id in self._jobs:
            return JobState("done")
        return JobState("failed", f"lift has no job {job_id}: its jobs end with the process; submit it again")

    def fetch(self, job_id: str, folder: Path) -> Generated:
        """Write ``lift.glb`` below ``folder``; raises Unavailable for a job that is not known."""
        if job_id not in self._jobs:
            raise Unavailable(self.poll(job_id).message)
        job = self._jobs.pop(job_id)
        path = folder / "lift.glb"
        path.write_bytes(job.glb)
        return Generated(
            path=path, model=str(job.notes["primitive"]), notes=job.notes, rests=True, unseen_share=job.unseen_share
        )


def textured_part(lifted: Lifted) -> trimesh.Trimesh:
    """Return the mesh in the object frame (Z up) with its texture: the photo, and beside it what it does not show."""
    surface, seen = lifted.surface, lifted.surface.seen()
    # a vertex on the border of both has a place in each
    corners = np.where(seen[:, None], surface.faces, surface.faces + len(surface.vertices))
    used, faces = np.unique(corners, return_inverse=True)
    source = used % len(surface.vertices)
    texture, uv = beside(lifted.texture, lifted.unseen, surface.uv[source], used >= len(surface.vertices))
    material = PBRMaterial(
        name="photo",
        baseColorFactor=[255, 255, 255, 255],
        baseColorTexture=Image.fromarray(texture),
        metallicFactor=0.0,
        roughnessFactor=ROUGHNESS,
    )
    vertices = surface.vertices[source] @ GLTF_TO_OBJECT[:3, :3].T
    return trimesh.Trimesh(
        vertices,
        faces.reshape(-1, 3),
        visual=TextureVisuals(uv=uv, material=material),
        process=False,
        metadata={"name": "lift"},
    )
