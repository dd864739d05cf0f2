"""Chess pieces in the Staunton style: turned bodies on felt that differ in their heads; fronts face -Y.

``chess piece`` is the pawn. Heights and foot widths follow the FIDE Handbook C.02, Standards of Chess Equipment 2.2.
"""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import box, chords, cylinder, ellipsoid, lathe, polygon, prism, rounded, union
from manitwin.geometry.solids.sweep import arc
from manitwin.models.generators.templates.template import Model, template

_FELT_M = 0.0015


def _stand(height_m: float, radius_m: float, waist: float, collar: float) -> Model:
    """Return a foot with its stem and the ring below the head, at ``collar`` of the height; ``waist`` is relative to the foot."""
    h, r = height_m, radius_m
    thin, top = waist * r, collar * h
    foot = [(0, 0), (r, 0), (r, 0.05 * h), (0.9 * r, 0.085 * h), (0.94 * r, 0.115 * h), (0.64 * r, 0.17 * h)]
    stem = [(1.25 * thin, 0.3 * h), (thin, 0.75 * top), (1.25 * thin, 0.96 * top), (1.25 * thin, top), (0, top)]
    model = Model().add("body", lathe(rounded([*foot, *stem], 0.1 * r)))
    ring = [(0, top - 0.022 * h), (1.9 * thin, top - 0.022 * h), (1.9 * thin, top - 0.006 * h)]
    ring += [(1.5 * thin, top + 0.006 * h), (1.5 * thin, top + 0.02 * h), (0, top + 0.02 * h)]
    model.add("collar", lathe(rounded(ring, 0.006 * h)))
    return _add_felt(model, r)


def _add_felt(model: Model, radius_m: float) -> Model:
    model.add("felt", cylinder(0.96 * radius_m, _FELT_M + 0.0005).translate((0, 0, -_FELT_M)), "felt")
    return model.point("base", "face", "felt", (0.0, 0.0, -_FELT_M), (0.0, 0.0, -1.0))


def _finish_piece(model: Model, height_m: float, radius_m: float, waist: float, collar: float) -> Model:
    """Add a grasp point on the stem, and place the piece on its felt."""
    at = 0.4 * collar * height_m + 0.3 * 0.4 * height_m
    wide = np.interp(at, [0.3 * height_m, 0.75 * collar * height_m], [1.25 * waist * radius_m, waist * radius_m])
    return model.point("body", "surface", "body", (0.0, -float(wide), at), (0.0, -1.0, 0.0)).rest_on_ground()


@template("chess king")
def chess_king(*, height_m: float, width: float, crown: float, waist: float, cross: float) -> Model:
    """Build a king; ``crown`` and ``waist`` are relative to its foot's width, ``cross`` is the cross's share of the height."""
    h, r, collar = height_m, 0.5 * width * height_m, 0.62
    model, low = _stand(h, r, waist, collar), (1 - cross) * h
    wide, start = crown * r, (collar + 0.005) * h
    head = [(0, start), (0.62 * wide, start), (wide, low - 0.075 * h), (0.93 * wide, low - 0.06 * h)]
    dome = [(0.9 * wide, low - 0.055 * h), (0.5 * wide, low - 0.02 * h), (0.22 * wide, low), (0, low)]
    model.add("crown", lathe(rounded([*head, *dome], 0.008 * h)))
    half, top = 0.5 * cross * h, h
    arm = [(0.16 * half, 0.16 * half), (0.4 * half, half), (-0.4 * half, half), (-0.16 * half, 0.16 * half)]
    flat = union([prism(polygon(_turned(arm, 90 * k), radius_m=0.03 * half), 0.5 * half) for k in range(4)])
    heart = box(0.4 * half, 0.4 * half, 0.5 * half)
    stood = (flat + heart).translate((0, 0, -0.25 * half)).rotate((90, 0, 0)).translate((0, 0, top - half))
    model.add("cross", stood + cylinder(0.3 * half, 0.5 * half).translate((0, 0, low - 0.1 * half)))
    model.point("top", "tip", "cross", (0.0, 0.0, top), (0.0, 0.0, 1.0))
    return _finish_piece(model, h, r, waist, collar)


def _turned(outline: list[tuple[float, float]], angle_deg: float) -> np.ndarray:
    a = np.radians(angle_deg)
    return np.array(outline) @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])


