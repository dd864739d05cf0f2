"""Measure how often ``manitwin evaluate generation`` finds a twin more similar to its own picture than to another's.

    python benchmarks/evaluation.py TWINS [--seed 0] [--most 100]

The truth is known, because each picture is rendered from the twin itself, from a direction that is none of the 30 views. The
figures are therefore an upper limit: a twin generated from a photo is less similar to its photo. For each twin one other picture
is drawn at random, as the command does, and all other pictures are counted in addition.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from manitwin.dataset.evaluation.input_likeness import draw_partners
from manitwin.dataset.evaluation.source_picture import Source, best_silhouette_iou, image_feature
from manitwin.dataset.evaluation.thirty_views import FOV_Y_DEG, thirty_views
from manitwin.models.embedders.appearance import GREY
from manitwin.render.cameras import framing_camera
from manitwin.render.renderer import shared_renderer
from manitwin.twin.loaded_twin import Twin, TwinSource
from manitwin.twin.proportions import wilson_interval

ELEVATIONS_DEG = (15.0, 60.0)
PICTURE_PX = 320


def picture_of(twin: Twin, rng: np.random.Generator) -> Source:
    """Render a twin from a random direction."""
    camera = framing_camera(
        np.concatenate([part.vertices for part in twin.visual]),
        azimuth_deg=float(rng.uniform(0, 360)),
        elevation_deg=float(rng.uniform(*ELEVATIONS_DEG)),
        fov_y_deg=FOV_Y_DEG,
        width_px=PICTURE_PX,
        height_px=PICTURE_PX,
    )
    frame = shared_renderer().render(twin.visual, [camera], background=(GREY,) * 3)[0]
    return Source("image", twin.record.twin_id, rgb=frame.rgb, mask=frame.coverage)


def main() -> None:
    """Print a row for each measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("twins", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--most", type=int, default=100)
    given = parser.parse_args()
    rng, source = np.random.default_rng(given.seed), TwinSource(given.twins)
    every = (source.twin(twin_id) for twin_id in source.twin_ids())
    twins = [twin for twin in every if twin.record.status == "accepted"][: given.most]
    pictures = [picture_of(twin, rng) for twin in twins]
    looks = np.array([image_feature(each.rgb, each.mask) for each in pictures])  # type: ignore[arg-type]
    others = draw_partners(pictures, rng)
    measures: dict[str, list[np.ndarray]] = {"cosine, mean": [], "cosine, best view": [], "silhouette IoU": []}
    for twin in twins:
        views = thirty_views(twin)
        cosines = np.array([image_feature(view.grey, view.coverage) for view in views]) @ looks.T
        measures["cosine, mean"].append(cosines.mean(0))
        measures["cosine, best view"].append(cosines.max(0))
        measures["silhouette IoU"].append(np.array([best_silhouette_iou(each.mask, views)[0] for each in pictures]))  # type: ignore[arg-type]
    for name, rows in measures.items():
        values = np.array(rows)
        own, n = np.diag(values), len(values)
        pairs = [(own[place], values[place, other]) for place, other in enumerate(others) if other is not None]
        higher = sum(bool(mine > theirs) for mine, theirs in pairs)
        low, high = wilson_interval(higher, len(pairs))
        everyone = (own[:, None] > values)[~np.eye(n, dtype=bool)].mean()
        print(
            f"{name:18} own {own.mean():.3f}, shuffled {np.mean([theirs for _, theirs in pairs]):.3f}; higher in {higher} of"
            f" {len(pairs)} [{low:.1%}, {high:.1%}], of all other pictures {everyone:.1%}"
        )


if __name__ == "__main__":
    main()
