"""Standardization of any mesh: textured parts and a watertight solid, in the object frame, in metres (paper, "3D Generation")."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import trimesh
from scipy.spatial import QhullError

from manitwin.config import MeshConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.errors import InputError, Rejected
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.read import MeshFile, read_mesh
from manitwin.formats.meshes.repaired_parts import repaired_parts
from manitwin.formats.meshes.source import MeshLimits
from manitwin.formats.meshes.textures import bake_transform
from manitwin.formats.printable import printable_line
from manitwin.geometry.boxes import extents_along_sides
from manitwin.geometry.canonical_frame import UpChoice, choose_up, object_frame
from manitwin.geometry.length_unit import LengthUnit, decide_unit
from manitwin.geometry.poses import OBJECT_TO_GLTF
from manitwin.geometry.repair.cascade import RepairResult, repair
from manitwin.geometry.repair.components import connected_parts
from manitwin.geometry.repair.welding import weld_equal
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.prior_records import Prior
from manitwin.pipeline.human_corrections import SIZE, corrected_size
from manitwin.pipeline.item import Item
from manitwin.pipeline.object_state import drop_cached_textures, object_name
from manitwin.pipeline.stated_volume import factor_to_hold, stated_volume_m3
from manitwin.twin.import_record import ImportRecord, read_import_record

_GENERATED = "generated.glb"
_LEAST_LENGTH_M = 1e-9
_LEAST_AREA = 1e-12  # relative to the square of the longest side
_TURNED_DEG = 10.0  # a smaller angle is a scan slightly off its base, not another pose


@dataclass(frozen=True)
class MeshStage:
    """Read, repair, scale and orient the mesh (paper, "standardization": watertight, metres, canonical pose).

    Writes ``canonical.glb``, ``canonical.npz`` and the field ``geometry``.
    """

    settings: MeshConfig

    name: ClassVar[str] = "mesh"
    version: ClassVar[str] = "21"
    reads: ClassVar[tuple[str, ...]] = (f"{_GENERATED}?", "generation?", "naming?")
    writes: ClassVar[tuple[str, ...]] = ("canonical.glb", "canonical.npz", "geometry")
    needs: ClassVar[Resource] = "cpu"
    backend: ClassVar[str] = "builtin"
    model: ClassVar[str | None] = None

    def run(self, draft: Draft[Item], folder: Path) -> dict[str, Any]:
        """Write ``canonical.glb`` and ``canonical.npz`` (vertices (V, 3) m, faces (F, 3)); return ``geometry``.

        Raises InputError for an unreadable file, and Rejected ``degenerate`` for a surface without extent.
        """
        generated = _GENERATED in draft.paths
        path = _input_path(draft, generated)
        drop_cached_textures()
        file = read_mesh(path, limits=self._limits())
        prior = find_prior(object_name(draft))
        unit = _unit(file, draft, generated, prior)
        if not generated:
            unit = replace(unit, factor=unit.factor * _approximate_size_factor(file, unit.factor, draft))
        to_metres = np.diag([unit.factor] * 3 + [1.0])
        parts = [bake_transform(part, to_metres) for part in file.parts]
        soup = _soup(parts)
        _check_extent(soup, path)
        try:
            with np.errstate(all="ignore"):  # overflows at the limits of double precision; the results are checked
                said = _stated_up(draft, generated), _stated_up_source(draft, generated)
                by_convention = prior is not None and not generated and _up_is_convention(draft)
                result, chosen, to_object = self._solid(soup, file, said, prior, by_convention)
        except (QhullError, np.linalg.LinAlgError) as error:
            cause = f"its surface is too flat or too imprecise to make a solid from it ({type(error).__name__})"
            raise _degenerate(path, cause) from error
        vertices = trimesh.transform_points(result.mesh.vertices, to_object)
        larger, is_stated = _to_stated_size(
            vertices, result.mesh.faces, draft, prior, may_hold=generated and not unit.metric
        )
        solid = trimesh.Trimesh(larger * vertices, result.mesh.faces, process=False)
        sized = np.diag([larger, larger, larger, 1.0]) @ to_object
        shown = [bake_transform(part, sized) for part in repaired_parts(parts, result)]
        (folder / "canonical.glb").write_bytes(write_glb(shown, max_texture_size=self.settings.max_texture_size))
        np.savez(folder / "canonical.npz", vertices=np.asarray(solid.vertices), faces=np.asarray(solid.faces, np.int64))
        if is_stated:
            unit = LengthUnit(larger * unit.factor, True, "user", None)
        geometry = _geometry(file, unit, chosen, result, solid, larger)
        if (said_by_person := corrected_size(draft)) is not None:
            geometry[SIZE] = said_by_person.model_dump()
        known = draft.field("generation").get("known") if generated else None
        if known is not None:
            to_mesh = to_object @ np.diag([unit.factor / larger] * 3 + [1.0]) @ OBJECT_TO_GLTF
            moved = ImportRecord.model_validate(known).moved(to_mesh)
            geometry["known"] = (moved if larger == 1.0 else moved.scaled(larger)).model_dump(mode="json")
        if draft.payload.given is not None:  # other data of the import must follow the mesh
            geometry["input_to_object"] = (sized @ to_metres).tolist()
        return {"geometry": geometry}

    def _solid(
        self,
        soup: trimesh.Trimesh,
        file: MeshFile,
        said: tuple[Literal["y", "z", "auto"], str],
        prior: Prior | None,
        by_convention: bool,
    ) -> tuple[RepairResult, UpChoice, np.ndarray]:
        """Return the repaired solid, its up axis, and its transform to the object frame ``(4, 4)``.

        ``said`` is the stated up axis with its source; ``by_convention`` as in ``choose_up``.
        """
        result = repair(soup, **self.settings.repair.model_dump())
        stands = None if prior is None or prior.often_stands else prior.stands
        opens_up = None if prior is None else prior.container or prior.vessel
        chosen = choose_up(
            result.mesh,
            user=said[0],
            file_up=file.up,
            stands=stands,
            opens_up=opens_up,
            opens_aside=prior is not None and prior.opens_aside,
            level=prior is not None and prior.level,
            said_by=said[1],
            by_convention=by_convention,
        )
        return result, chosen, object_frame(np.asarray(result.mesh.vertices), chosen.rotation)

    def _limits(self) -> MeshLimits:
        return MeshLimits(self.settings.max_bytes, self.settings.max_faces, self.settings.max_texture_pixels)


def _check_extent(soup: trimesh.Trimesh, path: Path) -> None:
    """Raise Rejected ``degenerate`` for a surface in metres that is a point, a line, or smaller than an atom."""
    triangles = np.asarray(soup.vertices)[np.asarray(soup.faces)]
    low = triangles.min(axis=(0, 1))
    longest = float((triangles.max(axis=(0, 1)) - low).max())
    if not longest >= _LEAST_LENGTH_M:
        raise _degenerate(path, f"all of its points lie within {longest:.3g} m")
    scaled = (triangles - low) / longest  # areas of small lengths would underflow
    cross = np.cross(scaled[:, 1] - scaled[:, 0], scaled[:, 2] - scaled[:, 0])
    if not float(np.linalg.norm(cross, axis=1).sum()) > _LEAST_AREA:
        raise _degenerate(path, "all of its faces have zero area")


def _degenerate(path: Path, cause: str) -> Rejected:
    return Rejected(
        "degenerate", f"{printable_line(path.name)}: {cause}; give a mesh that encloses a volume", stage="gate"
    )


def _input_path(draft: Draft[Item], generated: bool) -> Path:
    if generated:
        return draft.path(_GENERATED)
    if draft.payload.file is None:
        raise InputError("empty", "no mesh was given or generated; give a file")
    return Path(draft.payload.file)


def _approximate_size_factor(file: MeshFile, factor: float, draft: Draft[Item]) -> float:
    """Return the factor from the file's longest side (``factor`` m per unit) to the stated length; 1 if none is stated.

    Repair uses lengths in metres, such as the wall of an open sheet. The exact scale is applied later, since the object may be
    a little longer once upright.
    """
    longest_m = _stated_m(draft)
    if longest_m is None:
        return 1.0
    side_m = factor * _longest(file)
    return longest_m / side_m if side_m >= _LEAST_LENGTH_M else 1.0


def _stated_m(draft: Draft[Item]) -> float | None:
    """Return the longest side (m) stated in a review or with the input; None if not stated."""
    said = corrected_size(draft)
    return draft.payload.longest_side_m if said is None else said.value


def _to_stated_size(
    vertices: np.ndarray, faces: np.ndarray, draft: Draft[Item], prior: Prior | None, *, may_hold: bool
) -> tuple[float, bool]:
    """Return the scale factor to the stated size of the upright object, and whether a size was stated.

    ``may_hold``: otherwise a volume stated in the name is used (``stated_volume``); not for a mesh file, which may include
    walls.
    """
    longest_m = _stated_m(draft)
    if longest_m is not None:
        return longest_m / float(extents_along_sides(vertices).max()), True
    volume_m3 = stated_volume_m3(object_name(draft), prior) if may_hold else None
    if volume_m3 is None or prior is None:
        return 1.0, False
    factor = factor_to_hold(trimesh.Trimesh(vertices, faces, process=False), volume_m3, prior)
    return (1.0, False) if factor is None else (factor, True)


def _stated_up(draft: Draft[Item], generated: bool) -> Literal["y", "z", "auto"]:
    """Return the up axis stated by the user, or implied by a generator that sets its meshes down."""
    if not generated:
        return draft.payload.up
    return "y" if draft.field("generation").get("rests", False) else "auto"


def _stated_up_source(draft: Draft[Item], generated: bool) -> str:
    """Return the source of the stated up axis: the generator, the import, or the user."""
    if generated:
        return "the generator"
    return "the user" if draft.payload.given is None else "the import"


def _up_is_convention(draft: Draft[Item]) -> bool:
    """Return whether the up axis is only that of an imported asset's world, without points or poses that show its orientation."""
    return draft.payload.given is not None and not read_import_record(Path(draft.payload.given)).has_annotated_poses


