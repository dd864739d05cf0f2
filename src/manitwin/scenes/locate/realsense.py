"""Capture from an Intel RealSense camera, or from a recording of one, by ``pyrealsense2`` if installed.

Written from the documentation of librealsense 2.5x (pipeline, align, ``enable_device_from_file``), and tested against a
stand-in for the used functions only, never against a camera.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.errors import Unavailable, UsageError
from manitwin.scenes.locate.capture_folder import Capture

WIDTH_PX, HEIGHT_PX, RATE_HZ = 640, 480, 30
FRAMES = 15
"""Number of frames, half a second, of which depths are the medians: this removes pixel noise and keeps edges."""
WARM_UP = 30
"""Frames until the exposure settles; skipped for a recorded file."""
MOST_DISTORTION_PX = 1.5
"""Largest distortion at a corner; only pinhole cameras are supported."""


def sdk() -> Any:
    """Return the module; raises UsageError if it is not installed."""
    try:
        return importlib.import_module("pyrealsense2")
    except ImportError as error:
        raise UsageError(
            f"pyrealsense2 cannot be imported ({error}); pip install pyrealsense2, or give a layout's scene"
        ) from error


def capture_view(rs: Any, *, bag: Path | None = None, serial: str | None = None, frames: int = FRAMES) -> Capture:
    """Return the current view of a camera, or the start of a recorded ``bag``, with depths aligned to the colours.

    ``rs`` is the module; ``serial`` selects one of several cameras. Raises Unavailable if there is no camera, no frame arrives
    or the file cannot be played, UsageError for a lens with distortion.
    """
    pipeline, config = rs.pipeline(), rs.config()
    if bag is not None:
        config.enable_device_from_file(str(bag), repeat_playback=False)
    else:
        if serial is not None:
            config.enable_device(serial)
        config.enable_stream(rs.stream.depth, WIDTH_PX, HEIGHT_PX, rs.format.z16, RATE_HZ)
        config.enable_stream(rs.stream.color, WIDTH_PX, HEIGHT_PX, rs.format.rgb8, RATE_HZ)
    try:
        profile = pipeline.start(config)
    except RuntimeError as error:
        raise Unavailable(f"realsense: cannot start ({error}); connect a camera, or give a recorded file") from error
    try:
        device = profile.get_device()
        unit_m = float(device.first_depth_sensor().get_depth_scale())
        name = str(device.get_info(rs.camera_info.name))
        align, rgb, lens = rs.align(rs.stream.color), None, None
        depths: list[np.ndarray] = []
        for _ in range(0 if bag is not None else WARM_UP):
            pipeline.wait_for_frames()
        while len(depths) < frames:
            try:
                both = align.process(pipeline.wait_for_frames())
            except RuntimeError as error:  # the end of a file, or no frame within five seconds
                if depths:
                    break
                raise Unavailable(
                    f"realsense: no frame received ({error}); check the camera in realsense-viewer"
                ) from error
            depth, color = both.get_depth_frame(), both.get_color_frame()
            if depth and color:
                depths.append(np.asanyarray(depth.get_data()).astype(float))
                rgb, lens = np.array(color.get_data(), np.uint8), color.profile.as_video_stream_profile().intrinsics
    finally:
        pipeline.stop()
    assert rgb is not None and lens is not None
    return Capture(_median(np.array(depths)) * unit_m, unit_m, _intrinsics(lens), rgb, f"{name} by pyrealsense2")


def _median(depths: np.ndarray) -> np.ndarray:
    """Return the median ``(H, W)`` of the known depths of frames ``(N, H, W)``; 0 if fewer than half have one."""
    known = np.ma.masked_equal(depths, 0)
    told = np.ma.median(known, axis=0).filled(0)
    return np.where((depths > 0).sum(0) * 2 >= len(depths), told, 0.0)


def _intrinsics(lens: Any) -> np.ndarray:
    """Return K ``(3, 3)``, with pixel centres at whole numbers as in librealsense; raises UsageError for a distorted picture."""
    k = np.array([[lens.fx, 0, lens.ppx], [0, lens.fy, lens.ppy], [0, 0, 1.0]])
    coefficients = np.zeros(5)
    coefficients[: len(lens.coeffs)] = lens.coeffs
    x, y = max(lens.ppx, lens.width - lens.ppx) / lens.fx, max(lens.ppy, lens.height - lens.ppy) / lens.fy
    r2 = np.linspace(0, x * x + y * y, 20)  # Brown and Conrady's terms may cancel at the corner alone
    k1, k2, p1, p2, k3 = coefficients
    radial = np.abs(k1 * r2 + k2 * r2**2 + k3 * r2**3) * np.sqrt(r2)
    bent_px = float((lens.fx * (radial + (abs(p1) + abs(p2)) * 3 * r2)).max())
    if bent_px > MOST_DISTORTION_PX:
        raise UsageError(
            f"realsense: its lens distorts the picture by up to {bent_px:.1f} px, but at most {MOST_DISTORTION_PX}"
            f" px are supported; rectify colour and depth images, and pass them to manitwin locate by --depth,"
            f" --rgb and --camera"
        )
    return k
