"""Assets of other tools, and our own exports of nine formats: read, imported and audited."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import trimesh
from fuzz_meshes import USDA, picture
from fuzz_target import Case, target

import foreign_assets
from exported_twins import content
from manitwin.assets.audit.check import audit_asset
from manitwin.assets.audit.rules import RULES
from manitwin.assets.importers.conversion import imported_files
from manitwin.assets.read import detect, find_assets, read_asset
from manitwin.assets.writers.write import export_twin


def read(case: Case) -> None:
    """Find and read the asset, and make of it what a build would take."""
    for path in find_assets(case.folder):
        detect(path)
        asset = read_asset(path)
        imported_files(asset)


def audit(case: Case) -> None:
    for path in find_assets(case.folder):
        audit_asset(read_asset(path), RULES)


def exported(format: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        twin = folder.parent / f"twin-{format}"
        export_twin(content(twin), format, folder)
        shutil.rmtree(twin)

    return make


def mug_urdf(folder: Path) -> None:
    foreign_assets.mug_urdf(folder)


def usd(folder: Path) -> None:
    """Our own export, and one stage of text: a table with a mass, a collider and a reference to a file beside it."""
    (folder / "made").mkdir()
    exported("usd")(folder / "made")
    (folder / "text").mkdir()
    (folder / "text" / "part.usda").write_text(USDA)
    (folder / "text" / "skin.png").write_bytes(picture())
    (folder / "text" / "table.usda").write_text(TABLE)


TABLE = """#usda 1.0
(
    defaultPrim = "table"
    metersPerUnit = 1
    kilogramsPerUnit = 1
    upAxis = "Z"
)
def Xform "table" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
{
    float physics:mass = 0.5
    point3f physics:centerOfMass = (0, 0, 0.1)
    float3 physics:diagonalInertia = (0.01, 0.01, 0.02)
    def Cube "top" (prepend apiSchemas = ["PhysicsCollisionAPI"])
    {
        double size = 1
        double3 xformOp:scale = (0.5, 0.3, 0.02)
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }
    def Mesh "leg" (prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"])
    {
        uniform token physics:approximation = "convexHull"
        int[] faceVertexCounts = [3, 3, 3, 3]
        int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]
        point3f[] points = [(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.2)]
    }
    def Xform "more" (references = @part.usda@</root>)
    {
    }
}
"""


def box_urdf(folder: Path) -> None:
    """A box and its hull: an asset that is quick to measure, also where a link of it is there 2,000 times."""
    foreign_assets.mug_urdf(folder)
    trimesh.creation.box([0.1, 0.2, 0.3]).export(folder / "mug.stl")


TEXTS = ("*.urdf", "*.xml", "*.sdf", "*.config", "*.json", "*.pbtxt", "*.usda", "*.usd", "*.mtl", "*.toml")
for name in ("urdf", "mjcf", "sdf", "robotwin"):
    target(f"asset-{name}", exported(name), read, files=TEXTS, weight=0.3)
target("asset-usd", usd, read, files=("*.usda", "*.usd", "*.usdc"), weight=0.3)
target("asset-own-urdf", mug_urdf, read, files=TEXTS)
target("asset-manitwin100k", foreign_assets.manitwin100k, read, files=TEXTS, weight=0.5)
target("asset-gso", foreign_assets.gso, read, files=TEXTS, weight=0.5)
target("asset-embodiedgen", foreign_assets.embodiedgen, read, files=TEXTS, weight=0.5)
target("asset-meshes", exported("urdf"), read, files=("*.obj", "*.glb", "*.stl", "*.dae"), weight=0.3)
target("audit", box_urdf, audit, files=TEXTS, weight=0.2)
