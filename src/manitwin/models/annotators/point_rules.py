"""Rule-based selection of functional and grasp points: candidates at the geometric features of the parts that a prior names.

Source: paper, "VLM-Based Point Selection": functional points have a label, a description, a confidence and a rationale; grasp
points are chosen by distance to the centre of mass, surface geometry and use.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manitwin.geometry.parts.feature_names import Feature
from manitwin.geometry.parts.features import feature_scores
from manitwin.geometry.parts.membership import Membership
from manitwin.geometry.parts.part_rules import membership
from manitwin.geometry.parts.shape import Shape, SurfacePoints, measure_shape, surface_points
from manitwin.models.annotators.part_names import part_name
from manitwin.models.annotators.prior_records import FunctionalPart, GraspPart, Prior
from manitwin.models.annotators.priors import unknown_prior
from manitwin.models.annotators.protocol import PointsRequest, SelectedPoints
from manitwin.twin.point_records import FunctionalPoint, GraspPoint, GraspType

MOST_FUNCTIONAL, MOST_GRASPS, LEAST = 4, 3, 2  # the paper: 2-4 functional and 2-3 grasp points
MOST_SPARES = 3

_WEAK = 0.2  # minimum score: below it the feature does not exist on the object
_LEVER_M = 0.08  # lever arm at which the variable part of the weight is halved; grasps at 80 mm slip half of the time in SAPIEN
_FINGER_CLEARANCE_M = 0.004  # of the opening: the pads need clearance on both sides
_PINCH_M = 0.03  # maximum thickness of a pinch; thicker parts are held between the pads
_UNSEEN = 0.3  # weight of a candidate that is visible in no view
_TAKEN = 0.35  # weight of a candidate near one that represents another part
_BEHIND = -0.5  # cosine of normals on the two sides of a wall: a plate's base is not on its upper surface
_ELSEWHERE = 0.3  # weight of a candidate that is not on the part named by the label

_GENERIC_FUNCTIONAL: tuple[Feature, ...] = ("top", "end", "base", "front")
_GENERIC_GRASP: tuple[Feature, ...] = ("center", "side", "middle", "edge", "rim")


@dataclass(frozen=True)
class _Choice:
    candidate: int
    score: float


class PointSelection:
    """Selection from one object's candidates, which are scored once, part by part."""

    def __init__(self, request: PointsRequest, prior: Prior | None):
        self.request = request
        self.named = prior is not None
        usual = prior or unknown_prior()
        rng = np.random.default_rng(request.subject.seed)
        solid, center = request.subject.solid, request.center_of_mass_m
        self.shape: Shape = measure_shape(solid, center, usual.head_end, usual.stands, rng)
        self.prior = usual.of_shape(self.shape)
        self._thing = f"the {self.prior.category}" if self.named else "the object"

    @cached_property
    def points(self) -> SurfacePoints:
        """The candidates with the thickness of the object behind them."""
        return surface_points(self.request.subject.solid, self.request.positions_m, self.request.normals)

    @cached_property
    def lever_m(self) -> np.ndarray:
        """Distance (m) of each candidate from the centre of mass."""
        return np.linalg.norm(self.request.positions_m - self.request.center_of_mass_m, axis=1)

    def select(self) -> SelectedPoints:
        """Return 2-4 functional and 2-3 grasp points; within each kind every point has its own candidate."""
        grasp = self._choose_grasps()
        return SelectedPoints(
            self._choose_functional(), grasp, spare=self.spare_grasps([point.candidate for point in grasp])
        )

    def spare_grasps(self, taken: list[int]) -> tuple[GraspPoint, ...]:
        """Return the next best grasp points without the candidates ``taken``: unused places first, then second choices."""
        weights, taken = self._visibility_weights() * self._opening_weights() * self._lever_weights(), list(taken)
        found: list[GraspPoint] = []
        for part in (*self.prior.grasp, *_generic_grasps()):
            choice = self._best_candidate(part.feature, weights, taken, 0.15 * self.shape.size_m)
            if choice is not None and len(found) < MOST_SPARES:
                taken.append(choice.candidate)
                found.append(self._grasp_point(len(taken) - 1, part, choice))
        return tuple(found)

    def _visibility_weights(self) -> np.ndarray:
        seen = np.zeros(len(self.request.positions_m), dtype=bool)
        for view in self.request.visible:
            seen[list(view)] = True
        return np.where(seen, 1.0, _UNSEEN) if seen.any() else np.ones(len(seen))

    @cached_property
    def _parts(self) -> Membership | None:
        """Part membership of surface samples followed by the candidates, if the shape determines parts."""
        if self.prior.parts is None:
            return None
        places = np.concatenate([self.shape.surface_m, self.request.positions_m])
        return membership(self.prior.parts, self.shape, places)

    def _on_own_part(self, feature: Feature) -> np.ndarray:
        """Weight candidates by whether they lie on the part that the feature's label names."""
        label = next((part.label for part in self.prior.functional if part.feature == feature), None)
        if label is None or self._parts is None:
            return np.ones(len(self.request.positions_m))
        roles, count = self._parts.roles, len(self.request.positions_m)
        shown = [roles[i] for i in np.unique(self._parts.index[:-count])]
        named = [roles.index(role) for role in shown if part_name(role, self.prior, (), shown) == label]
        return np.where(np.isin(self._parts.index[-count:], named) | (not named), 1.0, _ELSEWHERE)

    def _best_candidate(
        self, feature: Feature, weights: np.ndarray, taken: list[int], spread_m: float, *, through: bool = True
    ) -> _Choice | None:
        """Return the best candidate for a feature, away from those ``taken``, also across thin walls if ``through``."""
        scores = feature_scores(feature, self.shape, self.points)
        if scores is None:
            return None
        ranked = scores * weights * self._on_own_part(feature)
        if taken:
            ranked[taken] = -1.0
            apart = np.linalg.norm(self.request.positions_m[:, None] - self.request.positions_m[taken], axis=2)
            behind = self.request.normals @ self.request.normals[taken].T < _BEHIND
            near = np.where(behind & (not through), np.inf, apart).min(1)
            ranked = np.where(near < spread_m, _TAKEN * ranked, ranked)
        index = int(ranked.argmax())
        return _Choice(index, float(scores[index])) if scores[index] >= _WEAK and ranked[index] > 0 else None

    def _choose_functional(self) -> tuple[FunctionalPoint, ...]:
        """Choose functional points: at the prior's parts first, then at generic features, then near the centre of mass."""
        generic = tuple(
            FunctionalPart(label=_PLACES[f], description=f"{_PLACES[f]} of {self._thing}", feature=f)
            for f in _GENERIC_FUNCTIONAL
        )
        found: list[FunctionalPoint] = []
        taken: list[int] = []
        for part in (*self.prior.functional, *generic):
            least = LEAST if part in generic else MOST_FUNCTIONAL
            if len(found) >= least:
                continue
            choice = self._best_candidate(
                part.feature, self._visibility_weights(), taken, 0.05 * self.shape.size_m, through=False
            )
            if choice is not None:
                taken.append(choice.candidate)
                found.append(self._functional_point(len(found), part, choice))
        for index in self._unused_candidates(taken, LEAST - len(found)):
            part = FunctionalPart(label="surface", description=f"a place on {self._thing}", feature="center")
            found.append(self._functional_point(len(found), part, _Choice(index, _WEAK)))
        return tuple(found)

    def _choose_grasps(self) -> tuple[GraspPoint, ...]:
        """Choose grasp points: at the prior's parts first, then at generic features, on opposite sides, near the centre."""
        generic = _generic_grasps()
        weights = self._visibility_weights() * self._opening_weights() * self._lever_weights()
        found: list[GraspPoint] = []
        taken: list[int] = []
        sides: list[tuple[GraspPart, int]] = []
        for part in (*self.prior.grasp, *generic):
            if len(found) >= (LEAST if part in generic else MOST_GRASPS):
                continue
            choice = self._best_candidate(part.feature, weights, taken, 0.15 * self.shape.size_m)
            if choice is not None:
                taken.append(choice.candidate)
                found.append(self._grasp_point(len(found), part, choice))
                sides += [(part, choice.candidate)] if part.feature == "side" else []
        for part, index in sides[: MOST_GRASPS - len(found)]:
            other = self._best_candidate("side", weights * self._opposed_weights(index), taken, 0.0)
            if other is not None:  # the approach may have to come from the other side
                taken.append(other.candidate)
                part = part.model_copy(update={"scenario": f"{part.scenario}, from the other side"})
                found.append(self._grasp_point(len(found), part, other))
        for index in self._unused_candidates(taken, LEAST - len(found)):
            part = GraspPart(type="parallel_jaw", scenario="pick up near the centre of mass", feature="center")
            found.append(self._grasp_point(len(found), part, _Choice(index, _WEAK)))
        return tuple(found)

    def _opening_weights(self) -> np.ndarray:
        """Weight candidates by whether the gripper opens wide enough for the thickness behind them."""
        room = self.request.max_opening_m - _FINGER_CLEARANCE_M
        return np.where(self.points.thickness_m <= room, 1.0, 0.2 * room / np.maximum(self.points.thickness_m, room))

    def _opposed_weights(self, index: int) -> np.ndarray:
        """Weight candidates by how much they face the opposite way, from 1 down to 0 at right angles."""
        return np.clip(-self.request.normals @ self.request.normals[index], 0.0, 1.0)

    def _lever_weights(self) -> np.ndarray:
        return 0.4 + 0.6 / (1 + (self.lever_m / _LEVER_M) ** 2)

    def _unused_candidates(self, taken: list[int], count: int) -> list[int]:
        """Return the unused candidates nearest to the centre of mass."""
        return [int(i) for i in np.argsort(self.lever_m, kind="stable") if int(i) not in taken][: max(count, 0)]

    def _functional_point(self, number: int, part: FunctionalPart, choice: _Choice) -> FunctionalPoint:
        i = choice.candidate
        return FunctionalPoint(
            id=f"f{number}",
            **self.request.place(i),
            label=part.label,
            description=part.description,
            confidence=self._confidence(choice.score),
            rationale=self._rationale(part.feature, i),
        )

    def _grasp_point(self, number: int, part: GraspPart, choice: _Choice) -> GraspPoint:
        i = choice.candidate
        return GraspPoint(
            id=f"g{number}",
            **self.request.place(i),
            type=self._type(part, i),
            scenario=part.scenario,
            confidence=self._confidence(choice.score * float(self._opening_weights()[i])),
            rationale=self._rationale(part.feature, i) + self._width_remark(i),
        )

    def _type(self, part: GraspPart, i: int) -> GraspType:
        """Return the grasp type: a pinch of a part too thick for fingertips becomes a parallel-jaw grasp."""
        thick = self.points.thickness_m[i] > _PINCH_M
        return "parallel_jaw" if part.type == "pinch" and thick else part.type

    def _confidence(self, score: float) -> float:
        """Return a confidence: at most 0.9 for a rule, and 0.5 for an unnamed object."""
        return round((0.3 + 0.6 * score) * (1.0 if self.named else 0.55), 3)

    def _rationale(self, feature: Feature, i: int) -> str:
        lever_mm = 1000 * self.lever_m[i]
        return f"{_PLACES[feature]}{self._measurement_phrase(feature, i)}, {lever_mm:.0f} mm from the centre of mass"

    def _measurement_phrase(self, feature: Feature, i: int) -> str:
        """Return the measurement that supports a choice, as part of its rationale."""
        shape, height = self.shape, 1000 * self.request.positions_m[i, 2]
        if feature in ("opening", "rim", "inside") and shape.opening is not None:
            opening = shape.opening
            return f" of an opening {2000 * opening.rim_radius_m:.0f} mm wide and {1000 * opening.depth_m:.0f} mm deep"
        if feature in ("handle", "handle_end") and shape.side_handle is not None:
            reach, radius = 1000 * shape.side_handle.reach_m, 1000 * shape.body.radius_m.max()
            return f" standing out {reach:.0f} mm from a body of {radius:.0f} mm radius"
        if feature in ("handle", "handle_end", "head", "face", "tip", "edge", "middle", "end"):
            along = 100 * float(shape.axis.along(self.request.positions_m[i : i + 1])[0])
            return f" at {along:.0f} % of a length of {1000 * shape.axis.length_m:.0f} mm"
        return f" at a height of {height:.0f} mm"

    def _width_remark(self, i: int) -> str:
        thickness, opening = 1000 * self.points.thickness_m[i], 1000 * self.request.max_opening_m
        verb = "fits" if thickness <= opening - 1000 * _FINGER_CLEARANCE_M else "does not fit"
        return f"; {thickness:.0f} mm of matter behind it, which {verb} an opening of {opening:.0f} mm"


