"""Settings of the images that an annotator sees: views of the object, and candidate points on it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manitwin.config.section import Section

Elevation = Annotated[float, Field(ge=-80, le=80)]


class ViewsConfig(Section):
    """The eight views of the object (paper, "Physical Property Estimation"). No ``size_px``: the size the annotator reads best.

    ``elevations_deg`` are the camera elevations of the eight views, which are evenly spaced in azimuth. ``fov_y_deg`` is the
    field of view along the longer side of an image; ``size_px`` squared is about its number of pixels.
    """

    size_px: int | None = Field(default=None, ge=64, le=4096)
    fov_y_deg: float = Field(default=30.0, gt=1, lt=120)
    elevations_deg: tuple[Elevation, Elevation, Elevation, Elevation, Elevation, Elevation, Elevation, Elevation] = (
        20.0,
        50.0,
        20.0,
        -35.0,
        20.0,
        65.0,
        20.0,
        -35.0,
    )
    webp_quality: int = Field(default=90, ge=1, le=100)


class CandidatesConfig(Section):
    """Candidate points and the images that show them (paper, "Candidate Point Sampling")."""

    samples: int = Field(default=8_000, ge=1000)
    count: int = Field(default=42, ge=4, le=99)
    webp_quality: int = Field(default=90, ge=1, le=100)
