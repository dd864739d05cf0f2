"""Where a user's own files lie."""

from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.formats.user_folders import cache_home


def test_the_cache_lies_where_the_user_says_by_an_absolute_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_home() == tmp_path / "manitwin"
    for said in ("relative", ""):
        monkeypatch.setenv("XDG_CACHE_HOME", said)
        assert cache_home() == Path.home() / ".cache/manitwin"