_PLACES: dict[str, str] = {
    "opening": "rim",
    "rim": "rim",
    "inside": "inside",
    "handle": "handle",
    "handle_end": "end of the handle",
    "head": "working end",
    "face": "outermost point of the head",
    "tip": "tip",
    "edge": "thin edge",
    "middle": "balance point",
    "neck": "narrowest part",
    "spout": "pouring side",
    "top": "upper side",
    "base": "underside",
    "side": "side",
    "center": "surface nearest the centre of mass",
    "front": "largest face",
    "back": "face opposite the largest",
    "end": "outermost end",
    "ring": "inner side of the ring",
    "mouth": "mouth",
    "bristles": "side of the head that stands out from the handle",
    "muzzle": "working end, away from the grip",
    "grip": "grip",
    "housing": "barrel behind the working end",
    "apex": "highest place of the arch",
    "arch_end": "end of the arch",
    "end_wall": "side near the end",
    "toe": "end away from the opening",
    "stem": "stem",
    "nozzle": "outermost side of the top",
    "crest": "outermost place across the length",
    "teeth": "side with the teeth",
    "spine": "side away from the teeth",
    "case": "thickest part",
    "strap": "thin part away from the thickest",
    "lens": "what stands out from the body",
    "bow": "outermost end in the way in which it travels",
    "beam": "outermost place to a side of the way in which it travels",
}


def _generic_grasps() -> tuple[GraspPart, ...]:
    return tuple(GraspPart(type="parallel_jaw", scenario=f"pick up by {_PLACES[f]}", feature=f) for f in _GENERIC_GRASP)


def spare_grasp_points(request: PointsRequest, taken: list[int]) -> tuple[GraspPoint, ...]:
    """Return grasp points from geometry alone, best first, at none of the candidates ``taken``."""
    return PointSelection(request, None).spare_grasps(taken)


def select_points(request: PointsRequest, prior: Prior | None) -> SelectedPoints:
    """Choose 2-4 functional and 2-3 grasp points; ``prior`` is None for an unnamed object."""
    return PointSelection(request, prior).select()
