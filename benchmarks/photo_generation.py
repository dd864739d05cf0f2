"""Build objects from photos of templates, whose shape is known, up to their true size, and print the accuracy.

    python benchmarks/photo_generation.py OUT [--categories mug,bowl] [--seeds 1] [--held-out] [--nameless] [--docs]

Photos are rendered (``template_photos``) at three camera elevations over plain and patterned grounds, and pass the stages of a
build from matting to true size in one process. OUT receives photos, meshes (GLB) and ``results.csv``. Seeds from 0 are for
tuning; ``--held-out`` uses those from 1200. ``--nameless`` gives no name. ``--truth-matte`` gives the true mask, to judge the
shape alone. ``shape_agreement`` defines how meshes are compared. ``--docs``, with the options that OUT was built with, builds
nothing and writes docs/photo_benchmark.md from it.
"""

from __future__ import annotations

import argparse
import csv
import json
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
import trimesh
from shape_agreement import agreement
from template_photos import ELEVATIONS_DEG, photograph

from manitwin.config import BuildConfig
from manitwin.engine.stage import Draft
from manitwin.engine.stage_runner import run_stage
from manitwin.errors import InputError, Rejected
from manitwin.geometry.boxes import oriented_bounding_box
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.pipeline.item import Item, twin_id
from manitwin.pipeline.object_state import load_solid, object_name
from manitwin.pipeline.recipe import stages_for

HELD_OUT_FROM = 1200  # lower seeds are used for tuning
LAST_STAGE = "physical"
OWN_STAGES = ("mesh", "views", "gate", "physical")  # stages after the shape, not counted in its CPU seconds
# Every third template of the list: 42 of 127, from all groups.
DEFAULT_EVERY = 3
POOR_IOU = 0.6
PAGE = Path(__file__).parent.parent / "docs" / "photo_benchmark.md"


@dataclass(frozen=True)
class Result:
    """Result for one photo. Shares and IoU are 0 to 1, or None where nothing was built."""

    category: str
    seed: int
    elevation_deg: float
    ground: str
    accepted: bool
    reason: str
    detail: str
    primitive: str
    named: str
    category_right: bool | None
    mask_iou: float | None
    iou: float | None
    filled_iou: float | None
    upright_filled_iou: float | None
    chamfer_share: float | None
    size_error: float | None
    cpu_s: float


class KnownPhoto(Protocol):
    """Interface of a photo with known truth, as ``TemplatePhoto`` has it."""

    @property
    def rgb(self) -> np.ndarray: ...
    @property
    def mask(self) -> np.ndarray: ...
    @property
    def truth(self) -> trimesh.Trimesh: ...
    @property
    def elevation_deg(self) -> float: ...
    @property
    def ground(self) -> str: ...


def build(photo: KnownPhoto, category: str, seed: int, path: Path, options: argparse.Namespace) -> Result:
    """Write the photo, run the stages and compare the result with the truth."""
    rgb = photo.rgb
    if options.truth_matte:
        rgb = np.dstack([rgb, np.where(photo.mask, 255, 0).astype(np.uint8)])
    cv2.imwrite(str(path), cv2.cvtColor(rgb, cv2.COLOR_RGBA2BGRA if rgb.shape[2] == 4 else cv2.COLOR_RGB2BGR))
    item = Item(str(path.resolve()), name=None if options.nameless else category)
    draft: Draft[Item] = Draft(twin_id(item), item, 0)
    cpu, answer = 0.0, ("", "")
    with tempfile.TemporaryDirectory() as work:
        try:
            for stage in stages_for("image", BuildConfig()):
                started = time.process_time()
                try:
                    run_stage(stage, draft, Path(work))
                finally:
                    cpu += 0.0 if stage.name in OWN_STAGES else time.process_time() - started
                if stage.name == LAST_STAGE:
                    break
        except (Rejected, InputError) as error:
            answer = error.reason, error.detail
        except Exception as error:  # a defect is counted, and the other photos continue
            answer = "crash", f"{type(error).__name__}: {error}"
        told = _told(draft, category)
        mask_iou = _mask_iou(draft, photo.mask)
        common = (category, seed, photo.elevation_deg, photo.ground)
        if answer[0]:
            return Result(*common, False, *answer, *told, mask_iou, *[None] * 5, round(cpu, 2))
        path.with_suffix(".glb").write_bytes(draft.path("visual.glb").read_bytes())
        solid = load_solid(draft.path("solid.npz"))
    found = agreement(solid, photo.truth)
    size_error = _longest(solid) / _longest(photo.truth) - 1
    figures = [found.iou, found.filled_iou, found.upright_filled_iou, found.chamfer_share, size_error]
    return Result(*common, True, "", "", *told, mask_iou, *(round(figure, 4) for figure in figures), round(cpu, 2))


