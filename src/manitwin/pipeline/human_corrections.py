"""Corrections by people, which replace estimated or selected values; their ``source`` is human:<annotator>."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from manitwin.engine.stage import Draft
from manitwin.errors import BadReply
from manitwin.models.annotators.protocol import PhysicalEstimates, PointsRequest, SelectedPoints
from manitwin.pipeline.item import Item
from manitwin.twin.point_records import FunctionalPoint, GraspPoint
from manitwin.twin.record import Language
from manitwin.twin.record_values import Estimate, Record

HUMAN = "human:"
CATEGORY, MASS, SIZE, MOVES = "category", "mass_kg", "longest_side_m", "moves"
"""Keys of a stage's amendment: a name, two Estimates, and ``{point id: {candidate, place, label, source}}``."""
STAGES = {
    CATEGORY: ("physical", "caption", "points", "parts", "finish"),
    MASS: ("physical",),
    SIZE: ("physical",),
    MOVES: ("points",),
}
"""The stages that read each correction; a category acts as a name, like the user's, for all stages after the mesh."""
NAME = "name"
NAME_STAGES = ("photo", "name", "generate", "mesh", "gate", *STAGES[CATEGORY])
"""Key of the amendments that name an input, and their stages: a ``CorrectedName`` acts like --name, from the photo stage on."""
SIZE_STAGE = "mesh"
"""Its amendment ``SIZE``, an Estimate, is the longest side as in --longest-side; the one of ``physical`` is applied
afterwards.
"""


class CorrectedName(Record):
    """A name given by a person to an input that was built without a name, or with another; ``source`` is the person."""

    value: str
    source: str


def is_human(source: str) -> bool:
    """Return whether a source is a person."""
    return source.startswith(HUMAN)


def corrected_category(draft: Draft[Item]) -> str | None:
    """Return the category given by a person, if the running stage reads it."""
    return next((str(each[CATEGORY]) for each in draft.amendments.values() if CATEGORY in each), None)


def corrected_name(draft: Draft[Item]) -> CorrectedName | None:
    """Return the name given later by a person, if the running stage reads it."""
    said = next((each[NAME] for each in draft.amendments.values() if NAME in each), None)
    return None if said is None else CorrectedName.model_validate(said)


def name_by_person(draft: Draft[Item]) -> str | None:
    """Return the object's name as stated by people: a correction takes precedence over the user's input; None if not stated."""
    corrected = corrected_category(draft)
    if corrected is not None:
        return corrected
    said = corrected_name(draft)
    return draft.payload.name if said is None else said.value


def corrected_size(draft: Draft[Item]) -> Estimate | None:
    """Return the longest side (m) stated later by a person, if the running stage is the mesh stage."""
    said = draft.amendments.get(SIZE_STAGE, {}).get(SIZE)
    return None if said is None else Estimate.model_validate(said)


def corrected_estimates(estimates: PhysicalEstimates, amendment: Mapping[str, Any]) -> PhysicalEstimates:
    """Return the estimates with a person's mass (kg) and longest side (m)."""
    mass, size = amendment.get(MASS), amendment.get(SIZE)
    return replace(
        estimates,
        mass_kg=estimates.mass_kg if mass is None else Estimate.model_validate(mass),
        longest_axis_m=estimates.longest_axis_m if size is None else Estimate.model_validate(size),
    )


def corrected_language(language: Language, draft: Draft[Item]) -> Language:
    """Return the description with a person's category."""
    category = corrected_category(draft)
    return language if category is None else language.model_copy(update={"category": category})


def corrected_points(selected: SelectedPoints, request: PointsRequest, amendment: Mapping[str, Any]) -> SelectedPoints:
    """Return the points, with those that a person has moved at their new candidates.

    A correction applies to the point with its id and label; if the annotator has since selected others, to the only point with
    that label. Raises BadReply if there is none, or if the candidate is now at another place of the object: the twin must be
    reviewed again.
    """
    functional, grasp = list(selected.functional), list(selected.grasp)
    for point_id, move in sorted(amendment.get(MOVES, {}).items()):
        if point_id.startswith("f"):
            place = _place_of(functional, point_id, move)
            functional[place] = _moved(functional[place], request, move)
        else:
            place = _place_of(grasp, point_id, move)
            grasp[place] = _moved(grasp[place], request, move)
    return replace(selected, functional=tuple(functional), grasp=tuple(grasp))


def place_in_box(positions_m: np.ndarray, candidate: int) -> list[float]:
    """Return a candidate's position among all ``(N, 3)``: relative to the lower corner of their box, in units of its longest
    side.

    This makes it independent of the object's size.
    """
    lower, side_m = _box(positions_m)
    return [round(float(each), 6) for each in (positions_m[candidate] - lower) / side_m]


def is_at(positions_m: np.ndarray, candidate: int, place: np.ndarray) -> bool:
    """Return whether a candidate is the nearest of all to a position as returned by ``place_in_box``."""
    lower, side_m = _box(positions_m)
    distances = np.linalg.norm((positions_m - lower) / side_m - place, axis=1)
    return bool(distances[candidate] <= distances.min())


def _box(positions_m: np.ndarray) -> tuple[np.ndarray, float]:
    return positions_m.min(0), max(float(np.ptp(positions_m, axis=0).max()), 1e-9)


def _place_of(points: list[FunctionalPoint] | list[GraspPoint], point_id: str, move: Mapping[str, Any]) -> int:
    there: list[tuple[str, str | None]] = [(point.id, point.label) for point in points]
    alike = [place for place, (_, label) in enumerate(there) if label == move["label"]]
    own = [place for place in alike if there[place][0] == point_id]
    if not own and len(alike) != 1:
        raise BadReply(
            f"{point_id} ({move['label']}) was moved by {move['source']}, but is no longer a point; review the twin"
            f" again, or remove the amendment"
        )
    return (own or alike)[0]


def _moved(point: Any, request: PointsRequest, move: Mapping[str, Any]) -> Any:
    candidate = int(move["candidate"])
    if candidate >= len(request.positions_m):
        raise BadReply(f"{point.id} was moved to candidate {candidate}, of {len(request.positions_m)}; review it again")
    place = move.get("place")  # corrections of earlier versions lack it
    if place is not None and not is_at(request.positions_m, candidate, np.asarray(place, float)):
        raise BadReply(
            f"{point.id} was moved by {move['source']} to candidate {candidate}, which is now at another place of"
            f" the object; review the twin again, or remove the amendment"
        )
    said = f"moved from candidate {point.candidate}"
    return point.model_copy(update={**request.place(candidate), "source": move["source"], "rationale": said})
