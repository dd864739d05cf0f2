"""Make locate.png beside this file: results of ``manitwin locate`` in rendered scenes with depth camera noise.

    manitwin layout DATASET -n 10 --clutter dense --objects 7..9 --pictures --seed 202 -o SCENES
    python docs/make_locate_picture.py DATASET SCENES

It shows the first object that is found although more than a third of it is hidden, the first ambiguous one, and the first that is
completely visible.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from manitwin.scenes.locate.depth_noise import DepthNoise
from manitwin.scenes.locate.depth_view import view_of_camera
from manitwin.scenes.locate.estimate import Location, locate_in_view
from manitwin.scenes.locate.overlay import overlay
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.perception.scene_truth import read_scene_truth
from manitwin.twin.loaded_twin import TwinSource

PICTURE = Path(__file__).resolve().parent / "locate.png"
WIDTH_PX, LEAST_PX = 640, 600


def answers(dataset: Path, scenes: Path) -> Iterator[tuple[float, Location, np.ndarray, str]]:
    """Yield for each object its visible share, the result, the overlay and the category."""
    source, rng = TwinSource(dataset), np.random.default_rng(0)
    for file in sorted(scenes.glob("scenes/*/*/scene.json")):
        truth = read_scene_truth(file)
        for picture in truth.pictures:
            view = view_of_camera(picture.camera, DepthNoise().simulate_depth(picture.depth_m, rng), picture.rgb)
            for thing in truth.record.objects:
                mask = picture.ids == truth.ids[thing.name]
                if mask.sum() < LEAST_PX:
                    continue
                model = PoseModel.of_twin(source.twin(thing.twin_id))
                found = locate_in_view(view, mask, model)
                shown = overlay(view, mask, model, found.poses, found.tolerance_m)
                yield picture.views[thing.name].visible_share, found, shown, thing.category


def main() -> None:
    """Make the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("scenes", type=Path)
    given = parser.parse_args()
    rows: dict[str, np.ndarray] = {}
    for share, found, shown, category in answers(given.dataset, given.scenes):
        kind = "half" if share < 0.66 else "whole" if share > 0.98 else ""
        kind = "ambiguous" if found.status == "ambiguous" else kind if found.status == "found" else ""
        if kind and kind not in rows:
            said = f"{category}: {found.status}, score {found.best_score:.2f}, {share:.0%} of it in sight"
            label = np.full((22, shown.shape[1], 3), 255, np.uint8)
            cv2.putText(label, said, (4, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (40, 40, 40), 1, cv2.LINE_AA)
            rows[kind] = np.vstack([label, shown])
        if len(rows) == 3:
            break
    sheet = np.vstack([rows[kind] for kind in ("whole", "half", "ambiguous") if kind in rows])
    size = (WIDTH_PX, round(sheet.shape[0] * WIDTH_PX / sheet.shape[1]))
    picture = Image.fromarray(cv2.resize(sheet, size, interpolation=cv2.INTER_AREA))
    picture.save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
