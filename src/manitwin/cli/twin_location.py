"""Look for one twin, or for those of a data set, in a view, and lay out what was found: what ``manitwin locate`` does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.episodes.located_view import LocatedView
from manitwin.models.pose_estimators.protocol import PoseEstimator
from manitwin.scenes.locate.depth_view import DepthView
from manitwin.scenes.locate.external_estimator import ExternalEstimator
from manitwin.scenes.locate.layout_files import NoLayout
from manitwin.scenes.locate.located_scene import LocatedScene
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.recognition import DatasetTwins, ViewedObject, find_twin_in_masks, recognize_twin
from manitwin.scenes.locate.size_fit import OTHER_SIZE, SizeFit, locate_at_any_size
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import Twin


@dataclass(frozen=True)
class LocatedTwins:
    """The things that were found and the twin of each; ``size`` where it was asked for; ``estimator``: what guessed the poses."""

    things: list[ViewedObject]
    twins: list[Twin]
    size: SizeFit | None = None
    estimator: str | None = None

    @property
    def has_true_size(self) -> bool:
        """Whether what is known of the twins holds for the things: their size is the twins' own."""
        return self.size is None or self.size.is_nominal


def find_twin(
    twin: Twin, view: DepthView, masks: Sequence[np.ndarray], estimator: PoseEstimator | None, seed: int
) -> LocatedTwins:
    """Look for one twin in what the masks show; raises UsageError where there is no mask."""
    asked = None if estimator is None else ExternalEstimator(estimator, lambda twin_id: twin, seed)
    thing = find_twin_in_masks(view, masks, PoseModel.of_twin(twin), seed=seed, guess=asked)
    return LocatedTwins([thing], [twin], estimator=None if asked is None else asked.model)


def find_twin_of_any_size(twin: Twin, view: DepthView, masks: Sequence[np.ndarray], seed: int) -> LocatedTwins:
    """Look for one twin whose size was a guess; raises UsageError where there is no mask."""
    thing, size = locate_at_any_size(view, masks, PoseModel.of_twin(twin), seed=seed)
    return LocatedTwins([thing], [twin], size)


def find_twins(
    dataset: DatasetRoot,
    view: DepthView,
    masks: Sequence[np.ndarray],
    estimator: PoseEstimator | None,
    *,
    tried: int,
    seed: int,
    on_twin: Callable[[str], None],
) -> LocatedTwins:
    """Find which twin of a data set each mask shows; ``tried`` of the most alike are, and ``on_twin`` hears what takes time."""
    known = DatasetTwins(dataset, on_twin=on_twin)
    asked = None if estimator is None else ExternalEstimator(estimator, known.twin, seed)
    things = [recognize_twin(view, each, known, tried=tried, seed=seed, guess=asked) for each in masks]
    twins = [known.twin(thing.location.twin_id) for thing in things]
    return LocatedTwins(things, twins, estimator=None if asked is None else asked.model)


def located_scene_or_reason(
    place: LocatedView, found: LocatedTwins, dataset: str | None, *, of_cloud: bool
) -> LocatedScene | NoLayout:
    """Return what was found as a scene of twins of a data set, or why there is none."""
    if of_cloud:
        return NoLayout("a point cloud of the object alone shows no table")
    if not found.has_true_size:
        return NoLayout(OTHER_SIZE)
    if dataset is None:
        return NoLayout("the twin is not in a data set; give a twin in the data set that manitwin build wrote")
    return place.scene
