"""FIL rules: completeness and integrity of the files."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.errors import TwinError
from manitwin.twin.store import RECORD, sha256_of_untrusted, verify_record

LARGEST_COORDINATE_M = 1e6
"""Larger coordinates cannot be measured in double precision."""

_LEAST_BYTES = 1024
_GEOMETRY = frozenset({".obj", ".glb", ".gltf", ".stl", ".ply", ".dae", ".usd", ".usdc", ".usda", ".usdz"})
_PICTURES = frozenset({".png", ".jpg", ".jpeg", ".webp"})


def unreadable(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Placeholder check: unreadable assets never reach the rules, and ``audit.check`` creates these findings itself."""
    yield from ()


def no_geometry(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report an asset without visual and collision geometry."""
    if measured.body is None:
        names = measured.asset.missing_files
        named = ", ".join(repr(name) for name in names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
        why = f", since these files are not there: {named}" if names else ""
        yield Complaint(f"it has neither visual nor collision geometry{why}", values={"missing": list(names[:50])})


def wild_geometry(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report coordinates that cannot be measured."""
    for kind, meshes in (("visual", measured.asset.visual), ("collision", measured.asset.collision)):
        for mesh in meshes:
            vertices = np.asarray(mesh.vertices, float)
            if len(vertices) and not (np.abs(vertices) <= LARGEST_COORDINATE_M).all():  # also false for NaN
                yield Complaint(f"a {kind} mesh has coordinates that are no finite number of metres below 1e6")
                break


def missing(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report files that are named and do not exist."""
    names = measured.asset.missing_files
    if names:
        more = f" and {len(names) - 4} more" if len(names) > 4 else ""
        yield Complaint(f"not there: {', '.join(names[:4])}{more}", values={"missing": list(names[:50])})


def duplicates(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report meshes or textures with the same content under two names."""
    by_size: dict[tuple[bool, int], list[Path]] = defaultdict(list)
    for path in measured.asset.files:
        suffix = path.suffix.lower()
        wanted = _GEOMETRY if measured.asset.format == "twin" else _GEOMETRY | _PICTURES  # its pictures are renders
        if suffix in wanted and path.is_file() and path.stat().st_size >= _LEAST_BYTES:
            by_size[suffix in _GEOMETRY, path.stat().st_size].append(path)
    for paths in by_size.values():
        seen: dict[str, Path] = {}
        for path in paths if len(paths) > 1 else ():
            digest = sha256_of_untrusted(path, path.parent)
            if digest in seen:
                yield Complaint(f"{path.name} is the same file as {seen[digest].name}", file=path)
            seen.setdefault(digest, path)


def altered(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a twin whose files differ from its record."""
    if measured.record is None or measured.asset.missing_files:
        return
    path = measured.asset.path
    folder = path if path.is_dir() else path.parent
    try:
        verify_record(folder, measured.record)
    except TwinError as error:
        yield Complaint(str(error).removeprefix(f"{folder}/"), file=folder / RECORD)


def remarks(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Pass on the remarks of the reader."""
    for remark in measured.asset.remarks:
        if remark not in measured.asset.lenient:
            yield Complaint(remark)


def taken_leniently(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report content that a strict loader would refuse, or not find."""
    for said in measured.asset.lenient:
        yield Complaint(said)


RULES = (
    Rule(
        "FIL001",
        "unreadable",
        "error",
        why="What cannot be read cannot be used; one such file stops a program that loads the whole set. This finding is never"
        " left out by --select, only by --ignore.",
        remedy="The message names the file and the cause.",
        check=unreadable,
    ),
    Rule(
        "FIL002",
        "file-missing",
        "error",
        why="A texture or mesh that is named and not shipped leaves a grey or a hollow object, often without a word.",
        remedy="Ship the file beside the asset, under the name that is written, with the same case of letters.",
        check=missing,
    ),
    Rule(
        "FIL003",
        "file-duplicate",
        "warning",
        why="The same mesh under two names is most often the visual mesh used as collision, or a variant that was never edited.",
        remedy="Name one file twice, or put the right one in its place.",
        check=duplicates,
    ),
    Rule(
        "FIL004",
        "file-altered",
        "error",
        why="A twin names the sha256 of its files: one that differs was edited, or damaged on the way, after it was verified.",
        remedy="Build the twin again, or fetch it again.",
        check=altered,
    ),
    Rule(
        "FIL005",
        "no-geometry",
        "error",
        why="An asset without a shape loads in most simulators and then is nowhere.",
        remedy="Check the names of the meshes and the root element of the file.",
        check=no_geometry,
    ),
    Rule(
        "FIL006",
        "geometry-not-finite",
        "error",
        why="One NaN or 1e30 among the vertices makes bounds, hulls and inertia meaningless; nothing else is checked then.",
        remedy="Export the mesh again.",
        check=wild_geometry,
    ),
    Rule(
        "FIL007",
        "remark",
        "note",
        why="What the reader had to leave out or to assume, so that you know what was audited.",
        remedy="Nothing, where it is what you meant.",
        check=remarks,
    ),
    Rule(
        "FIL008",
        "rejected-twin",
        "note",
        why="A rejected twin is an answer, not an asset: its record says why there is none.",
        remedy="`manitwin status --why` tells; nothing is to be done here.",
        check=unreadable,
    ),
    Rule(
        "FIL009",
        "taken-leniently",
        "warning",
        why="What one loader takes another refuses: MuJoCo of today does not read top-level classes of other names, joints of"
        " the type fixed or two assets of one name, urdfdom no joint whose parent is nowhere; and meshes that only a program"
        " finds are missing for everybody else. It was read here as the more lenient loaders do, and audited.",
        remedy="Write it as the format's reference has it, and meshes by paths from the file.",
        check=taken_leniently,
    ),
)
