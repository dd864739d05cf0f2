"""Augment pictures with known masks during training: geometry, colours, labels, light and compression, anew each epoch.

Composites are made from templates, which have no labels and rarely the colour of their ground. The augmentation also covers cases
such as a white bottle on a white sheet of which only the label stands out, with a mask of the whole bottle.
"""

from __future__ import annotations

import math
from typing import Any

import torch
from torch.nn import functional

LOG_SCALE = (-0.8, 0.45)  # of the visible part of a picture: down to 0.45, like the close-up of the second pass
GROUND_COLOURED, DARKENED, LABELLED, PRINTED, COMPRESSED = 0.25, 0.12, 0.35, 0.35, 0.3
SHADOWED, SHADED, BARE, ORDINARY, SOFT = 0.45, 0.2, 0.2, 0.35, 0.15
"""Shares of pictures with each variation; for ordinary ones only the view and the light vary."""
LABEL_BARS = 4
SHADOW_STEPS = 5
LUMA = (0.299, 0.587, 0.114)


def varied(x: Any, truth: Any, side_px: int) -> tuple[Any, Any]:
    """Return augmented pictures ``(B, 3, H, W)`` in [0, 1] and masks ``(B, 1, H, W)`` at the network's size, each varied on its
    own.
    """
    x, truth = seen_anew(x, truth, side_px)
    y = labelled(darkened(coloured_as_ground(bared(x, truth), truth), truth), truth)
    y = shaded(shadowed(y, truth))
    ordinary = _each(torch.rand(len(x)) < ORDINARY)
    return compressed(softened(lit_anew(torch.where(ordinary, x, y), truth))).clamp(0, 1), truth


def seen_anew(x: Any, truth: Any, side_px: int) -> tuple[Any, Any]:
    """Rotate, scale, stretch, mirror and shift pictures and masks."""
    count, _, height, width = x.shape
    turn = torch.where(torch.rand(count) < 0.15, _drawn(count, -math.pi, math.pi), _drawn(count, -0.35, 0.35))
    scale, stretch = torch.exp(_drawn(count, *LOG_SCALE)), torch.exp(_drawn(count, -0.25, 0.25))
    mirror = torch.where(torch.rand(count) < 0.5, -1.0, 1.0)
    cos, sin, ratio = torch.cos(turn), torch.sin(turn), height / width
    first = torch.stack([mirror * cos * scale * stretch, -sin * scale * ratio, _drawn(count, -0.15, 0.15)], 1)
    second = torch.stack([mirror * sin * scale * stretch / ratio, cos * scale, _drawn(count, -0.15, 0.15)], 1)
    grid = functional.affine_grid(torch.stack([first, second], 1), [count, 3, side_px, side_px], align_corners=False)
    moved = [functional.grid_sample(y, grid, padding_mode="reflection", align_corners=False) for y in (x, truth)]
    return moved[0], moved[1]


def bared(x: Any, truth: Any) -> Any:
    """Replace the ground of some pictures by its mean colour without texture, slightly darker towards one side."""
    count, _, height, width = x.shape
    y, across = torch.meshgrid(torch.linspace(-1, 1, height), torch.linspace(-1, 1, width), indexing="ij")
    angle = _drawn(count, -math.pi, math.pi)
    slope = _drawn(count, 0, 0.3)[:, None, None, None] * (_each(angle.cos()) * across + _each(angle.sin()) * y)
    ground = (x * (1 - truth)).sum((2, 3)) / ((1 - truth).sum((2, 3)) + 1)
    share = (1 - truth) * _each(torch.rand(count) < BARE)
    return x * (1 - share) + share * (ground[:, :, None, None] * (1 - slope)).clamp(0, 1)


def coloured_as_ground(x: Any, truth: Any) -> Any:
    """Give some things nearly the colour of the ground around them; the shading stays, and for some a part of the colour."""
    count = len(x)
    thing = functional.max_pool2d(truth, 4)
    around = functional.max_pool2d(thing, 11, 1, 5) - thing
    ground = (functional.avg_pool2d(x, 4) * around).sum((2, 3)) / (around.sum((2, 3)) + 0.06)
    near = ground * torch.exp(0.06 * torch.randn(count, 3) + 0.12 * torch.randn(count, 1))
    shading = _shading(x, truth) ** _each(_drawn(count, 0.3, 1.0))
    own = x / ((x * truth).sum((2, 3), keepdim=True) / (truth.sum((2, 3), keepdim=True) + 1) + 0.02)
    kept = _each(_drawn(count, 0, 0.6) * (torch.rand(count) < 0.5))
    painted = near[:, :, None, None] * (shading * (1 - kept) + own.clamp(0.1, 3) * kept)
    share = truth * _each(_drawn(count, 0.85, 1.0) * (torch.rand(count) < GROUND_COLOURED))
    share = share * _beyond_a_line(truth)
    return x * (1 - share) + share * painted.clamp(0, 1)


