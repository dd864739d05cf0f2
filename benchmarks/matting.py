"""Cut objects out of composites with known masks, and print the acceptance, its precision, and the cost.

    python benchmarks/matting.py [--part held-out|tuning|calibration] [--first 0] [--count 300] [--jobs 1] [--network isnet]
                                 [--variant plain|labelled|matched|small|shop|black] [--named] [--photos FOLDER] [--sheet PNG]

The pictures are generated here (``composites.py``) from templates on grounds that the project generates itself. The held-out part
has other seeds and other grounds than the part with which thresholds were set. A composite of one whole object is to be accepted;
one that the frame cuts off, or with several objects, is to be rejected. IoU is that of the matte (alpha above 0.5) with the true
mask. With ``--named`` the name is given, so that the silhouette of its template is used where a cut-out is doubtful. With
``--photos`` the photos of a folder are cut out as well, and ``--sheet`` draws those accepted.
"""

from __future__ import annotations

import argparse
import time
from collections import defaultdict
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
from composite_things import Part
from composite_variants import VARIANTS, Variant
from composites import Composite, composite
from scipy.stats import spearmanr

from manitwin.config import MattingConfig
from manitwin.errors import Rejected
from manitwin.formats.image_file import read_image
from manitwin.models.generators.templates.fitting.outline_check import template_outline_check
from manitwin.models.matting import matte_photo
from manitwin.models.matting.learned import Network, find_networks
from manitwin.models.matting.matte import MIN_CONFIDENCE, accept_candidate
from manitwin.models.matting.study import study_in_turn
from manitwin.models.matting.template_confirmation import prefer_explained
from manitwin.twin.proportions import wilson_interval

RIGHT_IOU = 0.95
TILE_PX = 460


@dataclass(frozen=True)
class Judged:
    """Result for one composite: kind, setting, confidence, true IoU, outcome and cost."""

    kind: str
    setting: str
    confidence: float
    iou: float
    accepted: bool
    cpu_s: float


def judged_by_number(part: Part, number: int, variant: Variant, network: str | None, named: bool) -> Judged:
    """Make one composite by its number and cut it out; can be called in any process."""
    cv2.setNumThreads(1)
    return judge(composite(part, number, variant), find_networks(network) if network else (), named)


def judge(picture: Composite, networks: Sequence[Network], named: bool) -> Judged:
    """Cut one composite out; rejected results are compared with the truth too."""
    start = time.process_time()
    study = study_in_turn(picture.rgb, networks, min_confidence=MIN_CONFIDENCE)
    explains = template_outline_check(picture.category) if named else None
    if explains is not None and study.confidence < MIN_CONFIDENCE:
        study = prefer_explained(picture.rgb, study, explains, min_confidence=MIN_CONFIDENCE)
    cpu_s = time.process_time() - start
    try:
        accept_candidate(study, "composite")
        accepted = True
    except Rejected:
        accepted = False
    found = study.alpha > 127
    union = (found | picture.truth).sum()
    iou = float((found & picture.truth).sum() / union) if union else 0.0
    return Judged(picture.kind, picture.setting, study.confidence, iou, accepted, cpu_s)


def report(judged: list[Judged]) -> None:
    """Print acceptance, precision of acceptance, rank correlation and cost, over all and by setting."""
    single = [each for each in judged if each.kind == "single"]
    accepted = [each for each in judged if each.accepted]
    right = [each for each in accepted if each.kind == "single" and each.iou > RIGHT_IOU]
    whole = [each for each in accepted if each.kind == "single"]
    print(f"{len(judged)} composites, {len(single)} of one whole thing")
    found = sum(each.iou > RIGHT_IOU for each in single)
    print(f"accepted of those: {len(whole)} = {with_interval(len(whole), len(single))}")
    print(f"of these with IoU > {RIGHT_IOU}: {len(right)} = {with_interval(len(right), len(whole))}")
    print(
        f"masks of one whole thing with IoU > {RIGHT_IOU}, accepted or not: {found} = {with_interval(found, len(single))}"
    )
    print(f"of the accepted above 0.90: {share(sum(each.iou > 0.9 for each in whole), len(whole))}")
    for kind in ("cut", "several"):
        some = [each for each in judged if each.kind == kind]
        print(f"{kind}: {len(some)}, wrongly accepted {sum(each.accepted for each in some)}")
    rank = spearmanr([each.confidence for each in single], [each.iou for each in single]).statistic
    print(f"rank correlation of confidence and IoU (one whole thing): {rank:.2f}")
    cost = [each.cpu_s for each in judged]
    print(f"CPU-s a picture: median {np.median(cost):.2f}, 90th percentile {np.percentile(cost, 90):.2f}")
    by_setting: dict[str, list[Judged]] = defaultdict(list)
    for each in single:
        family, *more = each.setting.split(", ")
        for name in (family, *more):
            by_setting[name].append(each)
    for name, some in sorted(by_setting.items()):
        taken = [each for each in some if each.accepted]
        good = sum(each.iou > RIGHT_IOU for each in taken)
        print(f"  {name:<12} {len(some):>4}: accepted {share(len(taken), len(some)):>5}, right {good} of {len(taken)}")


