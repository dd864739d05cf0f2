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
from manitwin.models.annotators.prior_names import lookup
from manitwin.models.annotators.words import article
from manitwin.models.generators.lift.end_on import reject_end_on
from manitwin.models.generators.lift.filled_holes import reject_filled_holes
from manitwin.models.generators.lift.heaps import reject_heap
from manitwin.models.generators.lift.hint import ShapeHint, hint_from_name, is_cylinder, why_no_cylinder, why_not_round
from manitwin.models.generators.lift.lifting import Lifted, lift
from manitwin.models.generators.lift.lobes import reject_several_round
from manitwin.models.generators.lift.nameless import OF_PLAIN_SOLIDS, ROUND, Alone, explains_more, shape_without_name
from manitwin.models.generators.lift.plain_solids import PRIMITIVES, PlainSolids, plain_solids
from manitwin.models.generators.lift.roundness import is_round, is_round_along
from manitwin.models.generators.lift.seen_corners import box_from_corner
from manitwin.models.generators.lift.surface import unseen_share
from manitwin.models.generators.lift.texture import beside
from manitwin.models.generators.lift.usual_shape import why_never_turned, why_other_proportions
from manitwin.models.generators.photo_material import photo_material
from manitwin.models.generators.templates.fitting.fit import (
    LEAST_AGAINST_INFLATION,
    LEAST_CONFIDENCE,
    LEAST_IOU,
    MOST_OUTLINE,
    Fitted,
    fit,
    kinds_of,
    template_for,
)
from manitwin.models.generators.templates.fitting.generated import (
    known_of_fitted,
    notes_of,
    texture_of,
    visual_part,
    with_its_front_seen,
)
from manitwin.twin.import_record import ImportRecord


@dataclass(frozen=True)
class Job:
    """A finished job: the mesh as GLB, notes on how it was made, and known properties (see ``Generated``)."""

    glb: bytes
    notes: dict[str, Any]
    unseen_share: float | None
    known: ImportRecord | None = None
    metric: bool = False


def from_photo(
    rgba: np.ndarray,
    name: str | None,
    focal_mm: float | None = None,
    *,
    likely: Sequence[tuple[str, float]] = (),
) -> Job:
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
        box = box_from_corner(rgba, focal_mm)
        if box is not None:
            return _shape_alone(box, rgba, primitive="box", source="the outline's six corners")
    if name is None:
        return _without_name(rgba, likely, focal_mm, plain_solids(rgba, hint, focal_mm))
    fitted = (
        None
        if template is None
        else fit(template.category, rgba, or_of=kinds_of(template.category, name), focal_mm=focal_mm)
    )
    lies = fitted is not None and not fitted.upright  # in another pose than the template's
    box = box_from_corner(rgba, focal_mm) if lies else None
    if box is not None and fitted is not None and explains_more(box, fitted.residual.iou):
        return _shape_alone(box, rgba, primitive="box", source="the outline's six corners")
    if template is not None and fitted is not None:
        reject_heap(fitted, name, template.category)
    if fitted is None or fitted.confidence < LEAST_CONFIDENCE:
        solid = plain_solids(rgba, hint, focal_mm).close
        if solid is not None and _why_no_plain(solid, name) is None:
            return _plain(solid, rgba)
    return fitted_or_lifted(fitted, rgba, name)


def _why_no_plain(solid: Fitted, name: str | None) -> str | None:
    """Return why an object of this name cannot be this plain solid; None if it can."""
    extents = np.ptp(solid.made.mesh.vertices, axis=0)
    turned = why_never_turned(name) if PRIMITIVES[solid.category] in ROUND else None
    return turned or why_not_round(name, extents)


