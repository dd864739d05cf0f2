"""The lock is that of the file that lies there, not of one that was removed."""

from __future__ import annotations

import fcntl
from pathlib import Path

import pytest

from manitwin.engine.ledger.lock import hold_lock, is_written, lock_file
from manitwin.errors import UsageError


def test_one_holds_the_lock_at_a_time(tmp_path: Path) -> None:
    path = tmp_path / "ledger.sqlite"
    assert not is_written(path)
    with hold_lock(path):
        assert is_written(path)
        with pytest.raises(UsageError, match="another run is writing to it"):
            hold_lock(path)
    assert not is_written(path)


def test_a_lock_that_is_removed_as_it_is_taken_is_taken_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, take, removed = tmp_path / "ledger.sqlite", fcntl.flock, []

    def flock(stream: object, how: int) -> None:
        if not removed:
            removed.append(lock_file(path).unlink())
        take(stream, how)  # type: ignore[arg-type]

    monkeypatch.setattr(fcntl, "flock", flock)
    with hold_lock(path):
        assert removed and is_written(path), "who comes next sees it"
