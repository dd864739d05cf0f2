"""Textured mesh from several photos of one object: the template of its name fitted to all, else a carved solid."""

from __future__ import annotations

from collections.abc import Sequence

from manitwin.errors import Rejected
from manitwin.models.generators.lift.carving import are_crossing, carve, superellipse_power
from manitwin.models.generators.lift.hint import ShapeHint, hint_from_name
from manitwin.models.generators.lift.level_carving import has_equal_silhouettes
from manitwin.models.generators.lift.lifting import lift
from manitwin.models.generators.lift.multi_view_result import MultiViewResult, carved_result
from manitwin.models.generators.lift.photo_generation import textured_part
from manitwin.models.generators.lift.posed_views import carve_posed_views, have_poses, scale_to_poses
from manitwin.models.generators.lift.surface import unseen_share
from manitwin.models.generators.protocol import PhotoView
from manitwin.models.generators.templates.fitting.fit import LEAST_CONFIDENCE, alternative_categories, fit, template_for
from manitwin.models.generators.templates.fitting.generated import (
    fit_import_record,
    fit_notes,
    texture_fit,
    visual_part,
)
from manitwin.models.generators.templates.fitting.joint_fit import JointFit, fit_several

MOST_TURN_ERROR_DEG = 30.0
"""Maximum difference between the fitted and the stated turn of a standing template; a larger one contradicts the statement."""


def generate_from_views(views: Sequence[PhotoView], name: str | None, unit_m: float | None = None) -> MultiViewResult:
    """Make the object shown in two or more photos; ``unit_m`` is the poses' unit in metres, if known.

    Raises Rejected ``generator_failed`` if no shape explains every photo, if the stated turns contradict the photos, and if
    the turns are neither stated nor determined by the photos.
    """
    template = template_for(name)
    poor: JointFit | None = None
    if template is not None:
        found = _fit_views(template.category, name, views)
        if found is not None and found.confidence >= LEAST_CONFIDENCE:
            made = _fitted_result(found, views, name)
            return made if unit_m is None or not have_poses(views) else scale_to_poses(made, views, unit_m)
        poor = found
    hint = hint_from_name(name)
    try:
        if hint.container:
            raise Rejected("generator_failed", "outlines do not show the hollow of an open container", "generate")
        return carve_posed_views(views, unit_m) if have_poses(views) else _carve_or_lift(views, hint)
    except Rejected as error:
        if poor is None:
            raise
        worst = min(range(len(views)), key=lambda k: poor.fits[k].confidence)
        left = poor.fits[worst].residual
        raise Rejected(
            error.reason,
            f"{error.detail}; and no {poor.fits[0].category} that the template makes explains all photos: the worst,"
            f" {views[worst].name}, by an overlap of {left.iou:.2f}, outlines {left.outline:.4f} of its length apart",
            error.stage,
        ) from error


def _stated_turns(views: Sequence[PhotoView]) -> list[float] | None:
    turns = [view.turn_deg for view in views if view.turn_deg is not None]
    return turns if len(turns) == len(views) else None


def _fit_views(category: str, name: str | None, views: Sequence[PhotoView]) -> JointFit | None:
    """Fit the category that explains the first photo best, at the stated turns if there are any."""
    kinds, photos, turns = alternative_categories(category, name), [view.rgba for view in views], _stated_turns(views)
    focals_mm = [view.focal_mm for view in views]
    meant = fit(category, photos[0], or_of=kinds, focal_mm=focals_mm[0]) if kinds else None
    category = category if meant is None else meant.category
    found = fit_several(category, photos, turns_deg=turns, focals_mm=focals_mm)
    if turns is None or (
        found is not None and found.confidence >= LEAST_CONFIDENCE and not _contradicted_turns(found, views)
    ):
        return found
    free = fit_several(category, photos, focals_mm=focals_mm)
    if free is None or free.confidence < LEAST_CONFIDENCE:
        return found
    wrong = _contradicted_turns(free, views, told_only=True)
    if wrong and have_poses(views):
        return found  # the poses determine the facing direction, so the template is not that of this object
    if wrong:
        raise Rejected(
            "generator_failed",
            f"the stated turns are not those of the photos: {'; '.join(wrong)}; correct --turns (degrees, counter-clockwise"
            " seen from above), or leave them out to have them estimated",
            "generate",
        )
    return found if _contradicted_turns(free, views) else free


