"""Fit the confidence of cut-outs to pictures with known masks, and print what limits on it would accept.

    python benchmarks/matting_belief.py [--first 0] [--count 600] [--photo-seeds 0,1] [--jobs 2] [-o belief.json]

The pictures are composites of the calibration part (``composites.py``), which is used for nothing else. Every second one is also
used with a label, the others also with a part in the colour of the ground and also small (``composite_variants.py``). Photos of
templates of the tuning seeds (``template_photos.py``) are added for every third category. belief.json lies in
src/manitwin/models/matting. The model is a logistic regression with an L2 penalty and no negative weight. The penalty is chosen
by cross-validation over pictures, and the table shows predictions for pictures that were left out. ``matting.py`` measures the
result on the held-out part.
"""

from __future__ import annotations

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
from composite_categories import COMPOSITE_CATEGORIES
from composite_variants import Variant
from composites import Composite, composite
from matting import RIGHT_IOU
from scipy.optimize import minimize
from template_photos import TemplatePhoto, photograph

from manitwin.models.matting import belief
from manitwin.models.matting.study import drawn, judged_candidates

FOLDS, SEED = 5, 0
PHOTOS_FROM = 1_000_000  # numbers of template photos, above those of composites
PHOTO_CATEGORIES_EVERY = 3
PENALTIES = (0.00003, 0.0001, 0.0003, 0.001, 0.003, 0.01)
LIMITS = (0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95)


VARIANTS: tuple[tuple[Variant, int, int], ...] = (
    ("plain", 0, 1),
    ("labelled", 0, 2),
    ("matched", 1, 2),
    ("small", 1, 2),
)
"""Variants of composites: name, first number, and step between the numbers that are drawn in this variant."""


@dataclass(frozen=True)
class Example:
    """A candidate mask of a picture: its ``features``, whether it is ``right``, and whether the picture shows one ``whole``
    object.

    ``number`` is that of the picture, ``group`` the cross-validation group that is never split, and ``source`` the kind of
    picture.
    """

    number: int
    group: int
    source: str
    features: np.ndarray
    right: bool
    whole: bool


def examples(number: int) -> list[Example]:
    """Make one composite in its variants and return their candidates."""
    cv2.setNumThreads(1)
    return [
        each
        for place, (variant, first, every) in enumerate(VARIANTS)
        if number % every == first
        for each in examples_of(
            len(VARIANTS) * number + place, number, variant, composite("calibration", number, variant)
        )
    ]


def photo_examples(thing: tuple[int, str, int]) -> list[Example]:
    """Photograph one object, given by number, category and seed, and return the candidates of all its photos."""
    cv2.setNumThreads(1)
    number, category, seed = thing
    photos = photograph(category, seed)
    first = PHOTOS_FROM + number * len(photos)
    return [each for k, photo in enumerate(photos) for each in examples_of(first + k, first + k, "photo", photo)]


def examples_of(number: int, group: int, source: str, picture: Composite | TemplatePhoto) -> list[Example]:
    """Return the candidates of a picture, each with its truth."""
    made = []
    truth = picture.truth if isinstance(picture, Composite) else picture.mask
    whole = not isinstance(picture, Composite) or picture.kind == "single"
    for judged in judged_candidates(picture.rgb)[1]:
        found = drawn(picture.rgb, judged.candidate.found.mask) > 127
        iou = (found & truth).sum() / max(int((found | truth).sum()), 1)
        made.append(Example(number, group, source, judged.features, bool(whole and iou > RIGHT_IOU), whole))
    return made


def fitted(features: np.ndarray, right: np.ndarray, penalty: float) -> tuple[float, np.ndarray]:
    """Return the bias and the weights ``(F,)`` for features ``(N, F)`` in their own units.

    No weight is negative, except that of the method that made the candidate.
    """
    spread = np.maximum(features.std(0), 1e-6)
    x = (features - belief.BEST) / spread

    def loss(parameters: np.ndarray) -> tuple[float, np.ndarray]:
        margin = parameters[0] + x @ parameters[1:]
        error = 1 / (1 + np.exp(-np.clip(margin, -30, 30))) - right
        value = float(np.logaddexp(0, np.where(right, -margin, margin)).mean() + penalty * (parameters[1:] ** 2).sum())
        return value, np.concatenate([[error.mean()], x.T @ error / len(x) + 2 * penalty * parameters[1:]])

    bounds = [(None, None), *[(0, None)] * (x.shape[1] - 1), (None, None)]
    found = minimize(loss, np.zeros(x.shape[1] + 1), jac=True, bounds=bounds, method="L-BFGS-B").x
    weights = found[1:] / spread
    return float(found[0] - weights @ belief.BEST), weights


