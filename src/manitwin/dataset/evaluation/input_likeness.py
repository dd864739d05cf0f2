"""Similarity of each twin to its input, and to another twin's input as the control."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from manitwin.dataset.evaluation.source_picture import Source, best_silhouette_iou, image_feature, load_source
from manitwin.dataset.evaluation.thirty_views import View, thirty_views
from manitwin.geometry.sampling import sample_surface
from manitwin.models.embedders.clip import ClipFolder
from manitwin.models.embedders.clip_endpoint import ClipEndpoint
from manitwin.render.raycast import merge_parts
from manitwin.twin.loaded_twin import Twin

ULIP, CLIP_NORMALS, CLIP_COLORS = "ULIP", "CLIP(N-I/T)", "CLIP(I-I/T)"
LOOK_MEAN, LOOK_BEST, OUTLINE = "EfficientNet-Lite0 cosine", "EfficientNet-Lite0 cosine, best view", "silhouette IoU"
METRICS = (ULIP, CLIP_NORMALS, CLIP_COLORS, LOOK_MEAN, LOOK_BEST, OUTLINE)
OF_PICTURES = (LOOK_MEAN, LOOK_BEST, OUTLINE)
"""Metrics that exist for images only."""


@dataclass(frozen=True)
class Models:
    """The user's similarity models; without a model its metrics are not measured."""

    clip: ClipFolder | ClipEndpoint | None = None
    ulip: ClipFolder | None = None

    def describe_models(self) -> dict[str, dict[str, Any] | None]:
        """Return the name and file sha256 of each model (no sha256 for a server); None if it was not given."""
        given: dict[str, ClipFolder | ClipEndpoint | None] = {"clip": self.clip, "ulip": self.ulip}
        return {
            name: None if each is None else {"name": each.name, "sha256": each.sha256} for name, each in given.items()
        }


@dataclass(frozen=True)
class Likeness:
    """Similarity of a twin, by metric, to its own input and to that of the twin ``shuffled_with``.

    ``picture`` shows side by side the input, the view with the most similar silhouette, and its normals.
    """

    twin_id: str
    name: str
    category: str
    source: Source
    own: dict[str, float] = field(default_factory=dict)
    shuffled: dict[str, float] = field(default_factory=dict)
    shuffled_with: str | None = None
    picture: np.ndarray | None = None


def likeness_of_twins(
    twins: Iterable[Twin], models: Models, *, seed: int = 0, on_twin: Callable[[str], None] = lambda twin_id: None
) -> list[Likeness]:
    """Return the similarity of each twin made from an image or a text to its input.

    The control input is that of a random twin of the same kind whose input has other bytes; None if there is none. ``on_twin`` is
    called for each compared twin. Raises Unavailable without the EfficientNet weights, and RendererMissing without a renderer.
    """
    made = [(twin, source) for twin in twins if (source := load_source(twin)) is not None]
    inputs = [_Input.of(source, models) for _, source in made]
    others = draw_partners([source for _, source in made], np.random.default_rng(seed))
    found = []
    for place, (twin, source) in enumerate(made):
        other = None if (o := others[place]) is None else (made[o][0].record.twin_id, inputs[o])
        found.append(_likeness(twin, source, inputs[place], other, models))
        if found[-1].own:  # a text without a model is not compared
            on_twin(twin.record.twin_id)
    return found


def draw_partners(sources: Sequence[Source], rng: np.random.Generator) -> list[int | None]:
    """Return, for each source, the index of another source of the same kind, chosen about equally often; None if all
    are equal.
    """
    chosen: list[int | None] = [None] * len(sources)
    for kind in ("image", "text"):
        order = rng.permutation(
            [place for place, each in enumerate(sources) if each.kind == kind and not each.left_out]
        )
        for rank, place in enumerate(order):
            following = (int(order[(rank + step) % len(order)]) for step in range(1, len(order)))
            chosen[int(place)] = next((o for o in following if _has_other_input(sources[o], sources[int(place)])), None)
    return chosen


def _has_other_input(one: Source, other: Source) -> bool:
    return one.text != other.text if one.kind == "text" else one.sha256 != other.sha256


@dataclass(frozen=True)
class _Input:
    """Feature vectors of an input: of EfficientNet, and of the user's models."""

    source: Source
    look: np.ndarray | None
    clip: np.ndarray | None
    ulip: np.ndarray | None

    @classmethod
    def of(cls, source: Source, models: Models) -> _Input:
        if source.left_out:
            return cls(source, None, None, None)
        vectors = [None if model is None else _embed_source(model, source) for model in (models.clip, models.ulip)]
        if source.rgb is None or source.mask is None:
            return cls(source, None, *vectors)
        return cls(source, image_feature(source.rgb, source.mask), *vectors)


def _embed_source(model: ClipFolder | ClipEndpoint, source: Source) -> np.ndarray:
    found = model.texts([source.text]) if source.kind == "text" else model.pictures([source.on_white])
    return np.asarray(found[0])


def _likeness(twin: Twin, source: Source, own: _Input, other: tuple[str, _Input] | None, models: Models) -> Likeness:
    language = twin.record.language
    said = (twin.record.twin_id, twin.record.name or "", language.category if language else "", source)
    if source.left_out or (source.kind == "text" and models.clip is None and models.ulip is None):
        return Likeness(*said)
    drawn = source.kind == "image" or models.clip is not None
    views = thirty_views(twin) if drawn else []
    looks = np.array([image_feature(view.grey, view.coverage) for view in views]) if source.kind == "image" else None
    vectors = {}
    if models.clip is not None:
        vectors[CLIP_NORMALS] = models.clip.pictures([view.normals for view in views])
        vectors[CLIP_COLORS] = models.clip.pictures([view.rgb for view in views])
    if models.ulip is not None:
        points, _, _ = sample_surface(merge_parts(twin.visual), models.ulip.point_count, np.random.default_rng(0))
        vectors[ULIP] = models.ulip.points(points)[None]
    values, best = _similarities(own, views, looks, vectors)
    shuffled = _similarities(other[1], views, looks, vectors)[0] if other is not None else {}
    picture = _picture(source, views[best]) if source.kind == "image" else None
    return Likeness(*said, values, shuffled, None if other is None else other[0], picture)


def _similarities(
    given: _Input, views: Sequence[View], looks: np.ndarray | None, vectors: dict[str, np.ndarray]
) -> tuple[dict[str, float], int]:
    """Return the similarity of views to an input by metric, and the index of the view with the most similar silhouette."""
    values = {}
    for name, of_twin in vectors.items():
        of_input = given.ulip if name == ULIP else given.clip
        assert of_input is not None
        values[name] = float((of_twin @ of_input).mean())
    best = 0
    if looks is not None and given.look is not None and given.source.mask is not None:
        cosines = looks @ given.look
        values |= {LOOK_MEAN: float(cosines.mean()), LOOK_BEST: float(cosines.max())}
        values[OUTLINE], best = best_silhouette_iou(given.source.mask, views)
    return values, best


def _picture(source: Source, view: View) -> np.ndarray:
    return np.concatenate([source.on_white, view.rgb, view.normals], axis=1)
