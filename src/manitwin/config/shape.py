"""Settings of the mesh stages: repair, limits, physical properties, convex hulls and placements."""

from __future__ import annotations

from pydantic import Field

from manitwin.config.section import Section


class RepairConfig(Section):
    """Limits of mesh repair (``geometry.repair``); shares are relative to the diagonal of the bounding box."""

    weld_tolerance: float = Field(default=1e-4, gt=0, lt=0.01)
    lid_length: float = Field(default=0.15, gt=0)
    lid_area_share: float = Field(default=0.02, ge=0, le=1)
    wall_share: float = Field(default=0.01, gt=0, lt=0.1)
    min_wall_m: float = Field(default=1e-3, ge=0)


class MeshConfig(Section):
    """Limits on the size of a mesh file and of its textures."""

    max_bytes: int = Field(default=1 << 30, gt=0, le=1 << 40)
    max_faces: int = Field(default=4_000_000, gt=0)
    max_texture_pixels: int = Field(default=1 << 26, gt=0)
    max_texture_size: int = Field(default=2048, ge=16)
    repair: RepairConfig = RepairConfig()


class GateConfig(Section):
    """Limits beyond which an input is rejected (paper, "Quality Verification"); shares of the bounding box's diagonal unless
    noted.
    """

    min_longest_side_m: float = Field(default=0.005, gt=0)
    max_longest_side_m: float = Field(default=1.0, gt=0)
    min_thickness_share: float = Field(default=1e-4, ge=0)
    max_gap_share: float = Field(default=0.02, ge=0)
    object_share: float = Field(default=0.05, gt=0, le=1)  # of the summed area or hull volume; smaller parts are specks


class PhysicalConfig(Section):
    """Plausible limits of size, mass and density; the margins are factors that widen the prior's interval."""

    size_margin: float = Field(default=2.0, ge=1)
    max_longest_side_m: float = Field(default=1.0, gt=0)  # of what is scaled; of other things the gate's
    mass_margin: float = Field(default=2.0, ge=1)
    min_density_kg_m3: float = Field(default=2.0, ge=0)  # expanded foam: 10 and more
    max_density_kg_m3: float = Field(default=23_000.0, gt=0)  # osmium: 22,590
    max_texture_size: int = Field(default=2048, ge=16)


class CollisionConfig(Section):
    """Convex decomposition for collision (at most 32 hulls of at most 64 vertices: the limits of PhysX)."""

    max_hulls: int = Field(default=32, ge=1, le=32)
    max_vertices: int = Field(default=64, ge=8, le=64)
    oversplit: float = Field(default=1.5, ge=1, le=4)
    error_samples: int = Field(default=4000, ge=500)
    least_cavity_kept: float = Field(default=0.75, gt=0, le=1)


class PlacementConfig(Section):
    """Simulated placements of the object, and the limits within which it counts as stable (2 s, 1 cm, 5 degrees).

    ``tilt_rise_m`` is the least rise of the centre of mass on tilting by ``max_turned_deg``. Measured on 120 quasi-static poses
    of 25 objects released 1 mm above the ground in MuJoCo: 13 of the 27 poses below 0.08 mm turned by more than 5 degrees, none
    of the 93 above it.
    """

    max_placements: int = Field(default=6, ge=1, le=20)
    least_probability: float = Field(default=0.02, ge=0, lt=1)
    merge_deg: float = Field(default=12.0, gt=0, lt=45)
    tilt_rise_m: float = Field(default=8e-5, ge=0, le=0.01)
    drop_m: float = Field(default=0.001, ge=0, le=0.05)
    seconds: float = Field(default=2.0, gt=0, le=20)
    max_moved_m: float = Field(default=0.01, gt=0)
    max_turned_deg: float = Field(default=5.0, gt=0, lt=90)