def _told(draft: Draft[Item], category: str) -> tuple[str, str, bool | None]:
    generation = draft.fields.get("generation", {})
    name = object_name(draft)
    prior, truth = find_prior(name), find_prior(category)
    right = None if prior is None or truth is None else prior.category == truth.category
    return str(generation.get("notes", {}).get("primitive", "")), name or "", right


def _mask_iou(draft: Draft[Item], mask: np.ndarray) -> float | None:
    if "photo.png" not in draft.paths:
        return None
    alpha = cv2.imread(str(draft.path("photo.png")), cv2.IMREAD_UNCHANGED)[..., 3]
    found = cv2.resize(alpha, mask.shape[::-1], interpolation=cv2.INTER_AREA) > 127
    return round(float((found & mask).sum() / (found | mask).sum()), 4)


def _longest(mesh: trimesh.Trimesh) -> float:
    return float(oriented_bounding_box(np.asarray(mesh.vertices))[0].max())


def summary_rows(results: Sequence[Result], by: str) -> list[tuple[str, ...]]:
    """Return a row of figures for each value of a field, and for all."""
    values = list(dict.fromkeys(getattr(result, by) for result in results))
    groups = [(f"{value:g}" if isinstance(value, float) else str(value) or "none", value) for value in values]
    rows = [(name, *_figures([r for r in results if getattr(r, by) == value])) for name, value in groups]
    return [*rows, ("all", *_figures(results))]


HEADER = ("photos", "accepted", "IoU", "IoU solid", "upright", "chamfer %", "size %", "named right", "wrong", "CPU-s")


def _figures(results: Sequence[Result]) -> tuple[str, ...]:
    made = [r for r in results if r.accepted]
    named = [r for r in results if r.category_right is not None]
    return (
        str(len(results)),
        f"{len(made) / len(results):.0%}",
        _median(r.filled_iou for r in made),
        _median(r.iou for r in made),
        _median(r.upright_filled_iou for r in made),
        _median((100 * r.chamfer_share for r in made if r.chamfer_share is not None), 1),
        _median((100 * abs(r.size_error) for r in made if r.size_error is not None), 0),
        f"{sum(bool(r.category_right) for r in named) / len(results):.0%}",
        f"{sum(not r.category_right for r in named) / len(results):.0%}",
        _median((r.cpu_s for r in results), 1),
    )


def _median(values: Iterable[float | None], digits: int = 2) -> str:
    known = [value for value in values if value is not None]
    return f"{np.median(known):.{digits}f}" if known else "-"


def table(results: Sequence[Result], by: str) -> str:
    """Return the rows as a Markdown table with aligned columns."""
    rows = [(by.removesuffix("_deg").replace("_", " "), *HEADER), *summary_rows(results, by)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = ["| " + " | ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)) + " |" for row in rows]
    return "\n".join([lines[0], "|" + "|".join("-" * (w + 2) for w in widths) + "|", *lines[1:]])


def read_results(path: Path) -> list[Result]:
    """Read ``results.csv``."""
    with path.open(newline="") as file:
        return [Result(**{f.name: json.loads(row[f.name]) for f in fields(Result)}) for row in csv.DictReader(file)]


def write_results(results: Sequence[Result], path: Path) -> None:
    """Write ``results.csv``, each cell as JSON."""
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(Result)])
        writer.writeheader()
        writer.writerows({key: json.dumps(value) for key, value in asdict(result).items()} for result in results)


def page(results: Sequence[Result], command: str) -> str:
    """Return the documentation page of the figures."""
    reasons = summary_reasons(results)
    return PAGE_TEXT.format(
        command=command,
        elevation=table(results, "elevation_deg"),
        primitive=table(sorted(families(results), key=lambda r: r.primitive), "primitive"),
        category=table(sorted(results, key=lambda r: r.category), "category"),
        reasons="\n".join(f"- {count}: {reason}" for reason, count in reasons) or "- none",
        poor=", ".join(poor(results)) or "none",
    )


def poor(results: Sequence[Result]) -> list[str]:
    """Return the categories with an accepted photo whose shape is poor, by IoU."""
    return sorted({r.category for r in results if r.filled_iou is not None and r.filled_iou < POOR_IOU})


def families(results: Sequence[Result]) -> list[Result]:
    """Return the results with all templates merged into one generator."""
    return [replace(r, primitive=r.primitive.split(":")[0]) for r in results]


