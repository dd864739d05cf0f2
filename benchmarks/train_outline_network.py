"""Train the network that refines contours (``manitwin.models.matting.outline_network``) on composites of the training part.

    python benchmarks/train_outline_network.py draw FOUND.npz [--first 70000] [--count 250] [--jobs 2]
    python benchmarks/train_outline_network.py draw BENT.npz --bent-only --first 62000 --count 800
    python benchmarks/train_outline_network.py train FOUND.npz BENT.npz -o outline_network.npz

``outline_network.npz`` lies in src/manitwin/models/matting. ``draw`` needs this package; ``train`` also needs scikit-learn (1.9
was used), whose multilayer perceptron it fits. Every twentieth picture is left out for validation, and the result on these is
printed. A picture is used with the masks that the rules and the object network find in it. It is used again at another size,
sometimes sharpened, with its true mask at up to half the size, deformed and dilated by some pixels. With ``--bent-only``, which
takes a fifth of the time, only the second is done. The shipped weights were trained with other random numbers in the second part,
so drawing the pictures again gives slightly different ones.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
from composite_variants import Variant
from composites import composite

from manitwin.models.matting.fine_outline import band_px
from manitwin.models.matting.outline_network import (
    AROUND_PX,
    NEAR_PX,
    VALUES,
    OutlineColours,
    patch_windows,
    patches,
)
from manitwin.models.matting.study import judged_candidates, largest_piece

VARIANTS: tuple[Variant, ...] = ("plain", "plain", "labelled", "matched")
PATCHES_OF_A_MASK = 600
LEAST_IOU = 0.6  # a mask of something else teaches no contour
LEAST_PIXELS = 60
SIZES = (0.6, 1.7)
ROUGHER = (1.0, 1.25, 1.5, 2.0)
SHARPENED = 0.3
HIDDEN = (64, 32)
RATES = (*[1.5e-3] * 4, *[6e-4] * 3, *[2e-4] * 2, *[7e-5] * 2)
BATCH, PENALTY, AT_ONCE = 512, 1e-5, 50_000
HELD_OUT_EVERY = 20


def drawn_patches(number: int, bent_only: bool) -> tuple[np.ndarray, np.ndarray]:
    """Make one composite; return patches (N, F) float16 near its masks' contours, and whether each is object (N,)."""
    cv2.setNumThreads(1)
    rng = np.random.default_rng([number, 77])
    picture = composite("training", number, VARIANTS[number % len(VARIANTS)])
    seen: list[tuple[np.ndarray, np.ndarray]] = []
    if picture.kind == "single" and not bent_only:
        for each in judged_candidates(picture.rgb)[1]:
            mask = largest_piece(each.candidate.found.mask)
            rough_truth = _resized(picture.truth, mask.shape)
            if (mask & rough_truth).sum() > LEAST_IOU * (mask | rough_truth).sum():
                seen += _near_outline(rng, picture.rgb, picture.truth, mask)
    for rougher in (float(rng.choice(ROUGHER)), 1.0):
        rgb, truth = _at_another_size(rng, picture.rgb, picture.truth)
        rough = _resized(truth, (round(truth.shape[0] / rougher), round(truth.shape[1] / rougher)))
        seen += _near_outline(rng, rgb, truth, _bent(rng, rough, float(rng.uniform(0, 1.2 if rougher > 1 else 0.8))))
    if not seen:
        return np.zeros((0, _length()), np.float16), np.zeros(0, bool)
    return np.concatenate([each[0] for each in seen]), np.concatenate([each[1] for each in seen])


def _length() -> int:
    return VALUES * (NEAR_PX**2 + AROUND_PX**2) + 1


