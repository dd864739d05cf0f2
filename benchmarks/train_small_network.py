"""Train a small matting network on composites (``composites.py``, the part for training), for ``manitwin build --matting``.

    python benchmarks/train_small_network.py draw PICTURES [--count 6000] [--first 0]
    python benchmarks/train_small_network.py train PICTURES... -o small.npz [--minutes 45] [--threads 2]
    python benchmarks/train_small_network.py write small.npz -o small.onnx

A U-Net (Ronneberger, Fischer, Brox 2015) of a quarter of a million weights. ``draw`` and ``write`` want this package; ``train``
wants PyTorch 2 and NumPy and nothing else, so it can run in an environment of its own. The pictures are of other seeds than
those of every other part, show none of the held-out grounds and none of a quarter of the categories, and are varied in each
round: turned, scaled, mirrored, brighter, paler, in other hues, noisier. Batches follow from the seed, but arithmetic is
bfloat16 where the processor has it and the learning rate follows the clock: weights differ a little each time; ``matting.py``
judges them.
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import Any

import numpy as np

WIDTH_PX, HEIGHT_PX = 256, 208
CHANNELS = (16, 24, 32, 48, 64)
LEVELS = len(CHANNELS) - 1
MEAN, DIVISOR = 128.0, 256.0
BATCH, RATE, SEED = 24, 3e-3, 0


def draw(folder: Path, first: int, count: int) -> None:
    """Draw composites of the training part into ``folder``: ``rgb.npy`` (N, H, W, 3) and ``truth.npy`` (N, H, W), uint8."""
    import cv2
    from composites import composite

    cv2.setNumThreads(1)
    folder.mkdir(parents=True, exist_ok=True)
    size = (HEIGHT_PX, WIDTH_PX)
    rgb = np.lib.format.open_memmap(folder / "rgb.npy", "w+", np.uint8, (count, *size, 3))
    truth = np.lib.format.open_memmap(folder / "truth.npy", "w+", np.uint8, (count, *size))
    for index in range(count):
        picture = composite("training", first + index)
        rgb[index] = cv2.resize(picture.rgb, size[::-1], interpolation=cv2.INTER_AREA)
        share = cv2.resize(picture.truth.astype(np.float32), size[::-1], interpolation=cv2.INTER_AREA)
        truth[index] = np.rint(255 * share)


def network() -> Any:
    """Return the network, untrained: a U-Net from half the picture's size to a sixteenth of that, its outline at full size."""
    import torch
    from torch import nn
    from torch.nn import functional

    class Block(nn.Module):  # type: ignore[misc]
        def __init__(self, inputs: int, outputs: int, stride: int = 1):
            super().__init__()
            self.a = nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False)
            self.na = nn.BatchNorm2d(outputs)
            self.b = nn.Conv2d(outputs, outputs, 3, 1, 1, bias=False)
            self.nb = nn.BatchNorm2d(outputs)

        def forward(self, x: torch.Tensor) -> torch.Tensor:
            return torch.relu(self.nb(self.b(torch.relu(self.na(self.a(x))))))

    class Net(nn.Module):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            c = CHANNELS
            self.stem = nn.Conv2d(3, c[0], 3, 2, 1, bias=False)
            self.ns = nn.BatchNorm2d(c[0])
            self.down = nn.ModuleList([Block(c[k], c[k + 1], 2) for k in range(4)])
            self.up = nn.ModuleList([Block(c[k + 1] + c[k], c[k]) for k in range(4)])
            self.squeeze = nn.Conv2d(c[0], 6, 1)
            self.draw = nn.Conv2d(9, 8, 3, 1, 1)
            self.answer = nn.Conv2d(8, 1, 3, 1, 1)

        def forward(self, x: torch.Tensor) -> torch.Tensor:
            seen = [torch.relu(self.ns(self.stem(x)))]
            for down in self.down:
                seen.append(down(seen[-1]))
            y = seen[-1]
            for level in reversed(range(4)):
                y = functional.interpolate(y, size=seen[level].shape[2:], mode="bilinear", align_corners=False)
                y = self.up[level](torch.cat([y, seen[level]], 1))
            y = functional.interpolate(self.squeeze(y), size=x.shape[2:], mode="bilinear", align_corners=False)
            return self.answer(torch.relu(self.draw(torch.cat([y, x], 1))))

    return Net()