def darkened(x: Any, truth: Any) -> Any:
    """Make some things as dark as in a deep shadow."""
    count = len(x)
    mean = ((x.mean(1, keepdim=True) * truth).sum((2, 3)) / (truth.sum((2, 3)) + 1) + 0.02)[:, 0]
    gain = (_drawn(count, 0.02, 0.2) / mean).clamp(max=1)
    return x * (1 - truth * _each((1 - gain) * (torch.rand(count) < DARKENED)))


def shadowed(x: Any, truth: Any) -> Any:
    """Add a cast shadow of some things to the ground: the silhouette, sheared about its foot or shifted in steps.

    The shadow may be hard or soft, deep or faint, along the ground or on a wall behind.
    """
    count, _, height, _ = x.shape
    rows = truth.amax((1, 3)) > 0.5
    foot = 2 * (height - 1 - rows.flip(1).float().argmax(1)) / height - 1
    sheared, squeeze = (
        _drawn(count, -1.5, 1.5),
        _drawn(count, 0.25, 1.1) * torch.where(torch.rand(count) < 0.3, -1.0, 1.0),
    )
    one, zero = torch.ones(count), torch.zeros(count)
    first = torch.stack([one, -sheared / squeeze, sheared * foot / squeeze], 1)
    second = torch.stack([zero, 1 / squeeze, foot * (1 - 1 / squeeze)], 1)
    fallen = _moved(truth, torch.stack([first, second], 1))
    angle, far = _drawn(count, -math.pi, math.pi), truth.sum((1, 2, 3)).sqrt() / height * _drawn(count, 0.05, 0.7)
    away = torch.zeros_like(truth)
    for step in range(1, SHADOW_STEPS + 1):
        shift = far * step / SHADOW_STEPS
        first, second = (
            torch.stack([one, zero, shift * angle.cos()], 1),
            torch.stack([zero, one, shift * angle.sin()], 1),
        )
        away = torch.maximum(away, _moved(truth, torch.stack([first, second], 1)))
    fallen = torch.where(_each(torch.rand(count)) < 0.5, fallen, away)
    side = (1, 1, 3, 9, 21)[int(torch.randint(5, (1,)))]
    fallen = functional.avg_pool2d(fallen, (side, 1), 1, (side // 2, 0), count_include_pad=False)
    fallen = functional.avg_pool2d(fallen, (1, side), 1, (0, side // 2), count_include_pad=False)
    depth = _drawn(count, 0.2, 0.8) * (torch.rand(count) < SHADOWED)
    tint = (depth[:, None] * (1 + 0.06 * torch.randn(count, 3))).clamp(0, 0.9)
    return x * (1 - tint[:, :, None, None] * fallen * (1 - truth))


def shaded(x: Any) -> Any:
    """Draw the edge of another object's shadow across some pictures, over thing and ground."""
    count, _, height, width = x.shape
    y, across = torch.meshgrid(torch.linspace(-1, 1, height), torch.linspace(-1, 1, width), indexing="ij")
    angle, soft = _drawn(count, -math.pi, math.pi), torch.exp(_drawn(count, -5, 0.5))
    place = _each(angle.cos())[:, 0] * across + _each(angle.sin())[:, 0] * y - _each(_drawn(count, -0.8, 0.8))[:, 0]
    depth = _drawn(count, 0.1, 0.6) * (torch.rand(count) < SHADED)
    return x * (1 - _each(depth) * torch.sigmoid(place / _each(soft)[:, 0])[:, None])


def labelled(x: Any, truth: Any) -> Any:
    """Print a patch with bars on some things, inside their silhouette."""
    count, _, height, width = x.shape
    y_px, x_px = torch.meshgrid(torch.arange(height).float(), torch.arange(width).float(), indexing="ij")
    inside = -functional.max_pool2d(-truth, 9, 1, 4)
    shading = _shading(x, truth)
    x = x.clone()
    for index in range(count):
        places = torch.nonzero(inside[index, 0] > 0.99)
        if torch.rand(1) > LABELLED or len(places) < 200:
            continue
        row, column = places[int(torch.randint(len(places), (1,)))].tolist()
        angle = float(torch.empty(1).uniform_(-0.4, 0.4))
        along = math.cos(angle) * (x_px - column) + math.sin(angle) * (y_px - row)
        across = math.cos(angle) * (y_px - row) - math.sin(angle) * (x_px - column)
        half = len(places) ** 0.5 * torch.empty(2).uniform_(0.2, 0.55)
        paint = torch.rand(3, 1, 1).expand(-1, height, width).clone()
        for _ in range(int(torch.randint(1, LABEL_BARS + 1, (1,)))):
            middle, size = torch.empty(2).uniform_(-0.8, 0.8) * half, torch.empty(2).uniform_(0.05, 0.45) * half
            bar = ((along - middle[0]).abs() < size[0]) & ((across - middle[1]).abs() < size[1])
            paint = torch.where(bar, torch.rand(3, 1, 1), paint)
        patch = ((along.abs() < half[0]) & (across.abs() < half[1])).float() * inside[index]
        x[index] = x[index] * (1 - patch) + patch * (paint * shading[index].clamp(0, 1.5)).clamp(0, 1)
    return x


def lit_anew(x: Any, truth: Any) -> Any:
    """Blend other pictures into the thing and weakly into the ground; vary light, hue and contrast; add noise and blur."""
    count = len(x)
    other = x[torch.randperm(count)].flip(3)
    other = other / (other.mean((1, 2, 3), keepdim=True) + 0.05)
    printed = truth * _each(_drawn(count, 0, 1) * (torch.rand(count) < PRINTED))
    printed = printed + (1 - truth) * _each(_drawn(count, 0, 0.12) * (torch.rand(count) < 0.25))
    x = x * (1 - printed + printed * other.clamp(0.1, 2.2))
    x = x.clamp(1e-4, 1) ** _each(torch.exp(_drawn(count, -0.4, 0.4)))
    x = x * torch.exp(_drawn(count, -0.25, 0.25, 3))[:, :, None, None]
    grey = x.mean(1, keepdim=True)
    paler = torch.where(torch.rand(count) < 0.1, torch.zeros(count), torch.exp(_drawn(count, -0.7, 0.5)))
    x = grey + (x - grey) * _each(paler)
    swapped = torch.rand(count) < 0.25
    x[swapped] = x[swapped][:, torch.randperm(3)]
    mean = x.mean((2, 3), keepdim=True)
    x = mean + (x - mean) * _each(torch.exp(_drawn(count, -0.4, 0.3)))
    x = x + torch.randn_like(x) * _each(_drawn(count, 0, 0.02) * (torch.rand(count) < 0.5))
    return functional.avg_pool2d(x, 3, 1, 1) if torch.rand(1) < 0.3 else x


def softened(x: Any) -> Any:
    """Defocus some pictures."""
    side = (5, 7, 9)[int(torch.randint(3, (1,)))]
    soft = functional.avg_pool2d(
        functional.avg_pool2d(x, side, 1, side // 2, count_include_pad=False), 3, 1, 1, count_include_pad=False
    )
    return torch.where(_each(torch.rand(len(x)) < SOFT), soft, x)


def compressed(x: Any) -> Any:
    """Average the colours of some pictures over blocks, like JPEG of small pictures, and halve the resolution of luminance."""
    if torch.rand(1) > COMPRESSED:
        return x
    luma = sum(weight * x[:, channel : channel + 1] for channel, weight in enumerate(LUMA))
    size = x.shape[2:]
    colours = functional.avg_pool2d(x - luma, 4 if torch.rand(1) < 0.5 else 8)
    colours = functional.interpolate(colours, size=size, mode="bilinear", align_corners=False)
    if torch.rand(1) < 0.5:
        luma = functional.interpolate(functional.avg_pool2d(luma, 2), size=size, mode="bilinear", align_corners=False)
    return luma + colours


def _beyond_a_line(truth: Any) -> Any:
    """Return a mask ``(B, 1, H, W)``: 1 on one side of a line through each thing, 0 on the other; for two in five all 1."""
    count, _, height, width = truth.shape
    y, across = torch.meshgrid(torch.linspace(-1, 1, height), torch.linspace(-1, 1, width), indexing="ij")
    weight = truth[:, 0] / (truth.sum((1, 2, 3))[:, None, None] + 1)
    spread = (truth.sum((1, 2, 3)) / (height * width)).sqrt()
    middle = [(weight * axis).sum((1, 2)) + spread * _drawn(count, -0.8, 0.8) for axis in (across, y)]
    angle = _drawn(count, -math.pi, math.pi)
    place = _each(angle.cos())[:, 0] * (across - _each(middle[0])[:, 0]) + _each(angle.sin())[:, 0] * (
        y - _each(middle[1])[:, 0]
    )
    side = torch.sigmoid(place * height / 2)[:, None]
    return torch.where(_each(torch.rand(count)) < 0.4, torch.ones_like(side), side)


def _shading(x: Any, truth: Any) -> Any:
    """Return the brightness ``(B, 1, H, W)`` of each pixel relative to the thing's mean."""
    grey = x.mean(1, keepdim=True)
    mean = (grey * truth).sum((2, 3), keepdim=True) / (truth.sum((2, 3), keepdim=True) + 1) + 0.02
    return (grey / mean).clamp(0.2, 2)


def _moved(truth: Any, matrices: Any) -> Any:
    grid = functional.affine_grid(matrices, list(truth.shape), align_corners=False)
    return functional.grid_sample(truth, grid, align_corners=False)


def _drawn(count: int, low: float, high: float, *shape: int) -> Any:
    return torch.empty(count, *shape).uniform_(low, high)


def _each(values: Any) -> Any:
    return values[:, None, None, None]
