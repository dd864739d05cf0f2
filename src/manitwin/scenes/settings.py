"""Settings of layouts: frozen sections like those of a build."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from manitwin.config import RunConfig, Section, Seed


def application_run() -> RunConfig:
    """Return the run settings of an application, which keeps neither index tables nor results of single stages."""
    return RunConfig(index_every=0, keep_work=False)


MOST_OBJECTS = 200
Count = Annotated[int, Field(le=MOST_OBJECTS)]


class LayoutSettings(Section):
    """Settings of a layout: its objects, their density, and the limits while settling (metres, seconds, degrees).

    ``objects`` is the least and largest number. ``include`` names required categories, one object for each mention; the others
    are distractors. ``stacked`` objects stand on others, ``contained`` ones lie in a container. Without ``min_gap_m``, the gap
    is that of the clutter level. ``upright``: twins with a settled upright placement are placed in one, others as they rest.
    ``workspace`` is the region that the named robot, or any robot, reaches from above: least and largest radius about the
    origin, and half of the angle about +X. ``poses_tried`` limits the positions tried for an object, ``repairs`` the number of
    objects that are sampled again before the layout is rejected.
    """

    objects: tuple[Count, Count] = (3, 12)
    surface: Literal["table", "shelf", "tray"] = "table"
    clutter: Literal["sparse", "medium", "dense"] = "medium"
    min_gap_m: float | None = Field(default=None, ge=0.001, le=0.5)
    include: tuple[str, ...] = ()
    stacked: int = Field(default=0, ge=0, le=MOST_OBJECTS)
    contained: int = Field(default=0, ge=0, le=MOST_OBJECTS)
    upright: bool = False
    robot: str | None = None
    workspace: tuple[float, float, float] | None = None
    poses_tried: int = Field(default=120, ge=1)
    repairs: int = Field(default=12, ge=0)
    settle_s: float = Field(default=3.0, gt=0, le=20)
    max_moved_m: float = Field(default=0.01, gt=0)
    max_turned_deg: float = Field(default=5.0, gt=0, lt=90)
    max_penetration_m: float = Field(default=0.001, gt=0)

    @model_validator(mode="after")
    def _possible(self) -> LayoutSettings:
        low, high = self.objects
        if not 1 <= low <= high:
            raise ValueError(f"objects is the least and the largest number, at least 1; it is {low} to {high}")
        needed = self.least_standing + self.stacked + self.contained
        if needed > high:
            raise ValueError(f"include, stacked and contained ask for {needed} objects or more; objects allows {high}")
        if self.workspace is not None:
            near, far, half_deg = self.workspace
            if not (0 <= near < far and 0 < half_deg <= 180):
                raise ValueError(
                    f"workspace is least radius, largest radius (m), half angle (deg); it is {self.workspace}"
                )
        return self

    @property
    def least_standing(self) -> int:
        """The least number of objects on the furniture: required objects, one below each stacked object, one container."""
        return max(len(self.include), self.stacked + min(self.contained, 1), 1)


class LayoutsConfig(Section):
    """All settings that determine layouts. ``pictures``: also render colour, depth, normals and ids from each camera."""

    seed: Seed = 0
    layout: LayoutSettings = LayoutSettings()
    pictures: bool = False
    picture_px: int = Field(default=512, ge=64, le=2048)
    run: RunConfig = Field(default_factory=application_run)
