from __future__ import annotations

import hashlib
import io
import json
import os
import struct
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from exported_twins import NAME, content, write_twin
from manitwin.assets.writers import isaaclab, usd
from manitwin.assets.writers.exporter import TwinContent
from manitwin.twin.loaded_twin import Twin

DIGESTS = """
import hashlib, json, sys
from manitwin.assets.writers import isaaclab, usd
from manitwin.assets.writers.exporter import TwinContent
from manitwin.twin.loaded_twin import Twin
twin = TwinContent.of(Twin(sys.argv[1]))
files = [export(twin).files for export in (isaaclab.export, usd.export, usd.export_usdz)]
print(json.dumps([{name: hashlib.sha256(data).hexdigest() for name, data in each.items()} for each in files]))
"""


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> TwinContent:
    return content(tmp_path_factory.mktemp("usdz") / "twin")


def test_members_start_on_64_bytes_uncompressed_the_stage_first(twin: TwinContent) -> None:
    exported = usd.export_usdz(twin)
    data = exported.files[exported.main]
    assert list(exported.files) == [f"{NAME}.usdz"] == [exported.main]
    with zipfile.ZipFile(io.BytesIO(data)) as package:
        assert package.testzip() is None
        entries = package.infolist()
    assert entries[0].filename == f"{NAME}.usdc"
    assert [entry.filename for entry in entries[1:]] == ["textures/paint_base_color.jpg"]
    for entry in entries:
        name, extra = struct.unpack_from("<HH", data, entry.header_offset + 26)
        start = entry.header_offset + 30 + name + extra
        assert start % 64 == 0
        assert entry.compress_type == zipfile.ZIP_STORED and entry.flag_bits == 0
        assert entry.date_time == (1980, 1, 1, 0, 0, 0)
        assert (
            hashlib.sha256(data[start : start + entry.file_size]).digest()
            == hashlib.sha256(usd.export(twin).files[entry.filename]).digest()
        )


@pytest.mark.parametrize("length", range(1, 70, 7))
def test_padding_is_right_whatever_the_length_of_names(twin: TwinContent, length: int) -> None:
    exported = usd.export_usdz(replace(twin, name="n" * length))
    data = exported.files[exported.main]
    with zipfile.ZipFile(io.BytesIO(data)) as package:
        for entry in package.infolist():
            name, extra = struct.unpack_from("<HH", data, entry.header_offset + 26)
            assert (entry.header_offset + 30 + name + extra) % 64 == 0


def test_another_process_writes_the_same_bytes(tmp_path: Path) -> None:
    folder = write_twin(tmp_path / "twin")
    answers = [
        json.loads(
            subprocess.run(
                [sys.executable, "-c", DIGESTS, str(folder)],
                env={**os.environ, "PYTHONHASHSEED": seed, "TMPDIR": str(tmp_path)},
                check=True,
                capture_output=True,
                text=True,
            ).stdout
        )
        for seed in ("1", "2")
    ]
    twin = TwinContent.of(Twin(folder))
    mine = [
        {name: hashlib.sha256(data).hexdigest() for name, data in export(twin).files.items()}
        for export in (isaaclab.export, usd.export, usd.export_usdz)
    ]
    assert answers[0] == answers[1] == mine
