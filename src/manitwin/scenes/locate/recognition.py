"""Recognition of twins in a view: appearance ranks candidates, and the pose score decides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.dataset.index.query import Index
from manitwin.dataset.search.appearance_vectors import load_appearance_vectors
from manitwin.dataset.search.search import view_similarity
from manitwin.errors import UsageError
from manitwin.models.embedders.appearance import appearance_descriptor
from manitwin.scenes.locate.depth_view import DepthView
from manitwin.scenes.locate.estimate import Guess, Location, locate_in_view
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import Twin

NO_MASK = "no object stands above the table in this picture; give --mask"
CANDIDATES = 5
"""Number of candidate twins for an object, most similar first; the first alone is often wrong (docs/search.md)."""


@dataclass(frozen=True)
class CandidateTwin:
    """A twin that was tried for an object: its similarity in appearance (None: not computed), and the score of its best pose."""

    twin_id: str
    likeness: float | None
    score: float


@dataclass(frozen=True)
class ViewedObject:
    """An object in a view: its mask ``(H, W) bool``, the decision, and every twin that was tried, best first."""

    mask: np.ndarray
    location: Location
    model: PoseModel
    tried: tuple[CandidateTwin, ...]


class DatasetTwins:
    """The accepted twins of a data set with an index: models, prepared once each, and appearances."""

    def __init__(self, root: DatasetRoot, on_twin: Callable[[str], None] = lambda twin_id: None):
        """Read cached appearances and render the others; raises UsageError without an index, and for a data set at a URL."""
        rows = Index(root).select("twins", columns=["twin_id", "revision"]).to_pylist()
        self._root = root
        self._looks = dict(load_appearance_vectors(root, {row["twin_id"]: row["revision"] for row in rows}, on_twin))
        self._models: dict[str, PoseModel] = {}
        if not self._looks:
            raise UsageError(f"{root.url}: has no accepted twin; build twins, or give another data set")

    def twin(self, twin_id: str) -> Twin:
        """Return one of the twins."""
        assert self._root.local is not None
        return Twin(self._root.local / self._root.twin_name(twin_id))

    def model(self, twin_id: str) -> PoseModel:
        """Return the prepared model of a twin."""
        if twin_id not in self._models:
            self._models[twin_id] = PoseModel.of_twin(self.twin(twin_id))
        return self._models[twin_id]

    def ranked(self, rgb: np.ndarray, mask: np.ndarray) -> list[tuple[str, float]]:
        """Return the twins with their similarity to what ``mask`` shows, most similar first."""
        rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
        cut = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        look = appearance_descriptor(rgb[cut], mask[cut])
        found = [(twin_id, view_similarity(look, views)) for twin_id, views in self._looks.items()]
        return sorted(found, key=lambda each: (-each[1], each[0]))


def recognize_twin(
    view: DepthView,
    mask: np.ndarray,
    twins: DatasetTwins,
    *,
    tried: int = CANDIDATES,
    seed: int = 0,
    guess: Guess | None = None,
) -> ViewedObject:
    """Locate the twins most similar to an object, and return the one that explains it best, or a rejection.

    Raises UsageError for a view without colours.
    """
    if view.rgb is None:
        raise UsageError("finding the twin of an object needs its appearance; give --rgb")
    answers = []
    for twin_id, alike in twins.ranked(view.rgb, mask)[:tried]:
        location = locate_in_view(view, mask, twins.model(twin_id), seed=seed, guess=guess)
        answers.append((location, CandidateTwin(twin_id, alike, location.best_score)))
    answers.sort(key=lambda each: -each[0].best_score)
    best = answers[0][0]
    return ViewedObject(mask, best, twins.model(best.twin_id), tuple(each for _, each in answers))


def find_twin_in_masks(
    view: DepthView, masks: Sequence[np.ndarray], model: PoseModel, *, seed: int = 0, guess: Guess | None = None
) -> ViewedObject:
    """Locate a twin in each of several masks, and return the mask that it explains best, or a rejection."""
    if not masks:
        raise UsageError(NO_MASK)
    answers = [(locate_in_view(view, mask, model, seed=seed, guess=guess), mask) for mask in masks]
    best, mask = max(answers, key=lambda each: each[0].best_score)
    return ViewedObject(mask, best, model, (CandidateTwin(model.twin_id, None, best.best_score),))