@template("chess queen")
def chess_queen(*, height_m: float, width: float, crown: float, waist: float) -> Model:
    """Build a queen with a coronet of eight points and a ball; ``crown`` and ``waist`` are relative to its foot's width."""
    h, r, collar = height_m, 0.5 * width * height_m, 0.66
    model = _stand(h, r, waist, collar)
    wide, start, rim, ball = crown * r, (collar + 0.005) * h, 0.915 * h, 0.035 * h
    head = [(0, start), (0.5 * wide, start), (0.6 * wide, 0.78 * h), (wide, rim - 0.012 * h), (0.96 * wide, rim)]
    inner = [
        (0.78 * wide, rim),
        (0.66 * wide, 0.885 * h),
        (0.55 * wide, 0.9 * h),
        (0.3 * wide, 0.94 * h),
        (0, 0.945 * h),
    ]
    model.add("crown", lathe(rounded([*head, *inner], 0.005 * h)))
    bite = (
        cylinder(0.2 * wide, 2 * wide, sides=chords(24))
        .rotate((0, 90, 0))
        .translate((0.3 * wide, 0, rim + 0.05 * wide))
    )
    model.cut("points", union([bite.rotate((0, 0, 22.5 + 45 * number)) for number in range(8)]))
    model.add("top", ellipsoid(2 * ball, 2 * ball, 2 * ball).translate((0, 0, h - ball)))
    model.point("top", "surface", "top", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return _finish_piece(model, h, r, waist, collar)


@template("chess bishop")
def chess_bishop(*, height_m: float, width: float, mitre: float, waist: float) -> Model:
    """Build a bishop with the slit of its mitre; ``mitre`` and ``waist`` are relative to its foot's width."""
    h, r, collar = height_m, 0.5 * width * height_m, 0.62
    model = _stand(h, r, waist, collar)
    wide, start, tip, ball = mitre * r, (collar + 0.005) * h, 0.945 * h, 0.036 * h
    long = tip - start
    side = [(0.5, 0.0), (0.86, 0.14), (1.0, 0.34), (0.86, 0.6), (0.5, 0.84), (0.14, 1.0)]
    curve = arc([(wide * radius, 0, start + long * z) for radius, z in side], samples=28)
    model.add("mitre", lathe([(0, start), *((float(x), float(z)) for x, _, z in curve), (0, tip)]))
    slit = box(2 * wide, 2.4 * wide, 0.1 * wide).translate((wide, 0, 0)).rotate((0, -52, 0))
    model.cut("slit", slit.translate((0.28 * wide, 0, start + 0.5 * long)).rotate((0, 0, -90)))
    model.add("top", ellipsoid(2 * ball, 2 * ball, 2 * ball).translate((0, 0, h - ball)))
    model.point("top", "surface", "top", (0.0, 0.0, h), (0.0, 0.0, 1.0))
    return _finish_piece(model, h, r, waist, collar)


@template("chess rook")
def chess_rook(*, height_m: float, width: float, tower: float, waist: float) -> Model:
    """Build a rook with six battlements; ``tower`` and ``waist`` are widths of head and shaft relative to the foot's."""
    h, r = height_m, 0.5 * width * height_m
    wide, thin = tower * r, waist * r
    foot = [(0, 0), (r, 0), (r, 0.075 * h), (0.88 * r, 0.12 * h), (0.92 * r, 0.16 * h), (1.16 * thin, 0.25 * h)]
    shaft = [(thin, 0.6 * h), (1.08 * thin, 0.68 * h), (0, 0.68 * h)]
    model = Model().add("body", lathe(rounded([*foot, *shaft], 0.1 * r)))
    head = [
        (0, 0.66 * h),
        (1.12 * thin, 0.66 * h),
        (wide, 0.75 * h),
        (wide, h),
        (0.68 * wide, h),
        (0.68 * wide, 0.87 * h),
    ]
    model.add("battlements", lathe(rounded([*head, (0, 0.89 * h)], 0.012 * h)))
    gap = box(2 * wide, 0.26 * wide, 0.4 * h).translate((wide, 0, 0.89 * h))
    model.cut("gaps", union([gap.rotate((0, 0, 60 * number)) for number in range(6)]))
    _add_felt(model, r)
    model.point("top", "surface", "battlements", (0.0, -0.84 * wide, h), (0.0, 0.0, 1.0))
    at = 0.42 * h
    side = float(np.interp(at, [0.25 * h, 0.6 * h], [1.16 * thin, thin]))
    return model.point("body", "surface", "body", (0.0, -side, at), (0.0, -1.0, 0.0)).rest_on_ground()


@template("chess knight")
def chess_knight(*, height_m: float, width: float, neck: float, thick: float) -> Model:
    """Build a knight with a horse's head that faces -Y; ``neck`` and ``thick`` are its length and thickness over the foot."""
    h, r = height_m, 0.5 * width * height_m
    foot = [
        (0, 0),
        (r, 0),
        (r, 0.07 * h),
        (0.88 * r, 0.11 * h),
        (0.92 * r, 0.145 * h),
        (0.8 * r, 0.2 * h),
        (0, 0.2 * h),
    ]
    model = Model().add("body", lathe(rounded(foot, 0.08 * r)))
    head, mane = _horse(h, neck * r, thick * r)
    model.add("head", head).add("mane", mane)
    place = (0.16 * neck * r, 0.81 * h, 0.62 * thick * r)
    eye = ellipsoid(0.055 * h, 0.05 * h, 0.05 * h, sides=chords(20))
    model.add(
        "eyes", union([_rotate_upright(eye.translate((place[0], place[1], side * place[2]))) for side in (-1.0, 1.0)])
    )
    _add_felt(model, r)
    model.point("top", "tip", "head", (0.0, 0.1 * neck * r, h), (0.0, 0.0, 1.0))
    muzzle = (0.0, -0.95 * neck * r, 0.62 * h)
    model.point("muzzle", "tip", "head", muzzle, (0.0, -0.9, -0.44))
    return model.rest_on_ground()


def _rotate_upright(solid: Manifold) -> Manifold:
    """Return a solid drawn in x and y with its front towards +X, rotated to stand upright with its front towards -Y."""
    return solid.rotate((90, 0, 0)).rotate((0, 0, -90))


def _horse(height_m: float, long_m: float, half_m: float) -> tuple[Manifold, Manifold]:
    """Return a horse's head with its neck, and its mane: a silhouette inflated to ``half_m`` on both sides."""
    h, n = height_m, long_m
    back = arc([(-0.72, 0, 0.15), (-0.82, 0, 0.36), (-0.76, 0, 0.58), (-0.56, 0, 0.78), (-0.24, 0, 0.915)], samples=18)
    face = arc([(0.06, 0, 0.92), (0.38, 0, 0.83), (0.72, 0, 0.715), (0.95, 0, 0.64)], samples=14)
    muzzle = [(1.0, 0.6), (0.95, 0.56), (0.84, 0.545), (0.66, 0.575), (0.82, 0.522)]
    chest = arc([(0.74, 0, 0.485), (0.42, 0, 0.52), (0.14, 0, 0.47), (0.34, 0, 0.35), (0.64, 0, 0.26), (0.7, 0, 0.15)])
    lines = [*((x, z) for x, _, z in back), *((x, z) for x, _, z in face), *muzzle, *((x, z) for x, _, z in chest)]
    outline = np.array([(n * x, h * z) for x, z in lines][::-1])
    flat = prism(polygon(outline), 2 * half_m).translate((0, 0, -half_m)).refine_to_length(0.045 * h)

    def swelled(vertices: np.ndarray) -> np.ndarray:
        inward = np.minimum(_distance_m(vertices[:, :2], outline) / (0.42 * n), 1.0)
        up = np.interp(vertices[:, 1] / h, [0.15, 0.5, 0.85], [1.0, 0.9, 0.78])
        ahead = np.interp(vertices[:, 0] / n, [0.2, 1.0], [1.0, 0.72])
        share = 0.3 + 0.7 * np.sqrt(1 - (1 - inward) ** 2)
        return np.column_stack([vertices[:, :2], vertices[:, 2] * up * ahead * share])

    ears = [
        cylinder(0.2 * n, 0.15 * h, top_radius_m=0.03 * n, sides=chords(20)).scale((1, 0.5, 1)).rotate((0, 0, 90))
        for _ in range(2)
    ]
    tips = [
        ear.rotate((-90, 0, 0)).rotate((side * -14, 0, 12)).translate((-0.06 * n, 0.855 * h, side * 0.34 * half_m))
        for ear, side in zip(ears, (-1.0, 1.0), strict=True)
    ]
    crest = arc([(-0.74, 0, 0.28), (-0.82, 0, 0.45), (-0.74, 0, 0.63), (-0.54, 0, 0.79), (-0.26, 0, 0.9)], samples=7)
    locks = [
        ellipsoid(0.34 * n, 0.12 * h, 0.9 * half_m, sides=chords(28)).rotate((0, 0, turn)).translate((n * x, h * z, 0))
        for (x, _, z), turn in zip(crest, np.linspace(12, -44, 7), strict=True)
    ]
    return _rotate_upright(union([flat.warp_batch(swelled), *tips])), _rotate_upright(union(locks))


def _distance_m(points_m: np.ndarray, outline_m: np.ndarray) -> np.ndarray:
    """Return the distances of points ``(N, 2)`` from a closed polyline ``(K, 2)``, metres."""
    start, step = outline_m, np.roll(outline_m, -1, axis=0) - outline_m
    to = points_m[:, None, :] - start[None]
    along = np.clip(np.einsum("nkj,kj->nk", to, step) / np.einsum("kj,kj->k", step, step), 0.0, 1.0)
    return np.asarray(np.linalg.norm(to - along[..., None] * step, axis=2).min(axis=1))
