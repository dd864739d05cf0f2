"""Messages about a listed input folder: counts of files by class, and reasons for ignored files."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

from manitwin.formats.sniff import ASSET_DESCRIPTION
from manitwin.formats.source_files import IMAGE_SUFFIXES, MESH_SUFFIXES

_NAMES_SHOWN = 3


def listing_remarks(
    folder: Path,
    inputs: tuple[Path, ...],
    parts: dict[Path, Path],
    left: dict[Path, str],
    beside_meshes: tuple[Path, ...],
) -> list[str]:
    """Return a line of counts that add up to all files, then one line per reason; empty if every file is an input of its own."""
    if not (parts or left or beside_meshes):
        return []
    masks = [part for part, whole in parts.items() if whole.suffix.lower() in IMAGE_SUFFIXES]
    assets = {whole for whole in parts.values() if whole.suffix.lower() not in MESH_SUFFIXES | IMAGE_SUFFIXES}
    of_assets = sum(whole in assets for whole in parts.values())
    of_meshes = len({whole for whole in parts.values() if whole.suffix.lower() in MESH_SUFFIXES})
    counts = [f"{_counted(len(inputs), 'input')}{_kinds(inputs, assets)}"]
    if of_meshes:
        textures = _counted(
            len(parts) - of_assets - len(masks), "texture and material file", "textures and material files"
        )
        counts.append(f"{textures} of {_counted(of_meshes, 'mesh', 'meshes')}")
    if assets:
        counts.append(f"{_counted(of_assets, 'file')} of {_counted(len(assets), 'imported asset')}")
    if masks:
        counts.append(f"{_counted(len(masks), 'mask')} of the photo{'s' if len(masks) > 1 else ''} beside")
    if left:
        counts.append(f"{len(left)} left alone")
    total = _counted(len(inputs) + len(parts) + len(left), "file")
    lines = [f"{folder}: {total}: {', '.join(counts)}"]
    described = sum(reason == ASSET_DESCRIPTION for reason in left.values())
    meshes = sum(path.suffix.lower() in MESH_SUFFIXES and path not in assets for path in inputs)
    if described and meshes:
        own = "mesh is a thing of its own" if meshes == 1 else "meshes are things of their own"
        lines.append(
            f"{folder}: `manitwin import` makes one input of each of {_counted(described, 'asset description')} with its meshes;"
            f" here {meshes} {own}, also what only collides"
        )
    if beside_meshes:
        one = len(beside_meshes) == 1
        lines.append(
            f"{folder}: {_counted(len(beside_meshes), 'image')} beside a mesh, named by none,"
            f" {'is an input' if one else 'are inputs'} of {'its' if one else 'their'} own: {_some(folder, beside_meshes)}"
        )
    by_reason: dict[str, list[Path]] = defaultdict(list)
    for path, reason in left.items():
        by_reason[reason].append(path)
    lines += [f"{folder}: left alone: {_some(folder, paths)}: {reason}" for reason, paths in by_reason.items()]
    return lines


def _kinds(inputs: tuple[Path, ...], assets: set[Path]) -> str:
    meshes = sum(path.suffix.lower() in MESH_SUFFIXES and path not in assets for path in inputs)
    imported = sum(path in assets for path in inputs)
    images = len(inputs) - meshes - imported
    said = [
        _counted(count, one, many)
        for count, one, many in (
            (meshes, "mesh", "meshes"),
            (images, "image", "images"),
            (imported, "imported asset", "imported assets"),
        )
        if count
    ]
    return f" ({', '.join(said)})" if said else ""


def _counted(count: int, one: str, many: str = "") -> str:
    return f"{count} {one if count == 1 else many or one + 's'}"


def _some(folder: Path, paths: Iterable[Path]) -> str:
    names = [str(path.relative_to(folder)) for path in paths]
    shown = ", ".join(names[:_NAMES_SHOWN])
    return shown if len(names) <= _NAMES_SHOWN else f"{len(names)} files ({shown}, ...)"
