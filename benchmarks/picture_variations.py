"""Vary pictures of known masks while a network is trained: seen, lit, printed, coloured and pierced in other ways each round.

Composites are made of templates, whose things have few colours and whose holes are large. Here parts of a thing take another
colour (black, white, the ground's own, that of polished metal), small holes open onto the ground, and loops and rods of wire are
put beside, so that a network cannot learn that a thing is of one colour, filled, or unlike its ground.
"""

from __future__ import annotations

import math
from typing import Any

import torch
from torch.nn import functional

LOG_SCALE = (-0.8, 0.45)  # of what is seen of a picture: down to 0.45 of it, since the second look is as close
RECOLOURED, PIERCED, WIRED = 0.4, 0.12, 0.1
"""Shares of pictures."""
GROUND_COLOURED = 0.35
"""Of those recoloured: nearly as the ground is."""


def varied(x: Any, truth: Any, side_px: int) -> tuple[Any, Any]:
    """Return pictures (B, 3, H, W) in [0, 1] and their truth (B, 1, H, W) at the network's size, each varied in its own way."""
    x, truth = seen_anew(x, truth, side_px)
    x = recoloured(x, truth)
    for index in range(len(x)):
        if torch.rand(1) < PIERCED:
            x[index], truth[index] = pierced(x[index], truth[index])
        if torch.rand(1) < WIRED:
            x[index], truth[index] = wired(x[index], truth[index])
    return lit_anew(x, truth).clamp(0, 1), truth.clamp(0, 1)


def seen_anew(x: Any, truth: Any, side_px: int) -> tuple[Any, Any]:
    """Turn, scale, stretch, mirror and shift."""
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


def recoloured(x: Any, truth: Any) -> Any:
    """Give a part of some things, on one side of a line through it, or the whole, another colour; its shading stays."""
    count, _, height, width = x.shape
    y_px, x_px = _pixels(height, width)
    area = truth.sum((1, 2, 3)) + 1
    ground = (x * (1 - truth)).sum((2, 3)) / ((1 - truth).sum((2, 3)) + 1)
    angle = _drawn(count, 0, 2 * math.pi)
    along = torch.cos(angle)[:, None, None] * x_px + torch.sin(angle)[:, None, None] * y_px
    middle = (along * truth[:, 0]).sum((1, 2)) / area
    spread = (((along - middle[:, None, None]) ** 2 * truth[:, 0]).sum((1, 2)) / area).sqrt()
    line = middle + spread * torch.where(torch.rand(count) < 0.25, torch.full((count,), 99.0), _drawn(count, -1.6, 1.6))
    softness = torch.exp(_drawn(count, -0.7, 2.0))[:, None, None]
    part = torch.sigmoid((line[:, None, None] - along) / softness)[:, None] * truth
    part = part * _each(_drawn(count, 0.75, 1.0) * (torch.rand(count) < RECOLOURED))
    kind = torch.rand(count)
    own = torch.rand(count, 3)
    own = torch.where((kind < 0.25)[:, None], _drawn(count, 0.01, 0.12, 1).expand(-1, 3), own)
    own = torch.where(((kind >= 0.25) & (kind < 0.4))[:, None], _drawn(count, 0.75, 1.0, 1).expand(-1, 3), own)
    near = ground * torch.exp(0.08 * torch.randn(count, 3) + 0.1 * torch.randn(count, 1))
    own = torch.where((kind > 1 - GROUND_COLOURED)[:, None], near, own)
    grey = x.mean(1, keepdim=True)
    shading = (grey / ((grey * part).sum((2, 3), keepdim=True) / (part.sum((2, 3), keepdim=True) + 1) + 0.02)).clamp(
        0.2, 2
    )
    shading = shading ** _each(_drawn(count, 0.3, 1.0))
    wave = torch.sin(along[:, None] * _each(_drawn(count, 0.02, 0.25)) + _each(_drawn(count, 0, 6.28)))
    polish = _each(_drawn(count, 0.2, 0.7) * (torch.rand(count) < 0.25))
    return x * (1 - part) + part * (own[:, :, None, None] * shading * (1 + polish * wave)).clamp(0, 1)


