"""``manitwin models``: nothing is fetched or stored without its licences confirmed."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest

from manitwin.cli.commands.models import models
from manitwin.errors import UsageError
from manitwin.models.weights import catalog, published, store
from tiny_networks import tiny_network

NETWORK = tiny_network()


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    weights = replace(catalog.KNOWN_WEIGHTS["isnet"], sha256=hashlib.sha256(NETWORK).hexdigest())
    monkeypatch.setitem(catalog.KNOWN_WEIGHTS, "isnet", weights)
    monkeypatch.setenv(store.FOLDER, str(tmp_path / "models"))
    monkeypatch.setattr(published, "unpack_network", lambda package, tarball: NETWORK)
    return tmp_path / "models"


def test_licences_are_printed_and_must_be_confirmed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(UsageError, match="--accept-licence"):
        models("add", "isnet", source=Path("a.tgz"))
    said = " ".join(capsys.readouterr().out.split())
    assert "MIT" in said and "AGPL-3.0" in said and "Apache-2.0" in said
    assert not folder.exists()


def test_added_weights_are_listed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    models()
    assert "manitwin models add isnet" in " ".join(capsys.readouterr().out.split())
    models("add", "isnet", source=Path("a.tgz"), accept_licence=True)
    assert "--matting isnet" in " ".join(capsys.readouterr().out.split())
    models("list")
    assert "added" in capsys.readouterr().out
    assert len(list(folder.glob("*.onnx"))) == 1


def test_list_takes_nothing_and_add_a_name() -> None:
    with pytest.raises(UsageError, match="models list takes no further arguments"):
        models("list", "isnet")
    with pytest.raises(UsageError, match="manitwin models list"):
        models("add")
