"""Job for a matted photo: the template of its name, fitted, or its lifted silhouette."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import trimesh
from trimesh.visual import TextureVisuals

from manitwin.errors import Rejected
from manitwin.formats.glb import write_glb
from manitwin.geometry.poses import GLTF_TO_OBJECT
from manitwin.models.annotators.descriptions import article
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.generators.lift.end_on import reject_end_view
from manitwin.models.generators.lift.filled_holes import reject_filled_holes
from manitwin.models.generators.lift.hint import (
    ShapeHint,
    cylinder_conflict,
    hint_from_name,
    is_cylinder,
    roundness_conflict,
)
from manitwin.models.generators.lift.lifting import LiftedObject, lift
from manitwin.models.generators.lift.plain_solids import PRIMITIVES, PlainSolids, plain_solids
from manitwin.models.generators.lift.roundness import is_round, is_round_along
from manitwin.models.generators.lift.seen_corners import fit_corner_box
from manitwin.models.generators.lift.several_objects import reject_several_objects
from manitwin.models.generators.lift.surface import unseen_share
from manitwin.models.generators.lift.texture import place_beside
from manitwin.models.generators.lift.touching_round_objects import reject_several_round
from manitwin.models.generators.lift.unnamed_shape import (
    PLAIN_SOLID_SOURCE,
    ROUND_SOLIDS,
    UnnamedShape,
    choose_unnamed_shape,
    explains_more,
)
from manitwin.models.generators.lift.usual_shape import proportion_conflict, revolution_conflict
from manitwin.models.generators.photo_material import photo_material
from manitwin.models.generators.templates.fitting.fit import (
    LEAST_AGAINST_INFLATION,
    LEAST_CONFIDENCE,
    LEAST_IOU,
    MOST_OUTLINE,
    TemplateFit,
    alternative_categories,
    fit,
    template_for,
)
from manitwin.models.generators.templates.fitting.generated import (
    fit_import_record,
    fit_notes,
    rotate_front_to_camera,
    texture_fit,
    visual_part,
)
from manitwin.twin.import_record import ImportRecord


@dataclass(frozen=True)
class LiftResult:
    """A finished job: the mesh as GLB, notes on how it was made, and known properties (see ``Generated``)."""

    glb: bytes
    notes: dict[str, Any]
    unseen_share: float | None
    known: ImportRecord | None = None
    metric: bool = False


def generate_from_photo(
    rgba: np.ndarray,
    name: str | None,
    focal_mm: float | None = None,
    *,
    likely: Sequence[tuple[str, float]] = (),
) -> LiftResult:
    """Return the template of the name if its fit explains the photo, else the lifted photo; raises Rejected.

    Without a template, and without a name or with a boxy one, the result is a box if the silhouette is that of a box seen
    from a corner; likewise for an object in another pose than its template's if a box explains it much better (a speaker
    lying on its side). Without an accepted template, a plain solid is used if it explains the photo closely. Without a name,
    the shape that explains the photo best is used (``nameless``), including templates of the ``likely`` names (name,
    probability). ``focal_mm`` is the 35 mm equivalent focal length, if known. Several touching objects of the name are
    rejected.
    """
    reject_several_round(rgba[..., 3] > 127, name, likely)
    template = template_for(name)
    hint = hint_from_name(name)
    if template is None and (hint == ShapeHint() or hint.boxy):
        box = fit_corner_box(rgba, focal_mm)
        if box is not None:
            return _unnamed_result(box, rgba, primitive="box", source="the outline's six corners")
    if name is None:
        return _generate_unnamed(rgba, likely, focal_mm, plain_solids(rgba, hint, focal_mm))
    fitted = (
        None
        if template is None
        else fit(template.category, rgba, or_of=alternative_categories(template.category, name), focal_mm=focal_mm)
    )
    lies = fitted is not None and not fitted.upright  # in another pose than the template's
    box = fit_corner_box(rgba, focal_mm) if lies else None
    if box is not None and fitted is not None and explains_more(box, fitted.residual.iou):
        return _unnamed_result(box, rgba, primitive="box", source="the outline's six corners")
    if template is not None and fitted is not None:
        reject_several_objects(fitted, name, template.category)
    if fitted is None or fitted.confidence < LEAST_CONFIDENCE:
        solid = plain_solids(rgba, hint, focal_mm).close_fit
        if solid is not None and _plain_solid_conflict(solid, name) is None:
            return _plain_solid_result(solid, rgba)
    return fit_or_lift(fitted, rgba, name)


def _plain_solid_conflict(solid: TemplateFit, name: str | None) -> str | None:
    """Return why an object of this name cannot be this plain solid; None if it can."""
    extents = np.ptp(solid.made.mesh.vertices, axis=0)
    turned = revolution_conflict(name) if PRIMITIVES[solid.category] in ROUND_SOLIDS else None
    return turned or roundness_conflict(name, extents)


def fit_or_lift(fitted: TemplateFit | None, rgba: np.ndarray, name: str | None) -> LiftResult:
    """Return a fit that explains the photo ``rgba (H, W, 4) uint8``, else the lifted photo; raises Rejected if neither does."""
    if fitted is not None and fitted.confidence >= LEAST_CONFIDENCE:
        extents, toward_camera = np.ptp(fitted.made.mesh.vertices, axis=0), fitted.view.object_to_camera[2]
        reject_end_view(extents, toward_camera, fitted.residual.iou, rgba, name or fitted.category)
        return fitted_result(fitted, rgba, name)
    hint = hint_from_name(name)
    if fitted is not None and hint.hollow_below and fitted.confidence >= LEAST_AGAINST_INFLATION:
        return fitted_result(fitted, rgba, name)  # a lifted silhouette would lack the cavity
    try:
        lifted = lift(rgba, hint)
    except Rejected as error:
        if fitted is None:
            raise
        raise Rejected(
            error.reason,
            f"{error.detail}; and no {fitted.category} that the template makes has this outline: {_describe_fit_error(fitted)};"
            " check the name and the cut-out",
            error.stage,
        ) from error
    if fitted is not None and lifted.notes.get("handles") and is_round(fitted):
        raise Rejected(
            "generator_failed",
            f"something sticks out beside the body, which no {fitted.category} has, and no {fitted.category} that the template"
            " makes has this outline; check the name and the cut-out, or take the photo from the side",
            "generate",
        )
    if fitted is not None and _is_plain_revolution(lifted) and not (is_round(fitted) or is_round_along(fitted)):
        raise Rejected(
            "generator_failed",
            f"a round thing would have its outline, but {_with_article(fitted)} is not round, and no {fitted.category} that the"
            " template makes has it; check the name and the cut-out, or take the photo from higher up",
            "generate",
        )
    odd = roundness_conflict(name, np.ptp(lifted.surface.vertices, axis=0)) or (
        cylinder_conflict(name, lifted.notes["silhouette"]) if _is_level_revolution(lifted) else None
    )
    if odd is not None:
        raise Rejected(
            "generator_failed",
            f"{odd}; check the name and the cut-out, or take the photo from another side",
            "generate",
        )
    unlike = _lifted_solid_conflict(lifted, name)
    if unlike is not None and fitted is not None and fitted.confidence >= LEAST_AGAINST_INFLATION:
        return fitted_result(fitted, rgba, name)
    if unlike is not None:
        raise Rejected(
            "generator_failed",
            f"{unlike}; take the photo from another side, or give several photos of it; check the name and the cut-out",
            "generate",
        )
    if lifted.notes.get("elevation_deg"):  # a body of revolution about the upright axis, seen from above
        above = np.radians(lifted.notes["elevation_deg"])
        extents, toward_camera = np.ptp(lifted.surface.vertices, axis=0), np.array([0.0, np.sin(above), np.cos(above)])
        reject_end_view(extents, toward_camera, lifted.explained.silhouette_iou, rgba, name or "thing")
    flat = lifted.notes["primitive"] == "inflation"  # an inflation knows nothing about the back
    if fitted is not None and flat and fitted.confidence >= LEAST_AGAINST_INFLATION:
        return fitted_result(fitted, rgba, name)
    if fitted is not None and flat and is_round(fitted) and is_cylinder(name):
        raise Rejected(
            "generator_failed",
            f"{_with_article(fitted)} is a cylinder, and none has this outline from any side: {_describe_fit_error(fitted)};"
            " check the name and the cut-out",
            "generate",
        )
    if fitted is not None and flat and fitted.residual.iou < LEAST_IOU:
        raise Rejected(
            "generator_failed",
            f"no {fitted.category} that the template makes has this outline from any side: {_describe_fit_error(fitted)}; check"
            " the name, and that the photo shows one alone, or take it from another side",
            "generate",
        )
    if fitted is not None:
        reject_filled_holes(fitted, rgba)
    notes = lifted.notes if fitted is None else lifted.notes | {"poor_fit": fit_notes(fitted)}
    return _lifted_result(lifted, notes)


def _lifted_solid_conflict(lifted: LiftedObject, name: str | None) -> str | None:
    """Return why an object of this name cannot be the lifted solid; None if it can."""
    turned = lifted.notes["primitive"] == "revolution"
    extents = np.ptp(lifted.surface.vertices, axis=0)
    return (revolution_conflict(name) if turned else None) or proportion_conflict(name, extents, turned=turned)


def _describe_fit_error(fitted: TemplateFit) -> str:
    residual = fitted.residual
    return (
        f"overlap {residual.iou:.2f} (at least {LEAST_IOU}), outlines {residual.outline:.4f} of its length apart"
        f" (at most {MOST_OUTLINE})"
    )


def _is_level_revolution(lifted: LiftedObject) -> bool:
    """Tell whether it is a body of revolution that was taken to be seen level."""
    return lifted.notes["primitive"] == "revolution" and not lifted.notes.get("elevation_deg")


def _is_plain_revolution(lifted: LiftedObject) -> bool:
    """Tell whether it is a body of revolution without a visible rim or handles, whose silhouette a box may have too."""
    return _is_level_revolution(lifted) and not lifted.notes.get("handles")


def _with_article(fitted: TemplateFit) -> str:
    return f"{article(fitted.category)} {fitted.category}"


def fitted_result(fitted: TemplateFit, rgba: np.ndarray, name: str | None) -> LiftResult:
    """Return a fitted template textured with the photo."""
    fitted = rotate_front_to_camera(fitted)
    surface = texture_fit([fitted], [rgba])
    known = fit_import_record(fitted, name or fitted.category, surface)
    return LiftResult(write_glb([visual_part(surface)]), fit_notes(fitted), surface.unseen_share, known)


def _generate_unnamed(
    rgba: np.ndarray, likely: Sequence[tuple[str, float]], focal_mm: float | None, plain: PlainSolids
) -> LiftResult:
    shape = choose_unnamed_shape(rgba, likely, focal_mm, plain)
    if isinstance(shape, UnnamedShape):
        return _unnamed_result(shape.fitted, rgba, primitive=shape.primitive, source=shape.source)
    return _lifted_result(shape, shape.notes)


def _plain_solid_result(plain: TemplateFit, rgba: np.ndarray) -> LiftResult:
    return _unnamed_result(plain, rgba, primitive=PRIMITIVES[plain.category], source=PLAIN_SOLID_SOURCE)


def _lifted_result(lifted: LiftedObject, notes: dict[str, Any]) -> LiftResult:
    return LiftResult(write_glb([textured_part(lifted)]), notes, unseen_share(lifted.surface))


def _unnamed_result(fitted: TemplateFit, rgba: np.ndarray, *, primitive: str, source: str) -> LiftResult:
    """Return the solid without known properties: an object with the shape of a box is not named a box.

    Its frame is arbitrary, so it is rotated by quarter turns until the visible side faces -Y.
    """
    surface = texture_fit([fitted], [rgba])
    usual = find_prior(fitted.category)
    rests = "standing" if fitted.upright and (usual is None or usual.stands is not False) else "lying"
    quarters = round(fitted.view.yaw_rad / (np.pi / 2))
    view = replace(fitted.view, yaw_rad=fitted.view.yaw_rad - quarters * np.pi / 2)
    notes = fit_notes(replace(fitted, view=view)) | {"primitive": primitive, "source": source, "rests": rests}
    del notes["category"]
    part = visual_part(surface)
    part.apply_transform(trimesh.transformations.rotation_matrix(quarters * np.pi / 2, [0, 0, 1]))
    return LiftResult(write_glb([part]), notes, surface.unseen_share)


def textured_part(lifted: LiftedObject) -> trimesh.Trimesh:
    """Return the mesh in the object frame (Z up) with its texture: the photo, and beside it the painted colours."""
    surface, seen = lifted.surface, lifted.surface.visible_faces()
    # a vertex between seen and unseen faces has texture coordinates in both
    corners = np.where(seen[:, None], surface.faces, surface.faces + len(surface.vertices))
    used, faces = np.unique(corners, return_inverse=True)
    source = used % len(surface.vertices)
    texture, uv = place_beside(
        lifted.texture, lifted.painted_texture, surface.uv[source], used >= len(surface.vertices)
    )
    material = photo_material(texture)
    vertices = surface.vertices[source] @ GLTF_TO_OBJECT[:3, :3].T
    return trimesh.Trimesh(
        vertices,
        faces.reshape(-1, 3),
        visual=TextureVisuals(uv=uv, material=material),
        process=False,
        metadata={"name": "lift"},
    )