def predicted(features: np.ndarray, right: np.ndarray, groups: np.ndarray, penalty: float) -> np.ndarray:
    """Return the probability ``(N,)`` of each example, from models fitted to the pictures of the other folds."""
    fold = np.random.default_rng(SEED).integers(0, FOLDS, int(groups.max()) + 1)[groups]
    out = np.zeros(len(features))
    for each in range(FOLDS):
        bias, weights = fitted(features[fold != each], right[fold != each], penalty)
        out[fold == each] = 1 / (1 + np.exp(-np.clip(bias + features[fold == each] @ weights, -30, 30)))
    return out


def report(made: list[Example]) -> tuple[float, np.ndarray]:
    """Print what limits would accept, using predictions for left-out pictures, and return bias and weights fitted to all."""
    features = np.array([each.features for each in made])
    right = np.array([each.right for each in made])
    numbers = np.array([each.number for each in made])
    groups = np.array([each.group for each in made])
    losses = {}
    for penalty in PENALTIES:
        likely = np.clip(predicted(features, right, groups, penalty), 1e-6, 1 - 1e-6)
        losses[penalty] = float(-np.where(right, np.log(likely), np.log(1 - likely)).mean())
    best = min(losses, key=lambda penalty: losses[penalty])
    print("cross-validated loss by penalty: " + ", ".join(f"{key:g}: {value:.4f}" for key, value in losses.items()))
    likely = predicted(features, right, groups, best) * np.array(
        [belief.unfitted_factor(values) for values in features]
    )
    for source in sorted({each.source for each in made}):
        some = np.flatnonzero([each.source == source for each in made])
        chosen = [some[numbers[some] == number] for number in np.unique(numbers[some])]
        first = np.array([masks[np.argmax(likely[masks])] for masks in chosen])
        whole = np.array([made[k].whole for k in first])
        possible = sum(bool(right[masks].any()) for masks in chosen)
        print(f"{source}: {len(chosen)} pictures with a candidate, {int(whole.sum())} of one whole thing;", end=" ")
        print(f"a right one in {possible}, chosen in {int(right[first].sum())}")
        for limit in LIMITS:
            taken = likely[first] >= limit
            print(
                f"  at {limit:4.2f}: accepted {int((taken & whole).sum())}, and {int((taken & ~whole).sum())} others;"
                f" right {int(right[first[taken]].sum())}"
            )
    return fitted(features, right, best)


def write(path: Path, bias: float, weights: np.ndarray, made: list[Example]) -> None:
    """Write bias and weights, and a description of the data they were fitted to."""
    numbers = sorted({each.group for each in made if each.group < PHOTOS_FROM})
    photos = len({each.number for each in made if each.number >= PHOTOS_FROM})
    composites = f"calibration composites {numbers[0]} to {numbers[-1]}" if numbers else "no composites"
    content = {
        "fitted_to": f"{len(made)} masks of {composites} and of {photos} photos of templates",
        "bias": round(bias, 4),
        "weights": {name: round(float(value), 4) for name, value in zip(belief.FEATURES, weights, strict=True)},
    }
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def main() -> None:
    """Make the pictures, fit, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=600)
    parser.add_argument("--photo-seeds", default="0,1", help="of template photos; none of an empty word")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args()
    seeds = [int(seed) for seed in given.photo_seeds.split(",") if seed]
    pairs = [(category, seed) for category in COMPOSITE_CATEGORIES[::PHOTO_CATEGORIES_EVERY] for seed in seeds]
    things = [(number, *pair) for number, pair in enumerate(pairs)]
    with ProcessPoolExecutor(given.jobs, mp_context=get_context("spawn")) as pool:
        composites = pool.map(examples, range(given.first, given.first + given.count), chunksize=4)
        made = [each for some in (*composites, *pool.map(photo_examples, things)) for each in some]
    bias, weights = report(made)
    if given.out is not None:
        write(given.out, bias, weights, made)


if __name__ == "__main__":
    main()
