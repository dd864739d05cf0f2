"""Make any mesh textured parts and a watertight solid, upright in the object frame, in metres (paper, "3D Generation")."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import trimesh

from manitwin.config import MeshConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.errors import InputError
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.read import MeshFile, read_mesh
from manitwin.formats.meshes.repaired import repaired_parts
from manitwin.formats.meshes.source import MeshLimits
from manitwin.formats.meshes.textures import bake_transform
from manitwin.geometry.canonical_frame import LengthUnit, UpChoice, choose_up, decide_unit, object_frame
from manitwin.geometry.repair.cascade import RepairResult, repair
from manitwin.geometry.repair.components import connected_parts
from manitwin.models.annotators.priors import Prior, lookup
from manitwin.pipeline.item import Item

_GENERATED = "generated.glb"
_TURNED_DEG = 10.0  # less is a scan that stands a little off its base, not another pose


@dataclass(frozen=True)
class MeshStage:
    """Read, repair, scale and orient the mesh (the paper's "standardization": watertight, metres, canonical pose)."""

    settings: MeshConfig

    name: ClassVar[str] = "mesh"
    version: ClassVar[str] = "1"
    reads: ClassVar[tuple[str, ...]] = (f"{_GENERATED}?", "generation?")
    writes: ClassVar[tuple[str, ...]] = ("canonical.glb", "canonical.npz", "geometry")
    needs: ClassVar[Resource] = "cpu"
    backend: ClassVar[str] = "builtin"
    model: ClassVar[str | None] = None

    def run(self, draft: Draft[Item], folder: Path) -> dict[str, Any]:
        """Write ``canonical.glb`` and ``canonical.npz`` (vertices (V, 3) m, faces (F, 3)); return ``geometry``.

        Raises InputError where the file cannot be read.
        """
        generated = _GENERATED in draft.paths
        file = read_mesh(_input_path(draft, generated), limits=self._limits())
        prior = lookup(draft.payload.name)
        unit = _unit(file, draft, generated, prior)
        parts = [bake_transform(part, np.diag([unit.factor, unit.factor, unit.factor, 1.0])) for part in file.parts]
        result = repair(_soup(parts), **self.settings.repair.model_dump())
        chosen = choose_up(
            result.mesh,
            user=_said_up(draft, generated),
            file_up=file.up,
            stands=None if prior is None else prior.stands,
        )
        to_object = object_frame(np.asarray(result.mesh.vertices), chosen.rotation)
        solid = trimesh.Trimesh(
            trimesh.transform_points(result.mesh.vertices, to_object), result.mesh.faces, process=False
        )
        shown = [bake_transform(part, to_object) for part in repaired_parts(parts, result)]
        (folder / "canonical.glb").write_bytes(write_glb(shown, max_texture_size=self.settings.max_texture_size))
        np.savez(folder / "canonical.npz", vertices=np.asarray(solid.vertices), faces=np.asarray(solid.faces, np.int64))
        geometry = _geometry(file, unit, chosen, result, solid)
        if draft.payload.given is not None:  # what else is given of the mesh has to follow it
            geometry["input_to_object"] = (to_object @ np.diag([unit.factor] * 3 + [1.0])).tolist()
        return {"geometry": geometry}

    def _limits(self) -> MeshLimits:
        return MeshLimits(self.settings.max_bytes, self.settings.max_faces, self.settings.max_texture_pixels)


def _input_path(draft: Draft[Item], generated: bool) -> Path:
    if generated:
        return draft.path(_GENERATED)
    if draft.payload.file is None:
        raise InputError("empty", "no mesh file and nothing generated; give a file")
    return Path(draft.payload.file)


def _said_up(draft: Draft[Item], generated: bool) -> Literal["y", "z", "auto"]:
    """Return the up axis as the user said it, or as a generator did that sets its meshes down by itself."""
    if not generated:
        return draft.payload.up
    return "y" if draft.field("generation").get("rests", False) else "auto"


def _unit(file: MeshFile, draft: Draft[Item], generated: bool, prior: Prior | None) -> LengthUnit:
    points = np.concatenate([part.vertices[np.unique(part.faces)] for part in file.parts])
    longest = float(np.ptp(points, axis=0).max())
    if generated:
        # a generator's glTF says metres because glTF has no other unit; only the generator knows whether it meant them
        metric = bool(draft.field("generation").get("metric", False))
        return LengthUnit(file.unit_m or 1.0, metric, "declared" if metric else "unknown", None)
    usual = None if prior is None else (prior.longest_axis_m.low, prior.longest_axis_m.high)
    return decide_unit(longest, user=draft.payload.units, file_unit_m=file.unit_m, expected_m=usual)


def _soup(parts: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    vertices, faces = trimesh.util.append_faces([part.vertices for part in parts], [part.faces for part in parts])
    return trimesh.Trimesh(vertices, faces, process=False)


def _geometry(
    file: MeshFile, unit: LengthUnit, chosen: UpChoice, result: RepairResult, solid: trimesh.Trimesh
) -> dict[str, Any]:
    findings = list(file.findings)
    if unit.finding is not None:
        findings.append(unit.finding)
    if chosen.probability == 0.0 or (file.up is not None and chosen.turned_deg > _TURNED_DEG):
        findings.append(f"turned by {chosen.turned_deg:.0f} degrees from {chosen.up} up: {chosen.reason}")
    return {
        "format": file.format,
        "units": unit.source,
        "unit_factor": unit.factor,
        "metric": unit.metric,
        "up": chosen.up,
        "up_reason": chosen.reason,
        "pose_probability": chosen.probability,
        "repairs": list(result.actions),
        "watertight": bool(result.watertight),
        "components": len(connected_parts(solid)),
        "euler_number": int(solid.euler_number),
        "vertices": len(solid.vertices),
        "faces": len(solid.faces),
        "thickness_m": result.thickness_m,
        "findings": findings,
    }
