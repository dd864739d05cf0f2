"""GLB export: the visual mesh of the twin, and its hulls in a second file with the physical properties in ``asset.extras``.

glTF 2.0 has no ratified extension for rigid bodies (KHR_physics_rigid_bodies is a draft). It leaves extras to applications
(section 3.3), and provides ``asset.copyright`` for the licence (section 5.9).
"""

from __future__ import annotations

from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.licenses import license_of
from manitwin.assets.writers.mass_properties import physics_of
from manitwin.assets.writers.mesh_files import hulls_of
from manitwin.formats.glb import pack_glb, unpack_glb, write_glb
from manitwin.formats.markdown import one_line
from manitwin.formats.meshes.textures import make_part, pbr_material

FRAME = (
    "numbers here: right-handed, +Z up, origin at the bottom centre, quaternions wxyz; "
    "(x, y, z) of it is (x, z, -y) of this file's meshes"
)


def export(twin: TwinContent) -> Exported:
    """Write a twin as two Y-up GLB files. Raises ExportError for mass properties that are impossible for a rigid body."""
    grey = pbr_material("hull", base_color=(0.5, 0.5, 0.5))
    hulls = [
        make_part(vertices, faces, material=grey, name=f"{twin.name}_hull_{i:02d}")
        for i, (vertices, faces) in enumerate(hulls_of(twin))
    ]
    credit = one_line(twin.record.source.attribution or "")
    asset = {
        "copyright": f"{license_of(twin.record)}{', ' if credit else ''}{credit}",
        "extras": {"manitwin_physics": {**physics_of(twin), "frame": FRAME}},
    }
    tree, binary = unpack_glb(write_glb(hulls))
    tree["asset"] |= asset
    return Exported(
        files={"visual.glb": twin.visual_glb, "collision.glb": pack_glb(tree, binary)},
        main="visual.glb",
        cannot_say=(
            "mass, centre of mass, inertia and friction: glTF has none; collision.glb has them in asset.extras.",
            "which meshes collide, and that they are convex: every mesh of collision.glb is one convex hull.",
        ),
    )
