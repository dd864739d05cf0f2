"""Make photo_sheet.png beside this file: rendered photos of known objects, and the twins built from them.

    python benchmarks/photo_generation.py OUT --every 7 --seeds 5 --held-out
    python docs/make_photo_sheet.py OUT

One photo per category, the first that was accepted, beside the twin from the front and the side. The frame's colour shows the
volumetric overlap with the true shape (IoU), red below 0.6.
"""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from manitwin.formats.glb import read_glb
from manitwin.formats.image_file import read_image
from manitwin.render.cameras import framing_camera
from manitwin.render.renderer import BACKDROP, shared_renderer

PICTURE = Path(__file__).resolve().parent / "photo_sheet.png"
TILE_PX, COLUMNS, EDGE_PX = 104, 5, 3
COLORS = 128
POOR_IOU = 0.6
GOOD, POOR = (150, 190, 150), (214, 60, 50)
LIMIT_BYTES = 300_000
SEEN_FROM_DEG = ((-90.0, 25.0), (0.0, 25.0))  # azimuth and elevation; the front of templates is -Y


def shown(out: Path, row: dict[str, str]) -> np.ndarray:
    """Return a photo beside two views of its twin, with its name, framed by quality."""
    name = f"{json.loads(row['category']).replace(' ', '_')}-{row['seed']}-{float(row['elevation_deg']):.0f}"
    photo = read_image(out / f"{name}.png").pixels[..., :3]
    parts = read_glb(out / f"{name}.glb")
    points = np.concatenate([part.vertices for part in parts])
    center = points.mean(0)
    turned = (points - center)[:, [1, 0, 2]] * [-1, 1, 1] + center  # both views at one scale
    both = np.concatenate([points, turned])
    cameras = [
        framing_camera(both, azimuth_deg=a, elevation_deg=e, fov_y_deg=30, width_px=TILE_PX, height_px=TILE_PX)
        for a, e in SEEN_FROM_DEG
    ]
    side = min(photo.shape[:2])
    left = (photo.shape[1] - side) // 2
    square = cv2.resize(photo[:side, left : left + side], (TILE_PX, TILE_PX), interpolation=cv2.INTER_AREA)
    tile = np.hstack([square, *(frame.rgb for frame in shared_renderer().render(parts, cameras))])
    iou = json.loads(row["filled_iou"])
    label = np.full((18, tile.shape[1], 3), BACKDROP, np.uint8)
    said = f"{json.loads(row['category'])}  {float(row['elevation_deg']):.0f} deg  IoU {iou:.2f}"
    cv2.putText(label, said, (4, 13), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (40, 40, 40), 1, cv2.LINE_AA)
    color = POOR if iou < POOR_IOU else GOOD
    whole = np.vstack([label, tile])
    framed = np.empty((whole.shape[0] + 2 * EDGE_PX, whole.shape[1] + 2 * EDGE_PX, 3), np.uint8)
    framed[:] = color
    framed[EDGE_PX:-EDGE_PX, EDGE_PX:-EDGE_PX] = whole
    return framed


def main() -> None:
    """Draw the sheet and print the poor categories."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    out = parser.parse_args().out
    with (out / "results.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if json.loads(row["accepted"])]
    firsts = {row["category"]: row for row in reversed(rows)}
    tiles = [shown(out, row) for _, row in sorted(firsts.items())]
    tiles += [np.full_like(tiles[0], 255)] * (-len(tiles) % COLUMNS)
    lines = [np.hstack(tiles[k : k + COLUMNS]) for k in range(0, len(tiles), COLUMNS)]
    Image.fromarray(np.vstack(lines)).quantize(COLORS, dither=Image.Dither.NONE).save(PICTURE, optimize=True)
    poor = sorted(json.loads(k) for k, row in firsts.items() if json.loads(row["filled_iou"]) < POOR_IOU)
    print(f"{len(firsts)} things, poor by volume: {', '.join(poor) or 'none'}; {PICTURE.stat().st_size} bytes")
    if PICTURE.stat().st_size > LIMIT_BYTES:
        raise SystemExit(f"{PICTURE.name}: larger than {LIMIT_BYTES} bytes; draw fewer or smaller tiles")


if __name__ == "__main__":
    main()
