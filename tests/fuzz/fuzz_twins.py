"""Finished twins that somebody has changed: their record, grasps, hulls, looks, and scenes of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from fuzz_target import Case, target

from exported_twins import write_rejected, write_twin
from manitwin.assets.readers.twin import read as read_as_asset
from manitwin.assets.writers.exporter import TwinContent
from manitwin.assets.writers.write import export_twin
from manitwin.cli.documents import show_document
from manitwin.scenes.layouts.pool import read_pool
from manitwin.scenes.layouts.sample import sample_layout
from manitwin.scenes.loaded_scene import Scene
from manitwin.scenes.scene_files import write_scene
from manitwin.scenes.settings import LayoutSettings
from manitwin.twin.import_record import read_import_record
from manitwin.twin.loaded_twin import Twin
from scene_twins import slab, write_thing


def twin(folder: Path) -> None:
    write_twin(folder / "twin")
    write_rejected(folder / "rejected")


def load(case: Case) -> None:
    """Load a twin as programs do."""
    folder = case.folder / case.file.relative_to(case.folder).parts[0]
    loaded = Twin(folder)
    show_document(loaded)
    if loaded.record.status == "accepted":
        for part in loaded.visual:
            assert np.isfinite(part.vertices).all()
        loaded.rigid_body()
        loaded.grasps(verified_only=False)


def verify(case: Case) -> None:
    Twin(case.folder / case.file.relative_to(case.folder).parts[0], verify=True)


def export(case: Case) -> None:
    content = TwinContent.of(Twin(case.folder / "twin"))
    for name in ("urdf", "mjcf"):
        export_twin(content, name, case.folder / "out")


def as_asset(case: Case) -> None:
    read_as_asset(case.folder / "twin")


def import_record(folder: Path) -> None:
    from foreign_assets import mug_urdf
    from manitwin.assets.importers.importer import import_assets

    path = mug_urdf(folder.parent / "given")
    for each in import_assets([path], folder):
        assert each.folder is not None


def scene(folder: Path) -> None:
    for number, thing in enumerate((slab("box", 0.12, 0.08, 0.06), slab("board", 0.2, 0.1, 0.02))):
        write_thing(folder, number, thing)
    record = sample_layout(read_pool(folder), LayoutSettings(objects=(2, 2)), 1, 0)
    write_scene(record, folder / "scenes" / "0")


def load_scene(case: Case) -> None:
    place = Scene.read(case.folder / "scenes" / "0", case.folder)
    place.placed_objects()
    place.static_boxes()


FILES = ("*.json", "*.parquet", "*.obj", "*.glb")
target("twin", twin, load, files=FILES)
target("twin-verify", twin, verify, files=FILES)
target("twin-export", twin, export, files=FILES, fresh=True, weight=0.2)
target("twin-asset", twin, as_asset, files=FILES, weight=0.5)
target("import-record", import_record, lambda case: read_import_record(case.file), files=("import.json",))
target("scene", scene, load_scene, files=("scene.json", "twin.json", "*.obj"), weight=0.5)
target("pool", scene, lambda case: read_pool(case.folder), files=("twin.json",), weight=0.5)
