"""Train the decoder of the built-in object network on composites (``composites.py``, the training part).

    python benchmarks/train_object_network.py encoder encoder.npz
    python benchmarks/train_object_network.py draw PICTURES [--count 2500] [--first 0]
    python benchmarks/train_object_network.py train encoder.npz PICTURES... -o decoder.npz [--minutes 60] [--begin F]

``decoder.npz`` becomes one of the networks in src/manitwin/models/matting. ``object_network.npz`` was trained on rotated, scaled,
printed and relit pictures. ``object_network_varied.npz`` continued from it (``--begin``, 160 minutes in four runs with different
``--seed``) with all of ``picture_variations.py``: objects and parts in the colour of their ground, dark objects, labels, hard
shadows, smeared colours, bare grounds, and in the last run a third of ordinary pictures and some out of focus.

``encoder`` and ``draw`` need this package; ``train`` needs only PyTorch 2 and NumPy, so it can run in a separate environment. The
encoder, EfficientNet-Lite0, is used unchanged, because it was trained on real photos. The pictures have other seeds than those of
every other part, and contain no held-out ground and none of a quarter of the categories. Batches follow from the seed, but the
arithmetic is bfloat16 where the processor supports it and the learning rate depends on elapsed time, so the weights differ
slightly between runs; ``matting.py`` evaluates them.
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import Any

import numpy as np

WIDTH_PX, HEIGHT_PX = 400, 320  # of drawn pictures: larger than the network's input, for views that are scaled up
SIDE_PX = 288
BLOCKS = ((1, 3, 1, 1), (2, 3, 2, 6), (2, 5, 2, 6), (3, 3, 2, 6), (3, 5, 1, 6), (4, 5, 2, 6), (1, 3, 1, 6))
"""Blocks of the encoder: repeats, kernel, stride of the first, expansion."""
SEEN = {0: 16, 2: 24, 4: 40, 10: 112, 15: 320}
"""Blocks whose output the decoder uses, with their channels."""
CHANNELS, MIXES = (24, 32, 48, 64, 96), 2
MEAN, DEVIATION = 127.0, 128.0
BATCH, RATE = 16, 3e-3
RATE_ON = 8e-4  # learning rate of a decoder that continues training


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


def encoder(weights: dict[str, np.ndarray]) -> Any:
    """Return the function from normalised pictures (B, 3, H, W) to the outputs of the ``SEEN`` blocks."""
    import torch
    from torch.nn import functional

    def convolution(x: torch.Tensor, name: str, norm: str, stride: int = 1, active: bool = True) -> torch.Tensor:
        gain = weights[f"{norm}.weight"] / np.sqrt(weights[f"{norm}.running_var"] + 1e-3)
        kernel = torch.from_numpy((weights[f"{name}.weight"] * gain[:, None, None, None]).astype(np.float32))
        bias = torch.from_numpy((weights[f"{norm}.bias"] - weights[f"{norm}.running_mean"] * gain).astype(np.float32))
        side, size = x.shape[-1], kernel.shape[-1]
        total = max((-(-side // stride) - 1) * stride + size - side, 0)  # TensorFlow's SAME padding
        x = functional.pad(x, (total // 2, total - total // 2) * 2)
        groups = len(kernel) if kernel.shape[1] == 1 else 1
        y = functional.conv2d(x, kernel, bias, stride, groups=groups)
        return y.clamp(0, 6) if active else y

    blocks = [
        (kernel, stride if repeat == 0 else 1, expansion, repeat > 0)
        for repeats, kernel, stride, expansion in BLOCKS
        for repeat in range(repeats)
    ]

    def values(x: torch.Tensor) -> list[torch.Tensor]:
        seen = []
        x = convolution(x, "_conv_stem", "_bn0", 2)
        for number, (_, stride, expansion, repeated) in enumerate(blocks):
            name, y = f"_blocks.{number}.", x
            if expansion > 1:
                y = convolution(y, name + "_expand_conv", name + "_bn0")
            y = convolution(y, name + "_depthwise_conv", name + "_bn1", stride)
            y = convolution(y, name + "_project_conv", name + "_bn2", active=False)
            x = x + y if repeated else y
            if number in SEEN:
                seen.append(x)
        return seen

    return values


def decoder() -> Any:
    """Return the untrained decoder: a feature pyramid from 1/32 to 1/2 of the picture's size, four pixels at a time."""
    import torch
    from torch import nn
    from torch.nn import functional

    class Convolution(nn.Module):  # type: ignore[misc]
        def __init__(self, inputs: int, outputs: int, side: int = 3):
            super().__init__()
            self.kernel = nn.Conv2d(inputs, outputs, side, 1, side // 2, bias=False)
            self.norm = nn.BatchNorm2d(outputs)

        def forward(self, x: torch.Tensor) -> torch.Tensor:
            return torch.relu(self.norm(self.kernel(x)))

    class Decoder(nn.Module):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            inner = range(len(CHANNELS) - 1)
            self.lateral = nn.ModuleList(
                [Convolution(inputs, outputs, 1) for inputs, outputs in zip(SEEN.values(), CHANNELS, strict=True)]
            )
            self.top = Convolution(CHANNELS[-1], CHANNELS[-1])
            self.narrow = nn.ModuleList([nn.Conv2d(CHANNELS[level + 1], CHANNELS[level], 1) for level in inner])
            self.mix = nn.ModuleList(
                [
                    nn.ModuleList([Convolution(CHANNELS[level], CHANNELS[level]) for _ in range(MIXES)])
                    for level in inner
                ]
            )
            self.answer = nn.Conv2d(CHANNELS[0], 4, 3, 1, 1)

        def forward(self, seen: list[torch.Tensor]) -> torch.Tensor:
            y = self.top(self.lateral[-1](seen[-1]))
            for level in reversed(range(len(CHANNELS) - 1)):
                size = seen[level].shape[2:]
                y = functional.interpolate(self.narrow[level](y), size=size, mode="bilinear", align_corners=False)
                y = y + self.lateral[level](seen[level])
                for mix in self.mix[level]:
                    y = mix(y)
            return functional.pixel_shuffle(self.answer(y), 2)

    return Decoder()


def loss_of(answer: Any, truth: Any) -> Any:
    """Return the cross-entropy, weighted threefold along contours, plus one minus the soft IoU (Rahman and Wang 2016)."""
    import torch
    from torch.nn import functional

    each = functional.binary_cross_entropy_with_logits(answer, truth, reduction="none")
    outline = functional.max_pool2d(truth, 7, 1, 3) + functional.max_pool2d(-truth, 7, 1, 3)
    share = torch.sigmoid(answer)
    both = (share * truth).sum((1, 2, 3))
    either = (share + truth - share * truth).sum((1, 2, 3))
    return (each * (1 + 2 * outline)).mean() + (1 - (both + 1) / (either + 1)).mean()


def train(
    weights: Path, folders: list[Path], minutes: float, threads: int, begin: Path | None, seed: int
) -> dict[str, np.ndarray]:
    """Train for the given minutes, continuing from the weights ``begin`` if given, whose normalisation stays fixed.

    Returns the weights as float16, with batch normalisation folded in.
    """
    import torch
    from picture_variations import varied

    torch.manual_seed(seed)
    torch.set_num_threads(threads)
    rng = np.random.default_rng(seed)
    with np.load(weights) as arrays:
        encode = encoder(dict(arrays))
    pictures = [
        (np.load(folder / "rgb.npy", mmap_mode="r"), np.load(folder / "truth.npy", mmap_mode="r")) for folder in folders
    ]
    rows = [(folder, row) for folder, (rgb, _) in enumerate(pictures) for row in range(len(rgb))]
    net = decoder().to(memory_format=torch.channels_last)
    highest = RATE
    if begin is not None:
        highest = RATE_ON
        with np.load(begin) as arrays:
            state = unfolded(dict(arrays), {name: value.numpy() for name, value in net.state_dict().items()})
        net.load_state_dict({name: torch.from_numpy(value) for name, value in state.items()})
        net.eval()
    optimiser = torch.optim.AdamW(net.parameters(), lr=highest, weight_decay=1e-4)
    start, losses = time.monotonic(), []
    while (done := (time.monotonic() - start) / 60 / minutes) < 1:
        for group in optimiser.param_groups:
            group["lr"] = highest * min(1.0, len(losses) / 100 + 0.01) * 0.5 * (1 + math.cos(math.pi * done)) + 1e-6
        chosen = [rows[index] for index in rng.integers(0, len(rows), BATCH)]
        rgb, truth = (np.stack([pictures[folder][kind][row] for folder, row in chosen]) for kind in (0, 1))
        with torch.no_grad():
            x, target = varied(
                torch.from_numpy(rgb).permute(0, 3, 1, 2).float() / 255,
                torch.from_numpy(truth)[:, None].float() / 255,
                SIDE_PX,
            )
        picture = ((x * 255 - MEAN) / DEVIATION).contiguous(memory_format=torch.channels_last)
        with torch.autocast("cpu", dtype=torch.bfloat16):
            with torch.no_grad():
                seen = encode(picture)
            answer = net(seen)
        loss = loss_of(answer.float(), target)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
        if len(losses) % 100 == 0:
            print(f"{len(losses)} steps, loss {np.mean(losses[-100:]):.4f}", flush=True)
    return folded({name: value.numpy() for name, value in net.state_dict().items()})


def folded(state: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the weights by the names of ``manitwin.models.matting.object_network``, with batch normalisation folded in."""
    weights: dict[str, np.ndarray] = {}
    for name, value in state.items():
        layer, _, kind = name.rpartition(".")
        if layer.endswith(".kernel"):
            norm, out = layer.replace(".kernel", ".norm"), _named(layer.removesuffix(".kernel"))
            gain = state[f"{norm}.weight"] / np.sqrt(state[f"{norm}.running_var"] + 1e-5)
            weights[f"{out}.weight"] = value * gain[:, None, None, None]
            weights[f"{out}.bias"] = state[f"{norm}.bias"] - state[f"{norm}.running_mean"] * gain
        elif not layer.endswith(".norm"):
            weights[f"{_named(layer)}.{kind}"] = value
    return {name: value.astype(np.float16) for name, value in weights.items()}


def unfolded(weights: dict[str, np.ndarray], state: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the ``state`` of an untrained decoder with these weights, its normalisation reduced to adding biases."""
    state = {name: value.copy() for name, value in state.items()}
    for name in state:
        layer, _, kind = name.rpartition(".")
        if layer.endswith(".kernel"):
            state[name] = weights[f"{_named(layer.removesuffix('.kernel'))}.weight"].astype(np.float32)
        elif layer.endswith(".norm"):
            if kind == "bias":
                state[name] = weights[f"{_named(layer.removesuffix('.norm'))}.bias"].astype(np.float32)
            elif kind == "running_var":
                state[name] = np.full_like(state[name], 1 - 1e-5)
        else:
            state[name] = weights[f"{_named(layer)}.{kind}"].astype(np.float32)
    return state


def _named(layer: str) -> str:
    """Return ``mix2.1`` for ``mix.2.1``."""
    kind, _, number = layer.partition(".")
    return kind + number


def main() -> None:
    """Write the encoder's weights, draw pictures, or train."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    encoding = commands.add_parser("encoder")
    encoding.add_argument("out", type=Path)
    drawing = commands.add_parser("draw")
    drawing.add_argument("folder", type=Path)
    drawing.add_argument("--first", type=int, default=0)
    drawing.add_argument("--count", type=int, default=2500)
    training = commands.add_parser("train")
    training.add_argument("encoder", type=Path)
    training.add_argument("folders", type=Path, nargs="+")
    training.add_argument("-o", "--out", type=Path, required=True)
    training.add_argument("--minutes", type=float, default=60)
    training.add_argument("--threads", type=int, default=2)
    training.add_argument("--seed", type=int, default=0)
    training.add_argument("--begin", type=Path, help="weights to go on from")
    given = parser.parse_args()
    if given.command == "encoder":
        from manitwin.models.classifiers.efficientnet_lite import load_weights

        np.savez(given.out, **load_weights())
    elif given.command == "draw":
        draw(given.folder, given.first, given.count)
    else:
        weights = train(given.encoder, given.folders, given.minutes, given.threads, given.begin, given.seed)
        np.savez_compressed(given.out, **weights)


if __name__ == "__main__":
    main()
