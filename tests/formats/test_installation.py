"""What the loader says of shared objects, and the Debian packages of what is missing."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import msgpack._cmsgpack
import pytest

from manitwin.cli import main as cli
from manitwin.cli.commands import doctor
from manitwin.formats.installation import import_remedy, missing_libraries, package_by_contents, package_by_policy

EXTENSION = Path(msgpack._cmsgpack.__file__)


@pytest.fixture
def wheel(tmp_path: Path) -> Path:
    """A folder with one real extension module that wants a library which no system has."""
    assert b"libc.so.6\0" in EXTENSION.read_bytes()
    (tmp_path / "wheel").mkdir()
    (tmp_path / "wheel" / "extension.so").write_bytes(EXTENSION.read_bytes().replace(b"libc.so.6\0", b"libQ.so.6\0"))
    return tmp_path / "wheel"


def test_an_object_whose_library_is_nowhere_is_found(wheel: Path) -> None:
    assert missing_libraries(wheel) == ["libQ.so.6"]


def test_what_another_wheel_bundles_is_not_missing(wheel: Path) -> None:
    (wheel / "other.libs").mkdir()
    (wheel / "other.libs" / "libQ.so.6.0.1").write_bytes(EXTENSION.read_bytes())
    assert missing_libraries(wheel) == []


def test_an_object_that_has_all_it_wants_is_no_finding(tmp_path: Path) -> None:
    (tmp_path / "extension.so").write_bytes(EXTENSION.read_bytes())
    (tmp_path / "notes.so.txt").write_text("no shared object")
    assert missing_libraries(tmp_path) == []


@pytest.mark.parametrize(
    ("library", "package"),
    [
        ("libgomp.so.1", "libgomp1"),
        ("libGL.so.1", "libgl1"),
        ("libX11.so.6", "libx11-6"),
        ("libxcb.so.1", "libxcb1"),
        ("libstdc++.so.6", "libstdc++6"),
        ("libdrm_intel.so.1", "libdrm-intel1"),
        ("libglib-2.0.so.0", "libglib2.0-0"),  # one name that is unknown, and apt-get installs none of them
        ("libgthread-2.0.so.0", "libglib2.0-0"),
    ],
)
def test_debian_policy_names_the_package_of_a_library(library: str, package: str) -> None:
    assert package_by_policy(library) == package


def test_a_name_off_the_policy_is_looked_up_by_contents() -> None:
    lines = [
        "libglib2.0-0: /usr/lib/x86_64-linux-gnu/libgthread-2.0.so.0",
        "libglib2.0-0: /usr/lib/x86_64-linux-gnu/libgthread-2.0.so.0.7400.6",
        "libglib2.0-0-dbgsym-like: /usr/lib/debug/libgthread-2.0.so.0",
        "someone: /opt/vendor/lib/libgthread-2.0.so.0",
    ]
    assert package_by_contents("libgthread-2.0.so.0", lines) == "libglib2.0-0"
    assert package_by_contents("libQ.so.6", lines) is None


def test_a_command_that_wants_a_missing_library_ends_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    def without_library(*_: object, **__: object) -> None:
        raise ImportError("libGL.so.1: cannot open shared object file: No such file or directory")

    monkeypatch.setattr("manitwin.api.load", without_library)
    monkeypatch.setattr("sys.argv", ["manitwin", "show", str(tmp_path)])
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        with pytest.raises(SystemExit) as ended:
            cli.main()
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    assert ended.value.code == 4
    (line,) = capfd.readouterr().err.strip().splitlines()
    assert line.startswith("manitwin show: libGL.so.1: cannot open") and "manitwin doctor" in line


def test_the_doctor_names_the_packages_of_missing_libraries(monkeypatch: pytest.MonkeyPatch, wheel: Path) -> None:
    monkeypatch.setattr(doctor.sysconfig, "get_path", lambda name: str(wheel))
    (finding,) = [each for each in doctor.check_installation() if each.name == "shared libraries"]
    assert (
        not finding.ok
        and "libQ.so.6" in finding.detail
        and "sudo apt-get install -y --no-install-recommends libq6 (" in finding.detail
    )


def test_an_import_that_fails_for_another_reason_keeps_its_own_remedy() -> None:
    assert import_remedy(ImportError("No module named 'coal'"), "pip install it") == "pip install it"


def test_a_library_that_is_left_out_is_not_found_and_comes_back() -> None:
    program = """
from manitwin.formats.installation import block_import
import sys
with block_import("wave"):
    try:
        import wave
    except ModuleNotFoundError as error:
        print(error.name)
import wave
with block_import("wave"):
    import wave as again
print(again is sys.modules["wave"])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["wave", "True"]


def test_a_library_that_is_put_off_is_loaded_once_something_of_it_is_used() -> None:
    program = """
from manitwin.formats.installation import defer_import
import sys
defer_import("xml", "Reader")
defer_import("no_such_library")
import xml
from xml import Reader
print(type(xml).__name__, Reader.__name__, "no_such_library" in sys.modules)
print(xml.__all__, type(xml).__name__)
from xml.dom import minidom
print(minidom.__name__)
defer_import("json")
import json
print(type(json).__name__)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [
        "_LazyModule Reader False",
        "['dom', 'parsers', 'sax', 'etree'] module",
        "xml.dom.minidom",
        "_LazyModule",
    ]