def varied(x: Any, truth: Any) -> tuple[Any, Any]:
    """Return pictures (B, 3, H, W) in [0, 1] and their truth, each moved, lit, coloured and blurred in its own way."""
    import torch
    from torch.nn import functional

    count, _, height, width = x.shape

    def drawn(low: float, high: float, *shape: int) -> torch.Tensor:
        return torch.empty(count, *shape).uniform_(low, high)

    turn = torch.where(torch.rand(count) < 0.15, drawn(-math.pi, math.pi), drawn(-0.35, 0.35))
    scale, stretch = torch.exp(drawn(-0.25, 0.35)), torch.exp(drawn(-0.25, 0.25))
    mirror = torch.where(torch.rand(count) < 0.5, -1.0, 1.0)
    cos, sin, ratio = torch.cos(turn), torch.sin(turn), height / width
    first = torch.stack([mirror * cos * scale * stretch, -sin * scale * ratio, drawn(-0.15, 0.15)], 1)
    second = torch.stack([mirror * sin * scale * stretch / ratio, cos * scale, drawn(-0.15, 0.15)], 1)
    grid = functional.affine_grid(torch.stack([first, second], 1), x.shape, align_corners=False)
    x = functional.grid_sample(x, grid, padding_mode="reflection", align_corners=False)
    truth = functional.grid_sample(truth, grid, padding_mode="reflection", align_corners=False)
    x = x.clamp(1e-4, 1) ** torch.exp(drawn(-0.4, 0.4))[:, None, None, None]
    x = x * torch.exp(drawn(-0.25, 0.25, 3))[:, :, None, None]
    grey = x.mean(1, keepdim=True)
    chroma = torch.where(torch.rand(count) < 0.1, torch.zeros(count), torch.exp(drawn(-0.7, 0.5)))
    x = grey + (x - grey) * chroma[:, None, None, None]
    swapped = torch.rand(count) < 0.25
    x[swapped] = x[swapped][:, torch.randperm(3)]
    mean = x.mean((2, 3), keepdim=True)
    x = mean + (x - mean) * torch.exp(drawn(-0.4, 0.3))[:, None, None, None]
    x = x + torch.randn_like(x) * (drawn(0, 0.02) * (torch.rand(count) < 0.5))[:, None, None, None]
    if torch.rand(1) < 0.3:
        x = functional.avg_pool2d(x, 3, 1, 1)
    return x.clamp(0, 1), truth


def loss_of(answer: Any, truth: Any) -> Any:
    """Return the cross-entropy, three times as heavy along outlines, and one less the soft IoU (Rahman and Wang 2016)."""
    import torch
    from torch.nn import functional

    each = functional.binary_cross_entropy_with_logits(answer, truth, reduction="none")
    outline = functional.max_pool2d(truth, 7, 1, 3) + functional.max_pool2d(-truth, 7, 1, 3)
    share = torch.sigmoid(answer)
    both = (share * truth).sum((1, 2, 3))
    either = (share + truth - share * truth).sum((1, 2, 3))
    return (each * (1 + 2 * outline)).mean() + (1 - (both + 1) / (either + 1)).mean()


def train(folders: list[Path], minutes: float, threads: int) -> dict[str, np.ndarray]:
    """Train for so many minutes; return the weights, batch normalisation folded in, as float16."""
    import torch

    torch.manual_seed(SEED)
    torch.set_num_threads(threads)
    rng = np.random.default_rng(SEED)
    rgb = np.concatenate([np.load(folder / "rgb.npy", mmap_mode="r") for folder in folders])
    truth = np.concatenate([np.load(folder / "truth.npy", mmap_mode="r") for folder in folders])
    net = network().to(memory_format=torch.channels_last)
    optimiser = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=1e-4)
    start, losses = time.monotonic(), []
    while (done := (time.monotonic() - start) / 60 / minutes) < 1:
        for group in optimiser.param_groups:
            group["lr"] = RATE * min(1.0, len(losses) / 100 + 0.01) * 0.5 * (1 + math.cos(math.pi * done)) + 1e-6
        chosen = np.sort(rng.integers(0, len(rgb), BATCH))
        x = torch.from_numpy(rgb[chosen]).permute(0, 3, 1, 2).float() / 255
        with torch.no_grad():
            x, target = varied(x, torch.from_numpy(truth[chosen])[:, None].float() / 255)
        picture = ((x * 255 - MEAN) / DIVISOR).contiguous(memory_format=torch.channels_last)
        with torch.autocast("cpu", dtype=torch.bfloat16):
            answer = net(picture)
        loss = loss_of(answer.float(), target)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(float(loss.item()))
        if len(losses) % 100 == 0:
            print(f"{len(losses)} steps, loss {np.mean(losses[-100:]):.4f}", flush=True)
    return folded({name: value.numpy() for name, value in net.state_dict().items()})


