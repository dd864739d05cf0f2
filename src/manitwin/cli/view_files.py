"""The files by which a view is given to ``manitwin locate``: checked against each other and the other options, then read."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from manitwin.errors import UsageError

if TYPE_CHECKING:
    import numpy as np

    from manitwin.scenes.locate.depth_view import DepthView


@dataclass(frozen=True)
class ViewFiles:
    """The options that name a file: pictures of a depth camera and what belongs to them, or the ``cloud`` of one thing."""

    depth: Path | None = None
    camera: Path | None = None
    mask: Path | None = None
    rgb: Path | None = None
    cloud: Path | None = None
    base: Path | None = None

    def with_captured(self, folder: Path) -> ViewFiles:
        """Return these files, and of a captured folder those that are not given; raises UsageError beside a cloud."""
        from manitwin.scenes.locate.capture_folder import capture_files

        if self.cloud is not None:
            raise UsageError("--cloud: cannot be combined with --view; leave out --view")
        there = capture_files(folder)
        return replace(
            self,
            depth=self.depth or there.get("depth"),
            camera=self.camera or there.get("camera"),
            rgb=self.rgb or there.get("rgb"),
            base=self.base or there.get("base"),
        )

    def check(self, *, grasps: bool, robot: str | None) -> None:
        """Raise UsageError where files are missing, or do not go together or with the other options."""
        if self.cloud is not None:
            self._check_alone(grasps)
        if robot is not None and self.base is None:
            raise UsageError(
                "--robot: its reach depends on the pose of its base; give the camera calibration with --base"
            )
        needed = {"--depth": self.depth, "--camera": self.camera}
        if self.cloud is None and (missing := [name for name, file in needed.items() if file is None]):
            raise UsageError(f"{', '.join(missing)}: missing; give --depth and --camera, or --cloud")

    def _check_alone(self, grasps: bool) -> None:
        if any(file is not None for file in (self.depth, self.camera, self.mask, self.rgb)):
            raise UsageError("--cloud: cannot be combined with images; leave out --depth, --camera, --mask and --rgb")
        if grasps or self.base is not None:
            raise UsageError(
                f"{'--grasps' if grasps else '--base'}: a point cloud of the object alone does not show its surroundings; give"
                " --depth and --camera"
            )

    def read(self, seed: int) -> tuple[DepthView, list[np.ndarray]]:
        """Return the view, and the masks ``(H, W) bool`` of the things in it: without a mask, of all that stands on the table.

        Raises UsageError for a file that cannot be used, and a mask that shows nothing.
        """
        import numpy as np

        from manitwin.scenes.locate.input_files import read_cloud, read_view
        from manitwin.scenes.locate.proposals import proposals, table_plane

        if self.cloud is not None:
            view, shown = read_cloud(self.cloud)
            return view, [shown]
        assert self.depth is not None and self.camera is not None, "checked before"
        view, told = read_view(self.depth, self.camera, self.rgb, self.mask)
        if told is None:
            return view, proposals(view, table_plane(view, np.random.default_rng(seed)))
        if not told.any():
            raise UsageError(f"{self.mask}: the mask is empty; give a mask of the object to locate")
        return view, [told]