def _unit(file: MeshFile, draft: Draft[Item], generated: bool, prior: Prior | None) -> LengthUnit:
    if generated:
        # glTF always means metres; only the generator knows whether its meshes are metric
        metric = bool(draft.field("generation").get("metric", False))
        return LengthUnit(file.unit_m or 1.0, metric, "declared" if metric else "unknown", None)
    usual = None if prior is None else (prior.longest_axis_m.low, prior.longest_axis_m.high)
    return decide_unit(
        _longest(file), user=draft.payload.units, file_unit_m=file.unit_m, expected_m=usual, file_format=file.format
    )


def _longest(file: MeshFile) -> float:
    """Return the longest side of a mesh along the axes of its file, in the file's units."""
    points = np.concatenate([part.vertices[np.unique(part.faces)] for part in file.parts])
    return float(np.ptp(points, axis=0).max())


def _soup(parts: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Return the faces of all parts in order, each part welded at texture and normal seams.

    Closed parts stay separate bodies: if touching boxes were welded, they would share edges with four faces.
    """
    welded = [weld_equal(np.asarray(part.vertices, float), np.asarray(part.faces)) for part in parts]
    vertices, faces = trimesh.util.append_faces([each for each, _ in welded], [each for _, each in welded])
    return trimesh.Trimesh(vertices, faces, process=False)


def _geometry(
    file: MeshFile,
    unit: LengthUnit,
    chosen: UpChoice,
    result: RepairResult,
    solid: trimesh.Trimesh,
    larger: float,
) -> dict[str, Any]:
    findings = list(file.findings)
    if unit.finding is not None:
        findings.append(unit.finding)
    if chosen.probability == 0.0 or (file.up is not None and chosen.turned_deg > _TURNED_DEG):
        turned = f"turned by {chosen.turned_deg:.0f} degrees from {chosen.up} up: " if chosen.turned_deg >= 1 else ""
        findings.append(f"{turned}{chosen.reason}")
    return {
        "format": file.format,
        "units": unit.source,
        "unit_factor": unit.factor,
        "unit_finding": unit.finding,
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
        "thickness_m": None if result.thickness_m is None else larger * result.thickness_m,
        "findings": findings,
    }