def folded(state: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the weights of a trained network by the names of ``as_onnx``, batch normalisation folded in."""
    weights: dict[str, np.ndarray] = {}

    def fold(kernel: str, norm: str, name: str) -> None:
        gain = state[f"{norm}.weight"] / np.sqrt(state[f"{norm}.running_var"] + 1e-5)
        weights[f"{name}.weight"] = state[f"{kernel}.weight"] * gain[:, None, None, None]
        weights[f"{name}.bias"] = state[f"{norm}.bias"] - state[f"{norm}.running_mean"] * gain

    fold("stem", "ns", "stem")
    for side in ("down", "up"):
        for level in range(4):
            for layer in "ab":
                fold(f"{side}.{level}.{layer}", f"{side}.{level}.n{layer}", f"{side}{level}.{layer}")
    for name in ("squeeze", "draw", "answer"):
        weights |= {f"{name}.{kind}": state[f"{name}.{kind}"] for kind in ("weight", "bias")}
    return {name: value.astype(np.float16) for name, value in weights.items()}


def as_onnx(weights: dict[str, np.ndarray]) -> bytes:
    """Return the network of these weights as ONNX: a picture scaled as that of U-Net (statistics of ImageNet), and its mask."""
    from manitwin.formats.onnx_graph import OnnxGraph
    from manitwin.models.matting.learned import SCALINGS

    graph = OnnxGraph((1, 3, HEIGHT_PX, WIDTH_PX))
    weights = {name: value.astype(np.float32) for name, value in weights.items()}

    def convolved(name: str, value: str, *, stride: int = 1, active: bool = True) -> str:
        kernel = weights[f"{name}.weight"]
        side = kernel.shape[-1]
        inputs = [value, *(graph.weight(f"{name}.{kind}", weights[f"{name}.{kind}"]) for kind in ("weight", "bias"))]
        sides = {"kernel_shape": [side, side], "strides": [stride, stride], "pads": [side // 2] * 4}
        output = graph.node("Conv", inputs, f"{name}.linear" if active else name, **sides)
        return graph.node("Relu", [output], name) if active else output

    def resized(name: str, value: str, channels: int, size: tuple[int, int]) -> str:
        none = [graph.weight(f"{name}.{kind}", np.zeros(0, np.float32)) for kind in ("region", "scales")]
        sizes = graph.weight(f"{name}.sizes", np.array([1, channels, *size], np.int64))
        how = {"mode": "linear", "coordinate_transformation_mode": "half_pixel"}
        return graph.node("Resize", [value, *none, sizes], f"{name}.larger", **how)

    mean, divisor = (each.reshape(1, 3, 1, 1) for each in SCALINGS["imagenet"])
    scale, shift = graph.weight("scale", divisor / DIVISOR), graph.weight("shift", (mean - MEAN) / DIVISOR)
    picture = graph.node("Add", [graph.node("Mul", ["input", scale], "scaled"), shift], "picture")
    seen, sizes = [convolved("stem", picture, stride=2)], [((HEIGHT_PX + 1) // 2, (WIDTH_PX + 1) // 2)]
    for level in range(LEVELS):
        seen.append(convolved(f"down{level}.b", convolved(f"down{level}.a", seen[-1], stride=2)))
        sizes.append(((sizes[-1][0] + 1) // 2, (sizes[-1][1] + 1) // 2))
    value = seen[-1]
    for level in reversed(range(LEVELS)):
        larger = resized(f"up{level}", value, CHANNELS[level + 1], sizes[level])
        both = graph.node("Concat", [larger, seen[level]], f"up{level}.both", axis=1)
        value = convolved(f"up{level}.b", convolved(f"up{level}.a", both))
    few = convolved("squeeze", value, active=False)
    large = resized("full", few, len(weights["squeeze.bias"]), (HEIGHT_PX, WIDTH_PX))
    drawn = convolved("draw", graph.node("Concat", [large, picture], "full.both", axis=1))
    mask = graph.node("Sigmoid", [convolved("answer", drawn, active=False)], "mask")
    return graph.to_bytes(mask, (1, 1, HEIGHT_PX, WIDTH_PX))


def main() -> None:
    """Draw pictures, train, or write the network."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    drawing = commands.add_parser("draw")
    drawing.add_argument("folder", type=Path)
    drawing.add_argument("--first", type=int, default=0)
    drawing.add_argument("--count", type=int, default=6000)
    training = commands.add_parser("train")
    training.add_argument("folders", type=Path, nargs="+")
    training.add_argument("-o", "--out", type=Path, required=True)
    training.add_argument("--minutes", type=float, default=45)
    training.add_argument("--threads", type=int, default=2)
    writing = commands.add_parser("write")
    writing.add_argument("weights", type=Path)
    writing.add_argument("-o", "--out", type=Path, required=True)
    given = parser.parse_args()
    if given.command == "draw":
        draw(given.folder, given.first, given.count)
    elif given.command == "train":
        np.savez_compressed(given.out, **train(given.folders, given.minutes, given.threads))
    else:
        with np.load(given.weights) as weights:
            given.out.write_bytes(as_onnx(dict(weights)))


if __name__ == "__main__":
    main()