def _contradicted_turns(found: JointFit, views: Sequence[PhotoView], *, told_only: bool = False) -> list[str]:
    """Return which photos of a standing object were fitted at another turn than stated.

    With ``told_only``, only photos that clearly show their turn count.
    """
    first = views[0].turn_deg or 0.0
    said = []
    for view, fit_, turn, told in zip(views, found.fits, found.turns_deg, found.has_unique_turn, strict=True):
        stated = ((view.turn_deg or 0.0) - first) % 360.0
        away = abs((turn - stated + 180.0) % 360.0 - 180.0)
        clear = not told_only or (told and found.has_unique_turn[0])
        if clear and fit_.upright and found.fits[0].upright and away > MOST_TURN_ERROR_DEG:
            said.append(f"{view.name} shows the {fit_.category} from {turn:.0f} degrees, not {stated:.0f}")
    return said


def _fitted_result(found: JointFit, views: Sequence[PhotoView], name: str | None) -> MultiViewResult:
    """Return the textured template fitted to all photos; a photo whose turn is unknown gives no colours."""
    stated = _stated_turns(views) is not None
    # a photo with unknown turn may show any side, so its colours are not used
    shown = [
        number == 0 or stated or (found.has_unique_turn[0] and found.has_unique_turn[number])
        for number in range(len(views))
    ]
    fits = [fit_ for fit_, taken in zip(found.fits, shown, strict=True) if taken]
    surface = texture_fit(fits, [view.rgba for view, taken in zip(views, shown, strict=True) if taken])
    worst = min(found.fits, key=lambda fit_: fit_.confidence)
    photos = [
        {
            "name": view.name,
            "turn_deg": turn if told or stated else None,
            "turn_stated": stated,
            "colours": taken,
            **{key: fit_notes(fit_)[key] for key in ("confidence", "residual", "view")},
        }
        for view, fit_, turn, told, taken in zip(
            views, found.fits, found.turns_deg, found.has_unique_turn, shown, strict=True
        )
    ]
    notes = fit_notes(worst) | {"source": f"template fitted to {len(views)} photos", "views": photos}
    known = fit_import_record(found.fits[0], name or worst.category, surface)
    return MultiViewResult(visual_part(surface), notes, surface.unseen_share, known)


def _carve_or_lift(views: Sequence[PhotoView], hint: ShapeHint) -> MultiViewResult:
    """Carve a solid from photos with stated turns, or lift a round object without them; raises Rejected otherwise."""
    photos = [(view.name, view.rgba) for view in views]
    turns = _stated_turns(views)
    if turns is None:
        return _lift_round_object(views, hint)
    if not are_crossing(turns):
        names = ", ".join(view.name for view in views)
        raise Rejected(
            "generator_failed",
            f"{names}: all are from one direction or its opposite, so their outlines do not show the depth; add a"
            f" photo from the side",
            "generate",
        )
    lenses = {view.focal_mm for view in views}
    carved = carve(photos, turns, power=superellipse_power(hint), focal_mm=lenses.pop() if len(lenses) == 1 else None)
    return carved_result(carved, f"carved out of {len(views)} photos")


def _lift_round_object(views: Sequence[PhotoView], hint: ShapeHint) -> MultiViewResult:
    """Return the lifted first photo of a round object: its silhouette is the same from every side, so no turn is needed.

    For other objects silhouettes do not determine the turns: two of the same height are those of some solid at any turn, and
    more are also those of its mirror image (Koenderink and van Doorn 1991: orthographic views determine a shape up to such
    transformations).
    """
    names = ", ".join(view.name for view in views)
    if not (hint.round and has_equal_silhouettes([(view.name, view.rgba) for view in views])):
        raise Rejected(
            "generator_failed",
            f"{names}: without a matching template, outlines alone do not determine the camera directions; give the"
            " camera's turns with --turns, or in a column turn_deg (degrees, counter-clockwise from above, such as 0,90,180)",
            "generate",
        )
    lifted = lift(views[0].rgba, hint)
    seen = [
        {"name": view.name, "turn_deg": None, "turn_stated": False, "covered": None, "colours": number == 0}
        for number, view in enumerate(views)
    ]
    notes = lifted.notes | {"source": "a round thing's outline, the same in all photos", "views": seen}
    return MultiViewResult(textured_part(lifted), notes, unseen_share(lifted.surface))