def pierced(x: Any, truth: Any) -> tuple[Any, Any]:
    """Open small holes in the thing of one picture, through which other places of its own ground are seen."""
    height, width = truth.shape[1:]
    inside = torch.nonzero(truth[0] > 0.5)
    if len(inside) < 400:
        return x, truth
    y_px, x_px = _pixels(height, width)
    for _ in range(int(torch.randint(1, 4, (1,)))):
        row, column = inside[int(torch.randint(len(inside), (1,)))].tolist()
        radii = torch.exp(torch.empty(2).uniform_(math.log(4), math.log(0.2 * len(inside) ** 0.5 + 4.1)))
        hole = _ellipse(y_px - row, x_px - column, radii, float(torch.rand(1)) * math.pi)
        for _ in range(6):
            shift = (int(torch.randint(height, (1,))), int(torch.randint(width, (1,))))
            other, covered = torch.roll(x, shift, (1, 2)), torch.roll(truth, shift, (1, 2))
            if float((covered[0] * hole).sum()) < 0.002 * float(hole.sum()):
                shade = float(torch.empty(1).uniform_(0.6, 1.05))
                x = x * (1 - hole) + hole * (other * shade).clamp(0, 1)
                truth = truth * (1 - hole)
                break
    return x, truth


def wired(x: Any, truth: Any) -> tuple[Any, Any]:
    """Put a loop or a rod of wire on the outline of the thing of one picture, with a faint shadow."""
    inside = torch.nonzero(truth[0] > 0.5)
    if len(inside) < 400:
        return x, truth
    y_px, x_px = _pixels(*truth.shape[1:])
    row, column = inside[int(torch.randint(len(inside), (1,)))].tolist()
    size = 0.8 * len(inside) ** 0.5
    half_px = float(torch.exp(torch.empty(1).uniform_(0.0, 1.6)))
    angle = float(torch.rand(1)) * 2 * math.pi
    across = math.cos(angle) * (y_px - row) - math.sin(angle) * (x_px - column)
    along = math.sin(angle) * (y_px - row) + math.cos(angle) * (x_px - column)
    if torch.rand(1) < 0.6:
        radii = torch.empty(2).uniform_(0.12, 0.6) * size + 3
        distance = ((along / radii[0] - 0.8) ** 2 + (across / radii[1]) ** 2).sqrt()
        wire = torch.sigmoid(2 * (half_px - (distance - 1).abs() * float(radii.min())))
    else:
        length = float(torch.empty(1).uniform_(0.3, 1.2)) * size
        wire = (
            torch.sigmoid(2 * (half_px - across.abs())) * torch.sigmoid(2 * along) * torch.sigmoid(2 * (length - along))
        )
    colour = (
        x[:, row, column] if torch.rand(1) < 0.5 else torch.rand(1).expand(3) if torch.rand(1) < 0.6 else torch.rand(3)
    )
    light = 1 + 0.35 * torch.sin(across / half_px + 1).clamp(-1, 1)
    away = torch.randint(-6, 7, (2,)).tolist()
    shadow = functional.avg_pool2d(torch.roll(wire, away, (0, 1))[None, None], 5, 1, 2)[0] * (1 - truth)
    x = x * (1 - float(torch.rand(1)) * 0.45 * shadow)
    x = x * (1 - wire) + wire * (colour[:, None, None] * light).clamp(0, 1)
    return x, torch.maximum(truth, wire[None])


def lit_anew(x: Any, truth: Any) -> Any:
    """Print other pictures on the thing, fainter ones on the ground; change light, hue, contrast; add noise and blur."""
    count = len(x)
    other = x[torch.randperm(count)].flip(3)
    other = other / (other.mean((1, 2, 3), keepdim=True) + 0.05)
    printed = truth * _each(_drawn(count, 0, 1) * (torch.rand(count) < 0.35))
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


def _drawn(count: int, low: float, high: float, *shape: int) -> Any:
    return torch.empty(count, *shape).uniform_(low, high)


def _each(values: Any) -> Any:
    return values[:, None, None, None]


def _pixels(height: int, width: int) -> tuple[Any, Any]:
    y_px, x_px = torch.meshgrid(torch.arange(height).float(), torch.arange(width).float(), indexing="ij")
    return y_px, x_px


def _ellipse(y_px: Any, x_px: Any, radii: Any, angle: float) -> Any:
    """Return the share (H, W) of each pixel in an ellipse about the origin."""
    first = math.cos(angle) * x_px + math.sin(angle) * y_px
    second = math.cos(angle) * y_px - math.sin(angle) * x_px
    distance = ((first / radii[0]) ** 2 + (second / radii[1]) ** 2).sqrt()
    return torch.sigmoid(2 * (1 - distance) * float(radii.min()))
