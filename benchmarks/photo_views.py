"""Build objects from one photo and from several of the same object with known shape, and print the gain of further photos.

    python benchmarks/photo_views.py OUT [--categories mug,box] [--views 1,2,3,4] [--seeds 1] [--elevation 10] [--held-out]

Each object is photographed (``template_photos``) every 360 / N degrees about the vertical for N > 2 views, and at a right angle
for 2. Each set passes the stages of a build from matting to true size, once with stated turns and once without. ``--nameless``
gives no name and uses no classifier, so that no template is fitted and the shape is the visual hull of the silhouettes.
``--truth-matte`` gives the true masks. OUT receives photos, meshes (GLB) and ``results.csv``.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from photo_generation import DEFAULT_EVERY, HELD_OUT_FROM, LAST_STAGE
from shape_agreement import agreement
from template_photos import TemplatePhoto, photograph

from manitwin.config import BuildConfig
from manitwin.engine.stage import Draft
from manitwin.engine.stage_runner import run_stage
from manitwin.errors import Rejected
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.pipeline.item import Item, twin_id
from manitwin.pipeline.object_state import load_solid
from manitwin.pipeline.recipe import stages_for

RIGHT_DEG = 10.0


@dataclass(frozen=True)
class Result:
    """Result for a set of photos; shares and IoU are 0 to 1; ``turn_errors_deg`` are the errors of estimated turns."""

    category: str
    seed: int
    views: int
    turns: str
    accepted: bool
    detail: str
    primitive: str
    confidence: float
    iou: float
    upright_iou: float
    unseen_share: float
    turn_errors_deg: str
    told: int
    cpu_s: float


def turns_of(count: int) -> list[float]:
    """Return the turns (degrees) at which an object is photographed for ``count`` views."""
    return [0.0, 90.0][:count] if count < 3 else [number * 360.0 / count for number in range(count)]


def write_photo(photo: TemplatePhoto, path: Path, truth_matte: bool) -> None:
    """Write a photo, with its true mask as alpha if ``truth_matte`` is set."""
    rgb = np.dstack([photo.rgb, np.where(photo.mask, 255, 0).astype(np.uint8)]) if truth_matte else photo.rgb
    cv2.imwrite(str(path), cv2.cvtColor(rgb, cv2.COLOR_RGBA2BGRA if truth_matte else cv2.COLOR_RGB2BGR))


def build(
    category: str, seed: int, photos: Sequence[TemplatePhoto], paths: Sequence[Path], mode: str, named: bool
) -> Result:
    """Run the stages on a set of photos and compare the result with the truth."""
    turns = turns_of(len(paths))
    files = [str(path.resolve()) for path in paths]
    item = Item(
        files[0],
        name=category if named else None,
        views=tuple(files[1:]),
        turns_deg=tuple(turns) if mode == "stated" and len(files) > 1 else (),
    )
    config = BuildConfig()
    if not named:
        config = config.model_copy(update={"naming": config.naming.model_copy(update={"enabled": False})})
    draft: Draft[Item] = Draft(twin_id(item), item, 0)
    detail, cpu = "", 0.0
    with tempfile.TemporaryDirectory() as work:
        try:
            for stage in stages_for("photos" if item.views else "image", config):
                started = time.process_time()
                run_stage(stage, draft, Path(work))
                cpu += time.process_time() - started if stage.name in ("photo", "name", "generate") else 0.0
                if stage.name == LAST_STAGE:
                    break
        except Rejected as error:
            detail = f"{error.reason}: {error.detail}"
        generation = draft.fields.get("generation", {})
        notes = generation.get("notes", {})
        errors, told = _turn_errors(notes, turns) if mode == "estimated" else ([], 0)
        common = (category, seed, len(paths), mode, not detail, detail, str(notes.get("primitive", "")))
        more = (" ".join(f"{error:.0f}" for error in errors), told, round(cpu, 2))
        confidence = float(notes.get("confidence") or notes.get("silhouette_iou") or 0.0)
        if detail:
            return Result(*common, confidence, 0.0, 0.0, 1.0, *more)
        name = f"{paths[0].stem}_{len(paths)}_{mode}.glb"
        (paths[0].parent / name).write_bytes(draft.path("visual.glb").read_bytes())
        solid = load_solid(draft.path("solid.npz"))
    found = agreement(solid, photos[0].truth)
    shares = (round(each, 4) for each in (found.filled_iou, found.upright_filled_iou))
    return Result(*common, confidence, *shares, round(generation.get("unseen_share") or 0.0, 3), *more)


def _turn_errors(notes: dict[str, Any], truth: Sequence[float]) -> tuple[list[float], int]:
    """Return the errors (degrees) of the turns that the generator states, and their number."""
    said = [view["turn_deg"] for view in notes.get("views", [])]
    known = [(turn, true) for turn, true in zip(said, truth, strict=False) if turn is not None][1:]
    return [abs((turn - true + 180) % 360 - 180) for turn, true in known], len(known)


def summary(results: Sequence[Result]) -> list[str]:
    """Return a Markdown table by number of views and by whether the turns were stated."""
    lines = [
        "| views | turns | sets | accepted | IoU | upright | unseen % | turns told | within 10 deg | CPU-s |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for views, turns in dict.fromkeys((result.views, result.turns) for result in results):
        some = [each for each in results if (each.views, each.turns) == (views, turns)]
        made = [each for each in some if each.accepted]
        errors = [float(error) for each in made for error in each.turn_errors_deg.split()]
        right = f"{np.mean(np.array(errors) <= RIGHT_DEG):.0%}" if errors else "-"
        told = f"{sum(each.told for each in made)} of {len(made) * (views - 1)}" if turns == "estimated" else "-"
        middle = [
            f"{np.median([getattr(each, name) for each in made]):.2f}" if made else "-"
            for name in ("iou", "upright_iou")
        ]
        unseen = f"{100 * np.median([each.unseen_share for each in made]):.0f}" if made else "-"
        cells = [views, turns, len(some), f"{len(made) / len(some):.0%}", *middle, unseen, told, right]
        lines.append("| " + " | ".join(map(str, [*cells, f"{np.median([each.cpu_s for each in some]):.1f}"])) + " |")
    return lines


def main() -> None:
    """Photograph, build, compare and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--categories", default="")
    parser.add_argument("--every", type=int, default=DEFAULT_EVERY)
    parser.add_argument("--views", default="1,2,3,4")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--elevation", type=float, default=10.0)
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--nameless", action="store_true")
    parser.add_argument("--truth-matte", action="store_true")
    parser.add_argument("--stated-only", action="store_true")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    categories = options.categories.split(",") if options.categories else sorted(load_templates())[:: options.every]
    first = HELD_OUT_FROM if options.held_out else 0
    results: list[Result] = []
    for category in categories:
        for seed in range(first, first + options.seeds):
            results += _of_thing(category, seed, options)
            with (options.out / "results.csv").open("w", newline="") as file:
                writer = csv.DictWriter(file, [each.name for each in fields(Result)])
                writer.writeheader()
                writer.writerows(asdict(each) for each in results)
    print("\n".join(summary(results)))


def _of_thing(category: str, seed: int, options: argparse.Namespace) -> list[Result]:
    counts = [int(count) for count in options.views.split(",")]
    turns = sorted({turn for count in counts for turn in turns_of(count)})
    photos = dict(zip(turns, photograph(category, seed, [options.elevation], turns_deg=turns), strict=True))
    paths = {turn: options.out / f"{category.replace(' ', '_')}_{seed}_{turn:03.0f}.png" for turn in turns}
    for turn, path in paths.items():
        write_photo(photos[turn], path, options.truth_matte)
    results = []
    for count in counts:
        modes = ["alone"] if count == 1 else ["stated"] if options.stated_only else ["stated", "estimated"]
        for mode in modes:
            own = turns_of(count)
            result = build(
                category, seed, [photos[t] for t in own], [paths[t] for t in own], mode, not options.nameless
            )
            results.append(result)
            print(
                f"{category} {seed} {count} {mode}: {result.iou:.2f} {result.primitive} {result.detail[:160]}",
                flush=True,
            )
    return results


if __name__ == "__main__":
    main()
