"""Score search by picture: crops of rendered scenes against the data set from which the scenes were sampled.

    python benchmarks/search.py DATASET SCENES... [--least-visible SHARE] [--grid]

Each object of each picture of the scenes (``manitwin layout DATASET --pictures``) is a query if at least ``--least-visible`` of
it and 150 pixels are visible. Lights, grounds and viewpoints differ from those of the embedded views. ``mask``: the crop is
transparent outside the object, as from a segmentation. ``box``: the rectangle around the object with a margin of a twelfth of its
longer side, whose background must be recognised.

``--grid`` also scores other weights of colour. Weights may be set with it on the tuning data set only.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from manitwin.dataset.index.query import Index
from manitwin.dataset.search.appearance_vectors import load_appearance_vectors
from manitwin.dataset.search.search import BEST_VIEWS, view_similarity
from manitwin.models.embedders.appearance import COLOR_WEIGHT, NETWORK, appearance_descriptor
from manitwin.models.embedders.foreground import foreground
from manitwin.scenes.perception.scene_truth import read_scene_truth
from manitwin.twin.dataset_root import DatasetRoot

LEAST_PX, AROUND = 150, 1 / 12
OCCLUDED = 0.9


def crops(scenes: Path, least_visible: float) -> Iterator[tuple[str, float, np.ndarray, np.ndarray]]:
    """Yield twin id, visible share, the crop with the mask as alpha, and the crop of the box."""
    for file in sorted(scenes.glob("scenes/*/*/scene.json")):
        truth = read_scene_truth(file)
        twins = {thing.name: thing.twin_id for thing in truth.record.objects}
        for picture in truth.pictures:
            for name, view in picture.views.items():
                if name not in twins or view.visible_box is None or view.visible_share < least_visible:
                    continue
                mask = picture.ids == truth.ids[name]
                if mask.sum() < LEAST_PX:
                    continue
                x, y, width, height = view.visible_box
                pad = max(4, round(AROUND * max(width, height)))
                at = np.s_[max(0, y - pad) : y + height + pad, max(0, x - pad) : x + width + pad]
                alpha = np.where(mask, 255, 0).astype(np.uint8)[..., None]
                yield twins[name], view.visible_share, np.concatenate([picture.rgb, alpha], -1)[at], picture.rgb[at]


def reweighted(looks: np.ndarray, weight: float) -> np.ndarray:
    """Return descriptors in which colours have the given weight instead of the default one."""
    factors = np.ones(looks.shape[-1], np.float32)
    factors[NETWORK:] = np.sqrt(weight / COLOR_WEIGHT)
    return np.asarray(looks * factors)


def report(name: str, ranks: np.ndarray, visible: np.ndarray) -> None:
    """Print how many are ranked first and among the first five, for all queries and for partly occluded ones."""
    hidden = visible < OCCLUDED
    line = f"{name:24} {len(ranks):4} first {np.mean(ranks == 0):6.1%} five {np.mean(ranks < 5):6.1%}"
    if hidden.any():
        line += f"   partly hidden {hidden.sum():4} first {np.mean(ranks[hidden] == 0):6.1%}"
    print(line, flush=True)


def main() -> None:
    """Score crops of scenes against the data set."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("scenes", type=Path, nargs="*")
    parser.add_argument("--least-visible", type=float, default=0.4)
    parser.add_argument("--grid", action="store_true")
    given = parser.parse_args()
    root = DatasetRoot(given.dataset)
    rows = Index(root).select("twins", columns=["twin_id", "revision"]).to_pylist()
    before = time.process_time()
    looks = dict(load_appearance_vectors(root, {row["twin_id"]: row["revision"] for row in rows}))
    ids = list(looks)
    print(
        f"{len(ids)} twins: {(time.process_time() - before) / len(ids):.2f} CPU-s a twin for looks that were not kept"
    )
    for scenes in given.scenes:
        asked = list(crops(scenes, given.least_visible))
        places = np.array([ids.index(twin_id) for twin_id, *_ in asked])
        visible = np.array([share for _, share, *_ in asked])
        for kind, pictures in (("mask", [each[2] for each in asked]), ("box", [each[3] for each in asked])):
            before = time.process_time()
            found = np.array([appearance_descriptor(*foreground(pixels)[:2]) for pixels in pictures])
            spent = (time.process_time() - before) / len(pictures)
            for weight in (COLOR_WEIGHT, *((0.0, 0.1, 0.2, 0.5, 1.0) if given.grid else ())):
                moved = {twin_id: reweighted(looks[twin_id], weight) for twin_id in ids}
                scores = np.array(
                    [[view_similarity(look, moved[twin_id]) for twin_id in ids] for look in reweighted(found, weight)]
                )
                ranks = (scores > scores[np.arange(len(places)), places][:, None]).sum(1)
                report(f"{scenes.name} {kind} {weight:g}", ranks, visible)
            print(f"    {spent:.3f} CPU-s a picture, the best {BEST_VIEWS} views")


if __name__ == "__main__":
    main()