def summary_reasons(results: Sequence[Result]) -> list[tuple[str, int]]:
    """Return how often each reason of rejection occurred, most frequent first."""
    reasons = [f"`{r.reason}`" for r in results if not r.accepted]
    return sorted(((reason, reasons.count(reason)) for reason in set(reasons)), key=lambda pair: (-pair[1], pair[0]))


PAGE_TEXT = """# Photos whose truth is known

How well the built-in way from a photo to a shape does, without a learned generator: things of known shape (the
[templates](templates.md)) are rendered as photos, with light, shadows and noise on plain and patterned ground, at three
elevations of the camera, and built from the photo. The seeds are none that anything was tuned on.

- **IoU**: volumetric intersection over union with the true mesh, after rotation, translation and scale that agree best;
  hollows count as filled to the brim. **IoU solid**: the same of the walls alone, which are a few millimetres thin.
  **upright**: IoU with turns about the vertical only, so a thing that lies instead of standing loses.
- **chamfer**: mean distance between the surfaces, of the longest side. **size**: error of the longest side in metres; a photo has
  no scale, so it is that of the usual size of such things.
- **named right, wrong**: of all photos; the rest are `unknown`. **CPU-s**: matting, naming and shape together.
- Figures are medians over what was accepted. Identical meshes measure 0.90 to 0.99 (IoU) and 0.80 to 0.97 (IoU solid).

Written by {command}.

## What came out

![Made photos and what was built of each, from the front and the side](photo_sheet.png)

One photo a thing, the first that was accepted; `python docs/make_photo_sheet.py OUT` draws it. Red: less than 0.6 of the volume
is shared. Things with a photo that was accepted and came out that poor: {poor}.

## By the camera's elevation

{elevation}

## By how the shape was made

{primitive}

## Why photos were rejected

{reasons}

## By category

{category}
"""


def main() -> None:
    """Photograph, build, compare and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--categories", default="")
    parser.add_argument("--every", type=int, default=DEFAULT_EVERY, help="take every n-th template")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--nameless", action="store_true")
    parser.add_argument("--truth-matte", action="store_true")
    parser.add_argument("--docs", action="store_true", help="write docs/photo_benchmark.md from OUT, build nothing")
    options = parser.parse_args()
    if not options.docs:
        write_results(run(options), options.out / "results.csv")
    results = read_results(options.out / "results.csv")
    for by in ("category", "primitive", "elevation_deg"):
        print(table(families(results), by), end="\n\n")
    print(*(f"{count:4d} {reason}" for reason, count in summary_reasons(results)), sep="\n")
    if options.docs:
        kinds, things = len({r.category for r in results}), len({(r.category, r.seed) for r in results})
        of = f"{len(results)} photos of {things} things of {kinds} kinds"
        PAGE.write_text(page(results, f"`{command_of(options)}` and the same with `--docs` from {of}"))


def command_of(options: argparse.Namespace) -> str:
    """Return the command that builds with ``options`` into a folder OUT."""
    words = ["python benchmarks/photo_generation.py OUT"]
    if options.categories:
        words.append(f"--categories {options.categories}")
    elif options.every != DEFAULT_EVERY:
        words.append(f"--every {options.every}")
    words += [f"--seeds {options.seeds}"] * (options.seeds != 1) + ["--held-out"] * options.held_out
    return " ".join(words + ["--nameless"] * options.nameless + ["--truth-matte"] * options.truth_matte)


def run(options: argparse.Namespace) -> list[Result]:
    """Build all photos, and print a line for each."""
    options.out.mkdir(parents=True, exist_ok=True)
    names = options.categories.split(",") if options.categories else list(load_templates())[:: options.every]
    first = HELD_OUT_FROM if options.held_out else 0
    results: list[Result] = []
    for category in names:
        write_results(results, options.out / "results.csv")  # keeps the results if the run is interrupted
        for seed in range(first, first + options.seeds):
            for photo in photograph(category, seed, ELEVATIONS_DEG):
                name = f"{category.replace(' ', '_')}-{seed}-{photo.elevation_deg:.0f}.png"
                result = build(photo, category, seed, options.out / name, options)
                results.append(result)
                verdict = f"IoU {result.filled_iou:.2f}" if result.filled_iou is not None else result.reason
                print(
                    f"{name:36s} {result.primitive:22s} {verdict:24s} mask {result.mask_iou} {result.cpu_s} s",
                    flush=True,
                )
    return results


if __name__ == "__main__":
    main()