def fitted_or_lifted(fitted: Fitted | None, rgba: np.ndarray, name: str | None) -> Job:
    """Return a fit that explains the photo ``rgba (H, W, 4) uint8``, else the lifted photo; raises Rejected if neither does."""
    if fitted is not None and fitted.confidence >= LEAST_CONFIDENCE:
        extents, toward_camera = np.ptp(fitted.made.mesh.vertices, axis=0), fitted.view.object_to_camera[2]
        reject_end_on(extents, toward_camera, fitted.residual.iou, rgba, name or fitted.category)
        return from_fit(fitted, rgba, name)
    hint = hint_from_name(name)
    if fitted is not None and hint.hollow_below and fitted.confidence >= LEAST_AGAINST_INFLATION:
        return from_fit(fitted, rgba, name)  # a lifted silhouette would lack the cavity
    try:
        lifted = lift(rgba, hint)
    except Rejected as error:
        if fitted is None:
            raise
        raise Rejected(
            error.reason,
            f"{error.detail}; and no {fitted.category} that the template makes has this outline: {_how_far(fitted)};"
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
    if fitted is not None and _merely_as_wide(lifted) and not (is_round(fitted) or is_round_along(fitted)):
        raise Rejected(
            "generator_failed",
            f"a round thing would have its outline, but {_one(fitted)} is not round, and no {fitted.category} that the"
            " template makes has it; check the name and the cut-out, or take the photo from higher up",
            "generate",
        )
    odd = why_not_round(name, np.ptp(lifted.surface.vertices, axis=0)) or (
        why_no_cylinder(name, lifted.notes["silhouette"]) if _from_the_side(lifted) else None
    )
    if odd is not None:
        raise Rejected(
            "generator_failed",
            f"{odd}; check the name and the cut-out, or take the photo from another side",
            "generate",
        )
    unlike = _why_unlike(lifted, name)
    if unlike is not None and fitted is not None and fitted.confidence >= LEAST_AGAINST_INFLATION:
        return from_fit(fitted, rgba, name)
    if unlike is not None:
        raise Rejected(
            "generator_failed",
            f"{unlike}; take the photo from another side, or give several photos of it; check the name and the cut-out",
            "generate",
        )
    if lifted.notes.get("elevation_deg"):  # a body of revolution about the upright axis, seen from above
        above = np.radians(lifted.notes["elevation_deg"])
        extents, toward_camera = np.ptp(lifted.surface.vertices, axis=0), np.array([0.0, np.sin(above), np.cos(above)])
        reject_end_on(extents, toward_camera, lifted.explained.silhouette_iou, rgba, name or "thing")
    flat = lifted.notes["primitive"] == "inflation"  # an inflation knows nothing about the back
    if fitted is not None and flat and fitted.confidence >= LEAST_AGAINST_INFLATION:
        return from_fit(fitted, rgba, name)
    if fitted is not None and flat and is_round(fitted) and is_cylinder(name):
        raise Rejected(
            "generator_failed",
            f"{_one(fitted)} is a cylinder, and none has this outline from any side: {_how_far(fitted)};"
            " check the name and the cut-out",
            "generate",
        )
    if fitted is not None and flat and fitted.residual.iou < LEAST_IOU:
        raise Rejected(
            "generator_failed",
            f"no {fitted.category} that the template makes has this outline from any side: {_how_far(fitted)}; check the name,"
            " and that the photo shows one alone, or take it from another side",
            "generate",
        )
    if fitted is not None:
        reject_filled_holes(fitted, rgba)
    notes = lifted.notes if fitted is None else lifted.notes | {"poor_fit": notes_of(fitted)}
    return _lifted_job(lifted, notes)


def _why_unlike(lifted: Lifted, name: str | None) -> str | None:
    """Return why an object of this name cannot be the lifted solid; None if it can."""
    turned = lifted.notes["primitive"] == "revolution"
    extents = np.ptp(lifted.surface.vertices, axis=0)
    return (why_never_turned(name) if turned else None) or why_other_proportions(name, extents, turned=turned)


def _how_far(fitted: Fitted) -> str:
    residual = fitted.residual
    return (
        f"overlap {residual.iou:.2f} (at least {LEAST_IOU}), outlines {residual.outline:.4f} of its length apart"
        f" (at most {MOST_OUTLINE})"
    )


def _from_the_side(lifted: Lifted) -> bool:
    """Tell whether it is a body of revolution that was taken to be seen level."""
    return lifted.notes["primitive"] == "revolution" and not lifted.notes.get("elevation_deg")


def _merely_as_wide(lifted: Lifted) -> bool:
    """Tell whether it is a body of revolution without a visible rim or handles, whose silhouette a box may have too."""
    return _from_the_side(lifted) and not lifted.notes.get("handles")


def _one(fitted: Fitted) -> str:
    return f"{article(fitted.category)} {fitted.category}"


def from_fit(fitted: Fitted, rgba: np.ndarray, name: str | None) -> Job:
    """Return a fitted template textured with the photo."""
    fitted = with_its_front_seen(fitted)
    surface = texture_of([fitted], [rgba])
    known = known_of_fitted(fitted, name or fitted.category, surface)
    return Job(write_glb([visual_part(surface)]), notes_of(fitted), surface.unseen_share, known)


def _without_name(
    rgba: np.ndarray, likely: Sequence[tuple[str, float]], focal_mm: float | None, plain: PlainSolids
) -> Job:
    shape = shape_without_name(rgba, likely, focal_mm, plain)
    if isinstance(shape, Alone):
        return _shape_alone(shape.fitted, rgba, primitive=shape.primitive, source=shape.source)
    return _lifted_job(shape, shape.notes)


def _plain(plain: Fitted, rgba: np.ndarray) -> Job:
    return _shape_alone(plain, rgba, primitive=PRIMITIVES[plain.category], source=OF_PLAIN_SOLIDS)


def _lifted_job(lifted: Lifted, notes: dict[str, Any]) -> Job:
    return Job(write_glb([textured_part(lifted)]), notes, unseen_share(lifted.surface))


def _shape_alone(fitted: Fitted, rgba: np.ndarray, *, primitive: str, source: str) -> Job:
    """Return the solid without known properties: an object with the shape of a box is not named a box.

    Its frame is arbitrary, so it is rotated by quarter turns until the visible side faces -Y.
    """
    surface = texture_of([fitted], [rgba])
    usual = lookup(fitted.category)
    rests = "standing" if fitted.upright and (usual is None or usual.stands is not False) else "lying"
    quarters = round(fitted.view.yaw_rad / (np.pi / 2))
    view = replace(fitted.view, yaw_rad=fitted.view.yaw_rad - quarters * np.pi / 2)
    notes = notes_of(replace(fitted, view=view)) | {"primitive": primitive, "source": source, "rests": rests}
    del notes["category"]
    part = visual_part(surface)
    part.apply_transform(trimesh.transformations.rotation_matrix(quarters * np.pi / 2, [0, 0, 1]))
    return Job(write_glb([part]), notes, surface.unseen_share)


def textured_part(lifted: Lifted) -> trimesh.Trimesh:
    """Return the mesh in the object frame (Z up) with its texture: the photo, and beside it the painted colours."""
    surface, seen = lifted.surface, lifted.surface.seen()
    # a vertex between seen and unseen faces has texture coordinates in both
    corners = np.where(seen[:, None], surface.faces, surface.faces + len(surface.vertices))
    used, faces = np.unique(corners, return_inverse=True)
    source = used % len(surface.vertices)
    texture, uv = beside(lifted.texture, lifted.unseen, surface.uv[source], used >= len(surface.vertices))
    material = photo_material(texture)
    vertices = surface.vertices[source] @ GLTF_TO_OBJECT[:3, :3].T
    return trimesh.Trimesh(
        vertices,
        faces.reshape(-1, 3),
        visual=TextureVisuals(uv=uv, material=material),
        process=False,
        metadata={"name": "lift"},
    )
