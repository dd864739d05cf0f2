"""USD export: one stage in the binary form with its textures beside it, or everything in one USDZ package."""

from __future__ import annotations

import io
import struct
import zipfile
from dataclasses import replace

from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.format_notes import FormatNotes
from manitwin.assets.writers.simready import thumbnail
from manitwin.assets.writers.usd_stage import CANNOT_SAY, OF_JOINTS, build_stage, crate

_ALIGNMENT = 64  # USDZ specification, "Layout": file data starts at a multiple of 64 bytes
_HEADER = 30  # ZIP APPNOTE 4.3.7: size of a local header without name and extra field
_PADDING_ID = 0x1986  # the extra field that Pixar's own writer uses for padding
_OF_LINKS = ("mass", "centre of mass", "inertia")
_LOAD_LINKS = (
    "from pxr import Usd, UsdPhysics\n\n"
    'stage = Usd.Stage.Open("{main}")\n'
    "for prim in stage.Traverse():\n"
    "    if prim.HasAPI(UsdPhysics.RigidBodyAPI) or prim.IsA(UsdPhysics.Joint):\n"
    "        print(prim.GetPath(), prim.GetTypeName())"
)
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest date of a ZIP entry: equal twins give equal packages


def export(twin: TwinContent) -> Exported:
    """Return the stage and its textures as files; ``usdcat`` shows the stage as text."""
    stage, textures = build_stage(twin)
    main = f"{twin.name}.usdc"
    return _exported({main: crate(stage.GetRootLayer()), **textures, **thumbnail(twin, main)}, main, twin, "usd")


def export_usdz(twin: TwinContent) -> Exported:
    """Return a USDZ package: the stage in USD's binary form first, then the textures, without compression or dates."""
    stage, textures = build_stage(twin)
    main = f"{twin.name}.usdz"
    members = {f"{twin.name}.usdc": crate(stage.GetRootLayer()), **dict(sorted(textures.items()))}
    return _exported({main: _packed(members)}, main, twin, "usdz")


def _exported(files: dict[str, bytes], main: str, twin: TwinContent, format_name: str) -> Exported:
    """Return the export of files, with notes on the mass properties of each link for an articulated twin."""
    if not twin.record.links:
        return Exported(files, main, CANNOT_SAY, joints=True)
    notes = FormatNotes.of(format_name)
    says = {what: f"{where}, of each link" if what in _OF_LINKS else where for what, where in notes.says.items()}
    load = notes.load | {"OpenUSD": _LOAD_LINKS}
    return Exported(files, main, (*CANNOT_SAY, *OF_JOINTS), notes=replace(notes, says=says, load=load), joints=True)


def _packed(members: dict[str, bytes]) -> bytes:
    """Return a USDZ package with the members in the given order."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        for name, data in members.items():
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.create_system = 3  # also on Windows
            unpadded = stream.tell() + _HEADER + len(name.encode()) + 4
            padding = -unpadded % _ALIGNMENT
            entry.extra = struct.pack("<HH", _PADDING_ID, padding) + b"\0" * padding
            archive.writestr(entry, data)
    return stream.getvalue()
