"""Detection and reading of assets of any supported tool; formats are recognized by content rather than by name."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from manitwin.assets.unsupported_formats import unsupported_reason
from manitwin.assets.usd_texts import USD_SUFFIXES, USD_TEXT, layers_of
from manitwin.errors import AssetError, unknown_name_message
from manitwin.formats.bounded_file import open_regular

if TYPE_CHECKING:
    from manitwin.assets.asset import Asset, Format
    from manitwin.assets.joints import Joints

SCAN_METADATA = "metadata.pbtxt"
"""A file that Google Scanned Objects have and other Gazebo models do not."""
_HEAD_BYTES, _FRAGMENT_BYTES = 1 << 16, 1 << 23
_FIRST_TAG = re.compile(rb"<([A-Za-z][\w.:-]*)[\s/>]")
_SHAPES = (b"<geom", b"<visual", b"<collision", b"<include", b"<replicate", b"<composite", b"<flexcomp", b"<attach")
"""Elements of MJCF, URDF and SDF that declare shapes or include files that may."""
_MODEL = re.compile(rb"<model\s")
"""A model with a name: plug-ins name models in elements that have no name attribute themselves."""
_WORLD_BODY = re.compile(rb"<worldbody[\s>].*?</worldbody>", re.DOTALL)
_PLANE = re.compile(rb"<geom\b[^>]*\btype\s*=\s*[\"']plane[\"'][^>]*>")
_ENDS = (b"</mujoco>", b"</robot>", b"</sdf>")
_USD_SHAPE = re.compile(
    rb"^\s*def\s+(?:Mesh|Cube|Sphere|Cylinder|Capsule|Cone|Plane|Points|TetMesh|BasisCurves|Nurbs\w+|Hermite\w+|PointInstancer)\w*\s",
    re.MULTILINE,
)
_USD_ROOT = re.compile(rb"^def\b", re.MULTILINE)
_COMPOSED = (b"references", b"payload", b"subLayers")
"""Composition arcs that bring prims of other layers into a layer that defines none."""
_NUMBERS = re.compile(rb"""\b(?:xyz|rpy|rgba|size|scale|radius|length|value|pos|quat)=["']([^"'<>]*)["']""")
_TO_FILL_IN = re.compile(
    rb"(?<![\w.])(?!NAN\b|INF\b|INFINITY\b)[A-Z][A-Z_]{2,}[0-9]*(?![\w.])|\{\{?\s*[A-Za-z_]\w*\s*\}|\$[({]"
)
"""Words and brackets in place of numbers: the file is a template that a program fills in."""
_MARKS = re.compile(rb"<extra_info[\s/>]|<custom_data[\s/>]")
_ROBOTWIN_DATA = re.compile(r"model_data\d*\.json")

VALID_ASSETS = (
    "valid are twin folders, RoboTwin, ManiTwin-100K, EmbodiedGen and Google Scanned Objects folders, .urdf, .sdf, MJCF"
    " .xml and USD files; a plain mesh goes to `manitwin build`"
)
"""The end of an error message about a path that holds no supported asset."""
_NAME_FILES = ("urdf", "mjcf", "sdf", "gso", "embodiedgen", "usd")
"""Formats whose descriptions may name meshes in other folders."""
WITH_JOINTS = ("urdf", "mjcf", "sdf", "usd")
FORMATS: tuple[Format, ...] = ("twin", "urdf", "mjcf", "sdf", "usd", "robotwin", "manitwin100k", "embodiedgen", "gso")


def detect(path: Path) -> Format:
    """Return the format of the asset in a file or folder.

    Raises AssetError if there is no asset, or a folder holds more than one.
    """
    _require_existing(path)
    found = folder_format(path) if path.is_dir() else file_format(path)
    if found is not None:
        return found
    if path.is_dir():
        return detect(only_file(path))
    raise AssetError(f"{path.name}: {unsupported_reason(path) or f'no asset of a known format; {VALID_ASSETS}'}")


def folder_format(folder: Path) -> Format | None:
    """Return the format of a folder that is one asset as a whole, or None."""
    names = {entry.name for entry in folder.iterdir() if is_file_below(entry, folder)}
    if "twin.json" in names:
        return "twin"
    if "manipulation_annotations.json" in names or names & {"base_rescaled.glb", "base_rescaled.usdz"}:
        return "manitwin100k"
    if any(_ROBOTWIN_DATA.fullmatch(name) for name in names):
        return "robotwin"
    if {"model.config", "model.sdf"} <= names:
        return "gso" if SCAN_METADATA in names else "sdf"
    return None


def file_format(file: Path) -> Format | None:
    """Return the format of a file that is the main file of an asset, or None."""
    suffix = file.suffix.lower()
    if file.name == "twin.json":
        return "twin"
    if _ROBOTWIN_DATA.fullmatch(file.name):
        return "robotwin"
    if suffix in USD_SUFFIXES:
        return "usd"
    if suffix in (".urdf", ".xml", ".mjcf", ".sdf"):
        return _xml_format(file)
    return None


def only_file(folder: Path) -> Path:
    """Return the only main file in a folder or directly in its subfolders; raise AssetError if there is none or more than one.

    If a folder holds several formats, URDF has priority over MJCF, SDF and USD.
    """
    for depth in ("*", "*/*"):
        files = [
            file for file in sorted(folder.glob(depth)) if is_file_below(file, folder) and not _hidden(file, folder)
        ]
        found = [(file, form) for file in files if (form := file_format(file)) is not None]
        for wanted in (("urdf", "embodiedgen"), ("mjcf",), ("sdf", "gso"), ("usd",)):
            named = [file for file, form in found if form in wanted]
            if len(named) == 1:
                return named[0]
            if named:
                listed = ", ".join(file.name for file in named[:4])
                raise AssetError(f"{folder}: holds {len(named)} assets ({listed}); name one of them")
    raise AssetError(f"{folder}: holds no asset of a known format; {VALID_ASSETS}")


def robotwin_data(folder: Path) -> list[Path]:
    """Return the model_data files of a RoboTwin folder, one for each variant, in numerical order."""
    found = [f for f in folder.iterdir() if _ROBOTWIN_DATA.fullmatch(f.name) and is_file_below(f, folder)]
    return sorted(found, key=lambda file: (int("".join(filter(str.isdigit, file.stem)) or -1), file.name))


def _hidden(file: Path, folder: Path) -> bool:
    return any(part.startswith(".") for part in file.relative_to(folder).parts)


def _xml_format(file: Path) -> Format | None:
    with open_regular(file, AssetError) as stream:
        head = stream.read(_HEAD_BYTES)
    first = _FIRST_TAG.search(_without_comments(head))
    tag = first.group(1) if first else None
    if tag == b"mujoco":
        return "mjcf"
    if tag == b"sdf":
        return "gso" if file.name == "model.sdf" and is_file_below(file.parent / SCAN_METADATA, file.parent) else "sdf"
    if tag == b"robot":
        return "embodiedgen" if _MARKS.search(head) else "urdf"
    return None


@dataclass(frozen=True)
class _NonAssets:
    """Collects descriptions that are not assets by themselves: fragments, templates, and layers of USD stages."""

    fragments: list[Path]
    templates: list[Path]
    layers: set[Path] = field(default_factory=set)

    def is_non_asset(self, file: Path) -> bool:
        """Return whether a description is not an asset by itself, and record it if so.

        This holds for a description without shapes, one with words in place of numbers, and a layer of another USD stage.
        """
        suffix = file.suffix.lower()
        usd = suffix in USD_SUFFIXES
        if usd and file.resolve() in self.layers:
            self.fragments.append(file)
            return True
        if not usd and suffix not in (".urdf", ".xml", ".mjcf", ".sdf"):
            return False
        with open_regular(file, AssetError) as stream:
            if usd and stream.read(len(USD_TEXT)) != USD_TEXT:
                return False
            content = stream.read(_FRAGMENT_BYTES)
        if len(content) == _FRAGMENT_BYTES:
            return False
        content = content if usd else _without_comments(content)
        fragment = _is_layer(content) if usd else _has_no_shape(content)
        if fragment:
            self.fragments.append(file)
        elif template := not usd and _is_template(content):
            self.templates.append(file)
        return fragment or template


def _is_layer(content: bytes) -> bool:
    """Return whether a USD text shows nothing by itself: it holds only materials, overrides or bodies for other layers."""
    if _USD_ROOT.search(content) is None:  # only overrides of prims that other layers define
        return b"subLayers" not in content
    return _USD_SHAPE.search(content) is None and not any(word in content for word in _COMPOSED)


def _has_no_shape(content: bytes) -> bool:
    """Return whether an XML description has no shape of its own: it is meant for inclusion, or is a world of included models."""
    if content.rstrip().endswith(b"</mujoco>") and b"<include" not in content:
        bodies = b"".join(_WORLD_BODY.findall(content))  # defaults name shape types without creating shapes
        content = _PLANE.sub(b"", bodies) + b"</mujoco>"  # nor is a floor an object
    if content.rstrip().endswith(b"</sdf>"):
        if _MODEL.search(content) is None and b"<include" in content:  # the included models are assets by themselves
            return True
        if b"<world" in content:
            return b"<visual" not in content and b"<collision" not in content
    ends = any(content.rstrip().endswith(end) for end in _ENDS)  # a truncated file is a broken asset, not a fragment
    return ends and (not any(tag in content for tag in _SHAPES) or b"<xacro:macro" in content)


def _is_template(content: bytes) -> bool:
    return any(_TO_FILL_IN.search(numbers) for numbers in _NUMBERS.findall(content))


def _without_comments(xml: bytes) -> bytes:
    kept, after = [], 0
    while (begin := xml.find(b"<!--", after)) >= 0:
        kept.append(xml[after:begin])
        end = xml.find(b"-->", begin)
        after = end + 3 if end >= 0 else len(xml)
    return b"".join([*kept, xml[after:]])


def read_asset(
    path: Path,
    format: Format | Literal["auto"] = "auto",
    *,
    root: Path | None = None,
    shape_only: bool = False,
    joints: Joints = "part",
    number: int | None = None,
) -> Asset:
    """Read the asset at a path; ``format="auto"`` uses the format that ``detect`` finds. Raises AssetError.

    ``root``: the folder above which no file is read, for descriptions that name files (default: ``root_of`` the path).
    ``joints``: "part" reads the first rigid part; "lock" reads all links as one rigid body in the pose of the file (formats in
    ``WITH_JOINTS`` only); "keep" also keeps links and joints, and reads formats without joints like "part". ``number``: which
    object of an MJCF file with several freely movable ones (``mjcf.count_objects``). ``shape_only``: skips texture decoding and,
    where it is costly, normals. The reader of a format and the engine it needs are imported only when used.
    """
    if format != "auto" and format not in FORMATS:
        raise AssetError(unknown_name_message("format", format, ("auto", *FORMATS)))
    _require_existing(path)
    chosen = detect(path) if format == "auto" else format
    reader = import_module(f"manitwin.assets.readers.{chosen}")
    if joints == "lock" and chosen not in WITH_JOINTS:
        raise AssetError(f"{path.name}: joints are locked in {', '.join(WITH_JOINTS)}; {chosen} is read as it stands")
    if chosen not in _NAME_FILES:
        whole: Asset = reader.read(path)
        return whole
    from manitwin.assets.asset_files import MESH_LIMITS, SHAPE_LIMITS
    from manitwin.assets.package_licence import with_package_licence
    from manitwin.assets.root import root_of

    limits = SHAPE_LIMITS if shape_only else MESH_LIMITS
    if number is not None and chosen != "mjcf":
        raise AssetError(f"{path.name}: objects have numbers in MJCF; {chosen} is read as one object")
    if number is not None:
        numbered: Asset = reader.read(path, root, limits, joints=joints, number=number)
        return with_package_licence(numbered, root or root_of(path), say=not shape_only)
    read = joints != "part" and chosen in WITH_JOINTS
    asset: Asset = reader.read(path, root, limits, joints=joints) if read else reader.read(path, root, limits)
    return with_package_licence(asset, root or root_of(path), say=not shape_only)


def find_assets(path: Path, fragments: list[Path] | None = None, templates: list[Path] | None = None) -> Iterator[Path]:
    """Yield every asset at or below a path, in the order of names, skipping hidden folders.

    A folder that is one asset as a whole is not searched. Links to folders, and to files outside the folder, are not followed.
    A RoboTwin folder yields its model_data files. Descriptions without a shape and layers of other USD stages are appended to
    ``fragments``, and templates with words in place of numbers to ``templates``.

    Raises AssetError if the path does not exist.
    """
    _require_existing(path)
    if not path.is_dir():
        yield path
        return
    aside = _NonAssets([] if fragments is None else fragments, [] if templates is None else templates)
    yield from _assets_below(path, path, aside)


def is_file_below(file: Path, folder: Path) -> bool:
    """Return whether a path is a regular file that no symbolic link leads out of a folder."""
    try:
        return file.is_file() and (not file.is_symlink() or file.resolve().is_relative_to(folder.resolve()))
    except (OSError, RuntimeError, ValueError):  # a loop of links: RuntimeError until Python 3.12
        return False


def _require_existing(path: Path) -> None:
    if not os.path.exists(path):
        raise AssetError(f"{path}: no such file or folder; check the path")
    if not path.is_file() and not path.is_dir():
        raise AssetError(f"{path}: is no regular file, and only such are read; give a file or a folder")


def _assets_below(path: Path, root: Path, aside: _NonAssets) -> Iterator[Path]:
    form = folder_format(path)
    if form == "robotwin":
        yield from robotwin_data(path)
        return
    if form == "sdf" and aside.is_non_asset(path / "model.sdf"):  # a light, for example
        return
    if form is not None:
        yield path
        return
    with os.scandir(path) as scanned:
        entries = sorted((entry for entry in scanned if not entry.name.startswith(".")), key=lambda e: e.name)
    stages = [Path(entry.path) for entry in entries if Path(entry.name).suffix.lower() in USD_SUFFIXES]
    aside.layers.update(layers_of((stage for stage in stages if is_file_below(stage, root)), root))
    for entry in entries:
        file = Path(entry.path)
        if not is_file_below(file, root) or file_format(file) is None:
            continue
        if not aside.is_non_asset(file):
            yield file
    for entry in entries:
        if entry.is_dir(follow_symlinks=False):
            yield from _assets_below(Path(entry.path), root, aside)
