"""HTML report of an affordance data set: sample pictures of maps and parts, and counts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import numpy as np

from manitwin.dataset.affordances.baselines import baseline_part_accuracy
from manitwin.dataset.affordances.maps import SurfaceMaps
from manitwin.dataset.report_page import Picture, Section, Table, page
from manitwin.formats.image_file import png_of
from manitwin.render.cameras import framing_camera, project
from manitwin.twin.part_records import NO_PART

SIDE_PX, DOT_PX = 200, 3
MOST_MAPS = 3
PART_COLORS = ((68, 119, 170), (238, 102, 119), (34, 136, 51), (204, 187, 68), (102, 204, 238), (170, 51, 119))
"""Paul Tol's bright colour scheme, in the order of a twin's parts."""
NO_COLOR, GROUND = (170, 170, 170), (255, 255, 255)


def sample_picture(maps: SurfaceMaps) -> Picture:
    """Draw a twin's points by part, and by its first three maps from blue (0) to red (1), far points first."""
    parts = np.array([PART_COLORS[part % len(PART_COLORS)] if part != NO_PART else NO_COLOR for part in maps.parts])
    shown = list(maps.maps)[:MOST_MAPS]
    panels = [_draw_points(maps, parts), *(_draw_points(maps, _heat_colors(maps.maps[name])) for name in shown)]
    record = maps.twin.record
    category = record.language.category if record.language else "object"
    caption = f"{category}: {', '.join(['parts', *shown])}; {maps.held} of {maps.tried} grasps held"
    return Picture(png_of(np.concatenate(panels, axis=1)), caption)


def _heat_colors(values: np.ndarray) -> np.ndarray:
    levels = np.rint(255 * values).astype(np.uint8)[:, None]
    return np.asarray(cv2.applyColorMap(levels, cv2.COLORMAP_TURBO))[:, 0, ::-1]


def _draw_points(maps: SurfaceMaps, colors: np.ndarray) -> np.ndarray:
    camera = framing_camera(
        maps.points_m, azimuth_deg=-50.0, elevation_deg=30.0, fov_y_deg=30.0, width_px=SIDE_PX, height_px=SIDE_PX
    )
    pixels, depth = project(maps.points_m, camera)
    canvas = np.full((SIDE_PX, SIDE_PX, 3), GROUND, np.uint8)
    for place in np.argsort(-depth, kind="stable"):
        x, y = (round(float(value)) for value in pixels[place])
        cv2.circle(canvas, (x, y), DOT_PX, [int(value) for value in colors[place]], -1)
    return canvas


def _baseline_table(rows: Sequence[Mapping[str, Any]]) -> list[Table]:
    """Return the table of shape-blind baselines: medians by kind of map, and the accuracy for parts."""
    of_kind: dict[str, list[list[float | None]]] = {}
    for row in rows:
        for name, scores in row["blind"].items():
            of_kind.setdefault(name.partition(":")[0], []).append(scores)
    if not of_kind:
        return []
    halves: dict[str, list[list[float | None]]] = {}
    for row in rows:
        for name, scores in row["agreement"].items():
            halves.setdefault(name.partition(":")[0], []).append(scores)
    told = {kind: [_median(values) for values in zip(*scores, strict=True)] for kind, scores in halves.items()}
    heads = (
        "map",
        "SIM, one value everywhere",
        "SIM, nearer the middle",
        "AUC, nearer the middle",
        "SIM of halves",
        "AUC of halves",
    )
    lines = [
        (kind, *(_median(values) for values in zip(*scores, strict=True)), *told.get(kind, (None, None)))
        for kind, scores in sorted(of_kind.items())
    ]
    share, twins = baseline_part_accuracy(rows)
    remark = (
        f" Of parts, {share:.0%} of the points are right where all are of the largest part of the category's other twins"
        f" ({twins:,} twins)."
        if share is not None
        else ""
    )
    caption = (
        "Blind baseline, medians: maps that know no shape, which a model has to pass, beside how far two halves of the contacts"
        f" agree. One value everywhere has an AUC of one half.{remark}"
    )
    return [Table(caption, heads, lines)]


def _median(values: Sequence[float | None]) -> float | None:
    found = [value for value in values if value is not None]
    return round(float(np.median(found)), 3) if found else None


def affordances_page(
    rows: Sequence[Mapping[str, Any]], left_out: Mapping[str, str], samples: Sequence[Picture], with_parts: int
) -> bytes:
    """Return the HTML report of all written twins, and of those left out with the reason."""
    kinds = Counter(name.partition(":")[0] for row in rows for name in row["maps"])
    categories = Counter(row["category"] for row in rows)
    splits = Counter(row["split"] for row in rows)
    held, tried = sum(row["held"] for row in rows), sum(row["tried"] for row in rows)
    lead = [
        f"{len(rows):,} twins of {len(categories):,} categories, {with_parts:,} with parts; {held:,} of {tried:,} sampled"
        f" grasps held. Twins by split: {', '.join(f'{count:,} {name}' for name, count in sorted(splits.items()))}."
    ]
    tables = [
        Table("Maps by kind.", ("map", "maps"), sorted(kinds.items())),
        Table("Twins by category.", ("category", "twins"), sorted(categories.items())),
    ]
    tables += _baseline_table(rows)
    if left_out:
        tables.append(Table("Left out.", ("twin", "reason"), sorted(left_out.items())))
    return page("Affordances and parts", lead, [Section("Samples", samples), Section("Balance", tables)])
