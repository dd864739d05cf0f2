"""The pictures that an annotator sees: of the object, and of candidate points on it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manitwin.config.section import Section

Elevation = Annotated[float, Field(ge=-80, le=80)]


class ViewsConfig(Section):
    """The eight pictures of the object (paper, "Physical Property Estimation"); no size: the one the annotator reads best.

    ``elevations_deg`` are the heights that they are seen from, one by one around the object; ``fov_y_deg`` is the angle of a
    picture's longer side, ``size_px`` squared about its pixels.
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
    """The candidate points and the pictures that show them (paper, "Candidate Point Sampling")."""

    samples: int = Field(default=8_000, ge=1000)
    count: int = Field(default=42, ge=4, le=99)
    webp_quality: int = Field(default=90, ge=1, le=100)
