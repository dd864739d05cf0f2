"""A stand-in for the module ``pyrealsense2``: what is used of it, with one camera or a recorded file, and what it was asked."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

FRAMES_OF_A_FILE = 4


@dataclass
class FakeRealSense:
    """Depths are ``number`` in all pixels but one column (unknown in every second frame) and a corner (never known)."""

    number: int = 700
    coeffs: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    plugged_in: bool = True
    size: tuple[int, int] = (64, 48)
    calls: list[str] = field(default_factory=list)
    stream: Any = field(default_factory=lambda: SimpleNamespace(depth="depth", color="color"))
    format: Any = field(default_factory=lambda: SimpleNamespace(z16="z16", rgb8="rgb8"))
    camera_info: Any = field(default_factory=lambda: SimpleNamespace(name="name"))

    def pipeline(self) -> _Pipeline:
        return _Pipeline(self)

    def config(self) -> _Config:
        return _Config(self)

    def align(self, stream: str) -> Any:
        assert stream == "color"
        return SimpleNamespace(process=lambda frames: frames)


@dataclass
class _Config:
    rs: FakeRealSense
    file: str | None = None

    def enable_stream(self, stream: str, width: int, height: int, form: str, rate: int) -> None:
        self.rs.calls.append(f"{stream} {form}")

    def enable_device(self, serial: str) -> None:
        self.rs.calls.append(f"serial {serial}")

    def enable_device_from_file(self, path: str, repeat_playback: bool = True) -> None:
        assert repeat_playback is False, "a file that begins anew never ends"
        self.file = path


@dataclass
class _Pipeline:
    rs: FakeRealSense
    left: int | None = None
    told: int = 0

    def start(self, config: _Config) -> Any:
        if config.file is None and not self.rs.plugged_in:
            raise RuntimeError("No device connected")
        if config.file is not None:
            if not Path(config.file).read_bytes().startswith(b"#ROSBAG"):
                raise RuntimeError("Failed to resolve request")
            self.left = FRAMES_OF_A_FILE
        sensor = SimpleNamespace(get_depth_scale=lambda: 0.001)
        device = SimpleNamespace(first_depth_sensor=lambda: sensor, get_info=lambda what: "Intel RealSense D435")
        return SimpleNamespace(get_device=lambda: device)

    def wait_for_frames(self) -> Any:
        if self.left is not None:
            if not self.left:
                raise RuntimeError("Frame didn't arrive within 5000")
            self.left -= 1
        self.told += 1
        width, height = self.rs.size
        depth = np.full((height, width), self.rs.number, np.uint16)
        depth[:, 3] = 0 if self.told % 2 else self.rs.number
        depth[0, 0] = 0
        color = np.zeros((height, width, 3), np.uint8)
        color[..., 0] = self.told
        lens = SimpleNamespace(
            fx=60.0, fy=60.0, ppx=31.5, ppy=23.5, width=width, height=height, coeffs=list(self.rs.coeffs)
        )
        profile = SimpleNamespace(as_video_stream_profile=lambda: SimpleNamespace(intrinsics=lens))
        return SimpleNamespace(
            get_depth_frame=lambda: SimpleNamespace(get_data=lambda: depth),
            get_color_frame=lambda: SimpleNamespace(get_data=lambda: color, profile=profile),
        )

    def stop(self) -> None:
        self.rs.calls.append("stop")