def _near_outline(
    rng: np.random.Generator, rgb: np.ndarray, truth: np.ndarray, mask: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return patches near the contour of a mask, in one random rotation and mirroring, and the truth at each.

    Returns nothing for a mask of fewer than ``LEAST_PIXELS``.
    """
    if mask.sum() < LEAST_PIXELS:
        return []
    rough = cv2.resize(mask.astype(np.float32), truth.shape[::-1], interpolation=cv2.INTER_LINEAR)
    sides = OutlineColours(rgb, rough, band_px(truth.shape, mask.shape))
    rows, columns = np.nonzero(sides.near)
    some = rng.choice(len(rows), min(len(rows), PATCHES_OF_A_MASK), replace=False)
    rows, columns = rows[some], columns[some]
    turns, mirrored = int(rng.integers(4)), bool(rng.random() < 0.5)
    return [
        (
            _turned(patches(patch_windows(sides, 0, len(rgb)), rows, columns), turns, mirrored).astype(np.float16),
            truth[rows, columns],
        )
    ]


def _turned(given: np.ndarray, turns: int, mirrored: bool) -> np.ndarray:
    parts, first = [], 0
    for side in (NEAR_PX, AROUND_PX):
        last = first + VALUES * side**2
        part = np.rot90(given[:, first:last].reshape(-1, VALUES, side, side), turns, (2, 3))
        parts.append((part[..., ::-1] if mirrored else part).reshape(len(given), -1))
        first = last
    return np.concatenate([*parts, given[:, first:]], axis=1)


def _at_another_size(rng: np.random.Generator, rgb: np.ndarray, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    size = float(np.exp(rng.uniform(*np.log(SIZES))))
    how = cv2.INTER_AREA if size < 1 else cv2.INTER_CUBIC
    rgb = cv2.resize(rgb, None, fx=size, fy=size, interpolation=how)
    truth = cv2.resize(truth.astype(np.float32), rgb.shape[1::-1], interpolation=how) > 0.5
    if rng.random() < SHARPENED:
        soft, by = cv2.GaussianBlur(rgb, (0, 0), float(rng.uniform(0.7, 1.5))), float(rng.uniform(0.3, 1))
        rgb = cv2.addWeighted(rgb, 1 + by, soft, -by, 0)
    return np.asarray(rgb), truth


def _resized(mask: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    return np.asarray(cv2.resize(mask.astype(np.float32), shape[::-1], interpolation=cv2.INTER_AREA) > 0.5)


def _bent(rng: np.random.Generator, mask: np.ndarray, by_px: float) -> np.ndarray:
    """Return a mask whose contour is displaced smoothly by about ``by_px`` pixels."""
    height, width = mask.shape
    waves_px = float(rng.uniform(3, 14))

    def smooth() -> np.ndarray:
        noise = rng.standard_normal((height, width)).astype(np.float32)
        return np.asarray(cv2.GaussianBlur(noise, (0, 0), waves_px) * (3.5 * waves_px * by_px))

    rows, columns = np.mgrid[:height, :width].astype(np.float32)
    moved = cv2.remap(mask.astype(np.float32), columns + smooth(), rows + smooth(), cv2.INTER_LINEAR) > 0.5
    inside, outside = (cv2.distanceTransform(m.astype(np.uint8), cv2.DIST_L2, 5) for m in (moved, ~moved))
    return np.asarray(inside - outside + 0.7 * (smooth() + float(rng.normal(0, 0.5)) * by_px) > 0)


def train(files: list[Path], out: Path) -> None:
    """Fit the perceptron; print accuracy and loss on the left-out pictures."""
    from sklearn.neural_network import MLPClassifier

    learned, held = [], []
    for file in files:
        with np.load(file) as arrays:
            left_out = arrays["picture"] % HELD_OUT_EVERY == 0
            given, truth = arrays["patches"], arrays["truth"]
        learned.append((given[~left_out], truth[~left_out]))
        held.append((given[left_out].astype(np.float32), truth[left_out]))
    given, truth = (np.concatenate([each[k] for each in learned]) for k in (0, 1))
    given_held, truth_held = (np.concatenate([each[k] for each in held]) for k in (0, 1))
    middle = NEAR_PX**2 // 2
    print(
        f"{len(truth)} patches; of {len(truth_held)} left out the rough mask has {_agree(given_held[:, middle] > 0, truth_held)}"
    )
    network = MLPClassifier(HIDDEN, batch_size=BATCH, alpha=PENALTY, max_iter=1, random_state=0)
    network.partial_fit(given[:BATCH].astype(np.float32), truth[:BATCH], classes=[False, True])
    for turn, rate in enumerate(RATES):
        network._optimizer.learning_rate_init = network._optimizer.learning_rate = rate
        order = np.random.default_rng(turn).permutation(len(given))
        for first in range(0, len(order), AT_ONCE):
            some = order[first : first + AT_ONCE]
            network.partial_fit(given[some].astype(np.float32), truth[some])
        likely = network.predict_proba(given_held)[:, 1]
        loss = -np.log(np.clip(np.where(truth_held, likely, 1 - likely), 1e-6, 1)).mean()
        print(f"{turn}: right {_agree(likely > 0.5, truth_held)}, loss {loss:.4f}", flush=True)
    layers = {}
    for place, (weight, bias) in enumerate(zip(network.coefs_, network.intercepts_, strict=True)):
        layers |= {f"{place}.weight": weight.astype(np.float16), f"{place}.bias": bias.astype(np.float16)}
    np.savez(out, **layers)


def _agree(found: np.ndarray, truth: np.ndarray) -> str:
    return f"{100 * (found == truth).mean():.2f} %"


def main() -> None:
    """Draw patches or train."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    drawing = commands.add_parser("draw")
    drawing.add_argument("patches", type=Path)
    drawing.add_argument("--first", type=int, default=70_000)
    drawing.add_argument("--count", type=int, default=250)
    drawing.add_argument("--bent-only", action="store_true", help="no masks that are found, which are dear")
    drawing.add_argument("--jobs", type=int, default=2)
    training = commands.add_parser("train")
    training.add_argument("patches", type=Path, nargs="+")
    training.add_argument("-o", "--out", type=Path, required=True)
    given = parser.parse_args()
    if given.command == "train":
        train(given.patches, given.out)
        return
    numbers = range(given.first, given.first + given.count)
    with ProcessPoolExecutor(given.jobs, mp_context=get_context("spawn")) as pool:
        made = list(pool.map(partial(drawn_patches, bent_only=given.bent_only), numbers, chunksize=4))
    picture = np.concatenate([np.full(len(truth), number) for number, (_, truth) in zip(numbers, made, strict=True)])
    np.savez(
        given.patches,
        patches=np.concatenate([each for each, _ in made]),
        truth=np.concatenate([truth for _, truth in made]),
        picture=picture,
    )


if __name__ == "__main__":
    main()