def with_interval(part: int, whole: int) -> str:
    """Return a share in percent with its 95 % confidence interval."""
    low, high = wilson_interval(part, whole)
    return f"{share(part, whole)} ({100 * low:.0f} to {100 * high:.0f})"


def share(part: int, whole: int) -> str:
    """Return a share in percent."""
    return f"{100 * part / whole:.0f} %" if whole else "none"


def photos(folder: Path, networks: Sequence[Network], sheet: Path | None) -> None:
    """Cut out the photos of a folder, print the result of each, and draw the accepted ones beside their cut-outs."""
    tiles, costs, count = [], [], 0
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in (".jpg", ".jpeg", ".png", ".webp"))
    for path in paths:
        pixels = read_image(path, max_side_px=MattingConfig().photo_side_px).pixels
        start = time.process_time()
        try:
            matte = matte_photo(pixels, path.name, networks=networks)
        except Rejected as rejection:
            print(f"{path.stem}: {rejection.detail}")
        else:
            count += 1
            print(f"{path.stem}: accepted, {matte.method}, confidence {matte.confidence:.2f}")
            tiles.append(tile(matte.rgba))
        costs.append(time.process_time() - start)
    print(f"accepted {count} of {len(paths)}; CPU-s a photo: median {np.median(costs):.2f}, most {max(costs):.2f}")
    if sheet is not None and tiles:
        tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % 3)
        rows = [np.hstack(tiles[i : i + 3]) for i in range(0, len(tiles), 3)]
        cv2.imwrite(str(sheet), np.vstack(rows)[..., ::-1])


def tile(rgba: np.ndarray) -> np.ndarray:
    """Return a photo beside its cut-out on a magenta background."""
    scale = TILE_PX / max(rgba.shape[:2])
    small = cv2.resize(rgba, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    alpha = small[..., 3:] / 255.0
    cut = (small[..., :3] * alpha + np.array([255, 0, 255]) * (1 - alpha)).astype(np.uint8)
    both = np.zeros((TILE_PX, 2 * TILE_PX, 3), np.uint8)
    both[: cut.shape[0], : cut.shape[1]] = small[..., :3]
    both[: cut.shape[0], TILE_PX : TILE_PX + cut.shape[1]] = cut
    return both


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", choices=("held-out", "tuning", "calibration"), default="held-out")
    parser.add_argument(
        "--first", type=int, default=0, help="number of the first composite: others than were measured before"
    )
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument(
        "--variant",
        choices=VARIANTS,
        default="plain",
        help="with a label, partly of the ground's colour, or small and compressed",
    )
    parser.add_argument("--named", action="store_true", help="the outline of the template of the name counts")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument(
        "--network", help="isnet, u2net or an ONNX file, two by a comma, as --matting of manitwin build"
    )
    parser.add_argument("--photos", type=Path)
    parser.add_argument("--sheet", type=Path)
    given = parser.parse_args()
    cv2.setNumThreads(1)
    networks = find_networks(given.network) if given.network else ()
    if given.count:
        with ProcessPoolExecutor(given.jobs, mp_context=get_context("spawn")) as pool:
            work = partial(
                judged_by_number, given.part, variant=given.variant, network=given.network, named=given.named
            )
            report(list(pool.map(work, range(given.first, given.first + given.count), chunksize=4)))
    if given.photos is not None:
        photos(given.photos, networks, given.sheet)


if __name__ == "__main__":
    main()
