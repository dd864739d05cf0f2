"""Archive of a USDZ package: its members, and a check that no layer refers outside it."""

from __future__ import annotations

import posixpath
import re
import zipfile
from functools import partial
from pathlib import Path

from pxr import Sdf, Tf

from manitwin.errors import InputError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.meshes.source import MeshSource

_LAYERS = (".usd", ".usda", ".usdc")
_MAX_MEMBERS = 10_000
_CENTRAL_HEADER = b"PK\x01\x02"
_BLOCK_BYTES = 1 << 20


class UsdzArchive:
    """The members of a USDZ package by name, without unpacking them to disk."""

    def __init__(self, source: MeshSource):
        self._source = source
        size = source.path.stat().st_size
        if size > source.limits.max_bytes:
            raise source.too_large(f"{size} bytes exceed the limit of {source.limits.max_bytes}")
        members_said = _central_headers(source)
        if members_said > _MAX_MEMBERS:  # before a list of them is allocated
            raise source.too_large(f"{members_said} members in the archive", "pack fewer files")
        try:
            self._zip = zipfile.ZipFile(source.path)
            members = self._zip.infolist()
        except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
            raise source.unreadable(
                f"truncated or broken: its archive cannot be read ({str(error)[:60]})", "download it again"
            ) from error
        for member in members:
            # USDZ allows neither compression nor encryption, which excludes ZIP bombs
            if (
                member.compress_type != zipfile.ZIP_STORED
                or member.flag_bits & 1
                or member.file_size != member.compress_size
            ):
                raise source.unreadable(
                    f"member {member.filename[:80]!r} is compressed or encrypted, which USDZ forbids",
                    "pack it with usdzip",
                )
            if not _is_inside(member.filename):
                raise source.unreadable(
                    f"member {member.filename[:80]!r} leads out of the archive", "pack it with usdzip"
                )
        if sum(member.file_size for member in members) > size:
            raise source.unreadable("its members overlap", "pack it with usdzip")
        self.names = [member.filename for member in members]
        self.root = self.names[0] if self.names and self.names[0].lower().endswith(_LAYERS) else None

    def read(self, name: str, what: str) -> bytes | None:
        """Return a member's bytes, or None with a finding; nothing outside the archive is ever opened."""
        clean = posixpath.normpath(name.replace("\\", "/"))
        if not _is_inside(clean):
            self._source.add_finding(f"{what} {name[:80]!r} lies outside the archive and was not read")
            return None
        if clean not in self.names:
            self._source.add_finding(f"{what} {name[:80]!r} is not in the archive; carried on without it")
            return None
        try:
            return self._zip.read(clean)
        except (zipfile.BadZipFile, OSError, EOFError):
            self._source.add_finding(f"{what} {name[:80]!r} is broken; carried on without it")
            return None

    def check_layers(self) -> None:
        """Refuse a package with a layer that names a layer outside it; raises InputError ``unreadable``.

        Every layer of the archive is checked, used or not, before a stage is composed, because composition would open the named
        layers.
        """
        for name in self.names:
            if not name.lower().endswith(_LAYERS):
                continue
            try:
                layer = Sdf.Layer.OpenAsAnonymous(package_path(self._source.path, name))
                named_layers = [] if layer is None else layer.GetCompositionAssetDependencies()
                clips = layer is not None and _has_clips(layer)
            except Tf.ErrorException as error:
                raise self._source.unreadable(f"layer {name[:80]!r} cannot be read", "export it again") from error
            if layer is None:
                raise self._source.unreadable(f"layer {name[:80]!r} cannot be read", "export it again")
            for named in named_layers:
                target = posixpath.normpath(posixpath.join(posixpath.dirname(name), named))
                if (not _is_inside(named) and named) or not _is_inside(target) or target not in self.names:
                    raise self._source.unreadable(
                        f"layer {name[:60]!r} names {named[:80]!r}, which is not in the archive",
                        "pack it with usdzip, all layers in one",
                    )
            if clips:
                raise self._source.refused("animated", "it holds value clips", "export a still mesh")


def _central_headers(source: MeshSource) -> int:
    """Count the signatures of central directory entries (APPNOTE 4.3.12) in the file."""
    count, rest = 0, b""
    with open_regular(source.path, partial(InputError, "unreadable")) as stream:
        while block := stream.read(_BLOCK_BYTES):
            count += (rest + block).count(_CENTRAL_HEADER)
            rest = block[1 - len(_CENTRAL_HEADER) :]
    return count


def package_path(path: Path, member: str) -> str:
    """Return USD's name for a member of a package."""
    return f"{path}[{member}]"


def _is_inside(name: str) -> bool:
    # a backquote starts an expression, brackets a nested package, a colon a scheme or a drive
    if not name or name.startswith(("/", "\\", "~")) or re.search(r"[:`\[\]\0]", name):
        return False
    return ".." not in name.replace("\\", "/").split("/") and posixpath.normpath(name) not in ("", ".")


def _has_clips(layer: Sdf.Layer) -> bool:
    found: list[bool] = []

    def look(path: Sdf.Path) -> None:
        if path.IsPrimPath() and layer.GetPrimAtPath(path) is not None and layer.GetPrimAtPath(path).HasInfo("clips"):
            found.append(True)

    layer.Traverse(Sdf.Path.absoluteRootPath, look)
    return bool(found)
