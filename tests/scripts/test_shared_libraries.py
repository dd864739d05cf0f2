"""What the loader says of shared objects, and the Debian packages of what is missing."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

import msgpack._cmsgpack
import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"
EXTENSION = Path(msgpack._cmsgpack.__file__)


@pytest.fixture(scope="module")
def libraries() -> ModuleType:
    """The module beside the set-up script."""
    sys.path.insert(0, str(SCRIPTS))
    try:
        return importlib.import_module("shared_libraries")
    finally:
        sys.path.remove(str(SCRIPTS))


@pytest.fixture
def wheel(tmp_path: Path) -> Path:
    """A folder with one real extension module that wants a library which no system has."""
    assert b"libc.so.6\0" in EXTENSION.read_bytes()
    (tmp_path / "wheel").mkdir()
    (tmp_path / "wheel" / "extension.so").write_bytes(EXTENSION.read_bytes().replace(b"libc.so.6\0", b"libQ.so.6\0"))
    return tmp_path / "wheel"


def test_an_object_whose_library_is_nowhere_is_found(libraries: ModuleType, wheel: Path) -> None:
    assert libraries.missing_libraries(wheel) == ["libQ.so.6"]


def test_what_another_wheel_bundles_is_not_missing(libraries: ModuleType, wheel: Path) -> None:
    (wheel / "other.libs").mkdir()
    (wheel / "other.libs" / "libQ.so.6.0.1").write_bytes(EXTENSION.read_bytes())
    assert libraries.missing_libraries(wheel) == []


def test_an_object_that_has_all_it_wants_is_no_finding(libraries: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "extension.so").write_bytes(EXTENSION.read_bytes())
    (tmp_path / "notes.so.txt").write_text("no shared object")
    assert libraries.missing_libraries(tmp_path) == []


@pytest.mark.parametrize(
    ("library", "package"),
    [
        ("libgomp.so.1", "libgomp1"),
        ("libGL.so.1", "libgl1"),
        ("libX11.so.6", "libx11-6"),
        ("libxcb.so.1", "libxcb1"),
        ("libstdc++.so.6", "libstdc++6"),
        ("libdrm_intel.so.1", "libdrm-intel1"),
    ],
)
def test_debian_policy_names_the_package_of_a_library(libraries: ModuleType, library: str, package: str) -> None:
    assert libraries.package_by_policy(library) == package


def test_a_name_off_the_policy_is_looked_up_by_contents(libraries: ModuleType) -> None:
    lines = [
        "libglib2.0-0: /usr/lib/x86_64-linux-gnu/libgthread-2.0.so.0",
        "libglib2.0-0: /usr/lib/x86_64-linux-gnu/libgthread-2.0.so.0.7400.6",
        "libglib2.0-0-dbgsym-like: /usr/lib/debug/libgthread-2.0.so.0",
        "someone: /opt/vendor/lib/libgthread-2.0.so.0",
    ]
    assert libraries.package_by_contents("libgthread-2.0.so.0", lines) == "libglib2.0-0"
    assert libraries.package_by_contents("libQ.so.6", lines) is None
