from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest

from manitwin.errors import AssetError, InputError
from manitwin.formats.isolated import MAX_MEMORY_BYTES, ProcessCrashed, run_isolated
from manitwin.formats.json_file import parse_json
from manitwin.formats.meshes.read import read_mesh


def test_results_and_errors_come_back_from_another_process(tmp_path: Path) -> None:
    assert run_isolated("os:getpid") == run_isolated("os:getpid") != os.getpid()
    with pytest.raises(AssetError, match=r"gone\.json"):
        run_isolated(f"{parse_json.__module__}:parse_json", tmp_path / "gone.json")
    (tmp_path / "empty.obj").write_text("")
    with pytest.raises(InputError) as caught:
        run_isolated(f"{read_mesh.__module__}:read_mesh", tmp_path / "empty.obj")
    assert caught.value.reason == "empty"
    with pytest.raises(ZeroDivisionError) as zero:
        run_isolated("operator:truediv", 1, 0)
    assert "_answer" in "".join(zero.value.__notes__)


def test_a_crash_ends_the_worker_and_not_this_process() -> None:
    before = run_isolated("os:getpid")
    with pytest.raises(ProcessCrashed, match="os:abort has ended its process"):
        run_isolated("os:abort")
    assert run_isolated("os:getpid") != before


def test_what_asks_for_too_much_memory_is_told_so_and_the_worker_goes_on() -> None:
    before = run_isolated("os:getpid")
    with pytest.raises(MemoryError):
        run_isolated("builtins:bytearray", 2 * MAX_MEMORY_BYTES)
    assert run_isolated("os:getpid") == before


def test_nothing_that_is_printed_comes_between_the_answers() -> None:
    assert run_isolated("builtins:print", "not an answer") is None
    assert run_isolated("os:write", 1, b"not an answer") == 13


def test_threads_get_their_own_answers() -> None:
    answers: dict[int, int] = {}
    threads = [
        threading.Thread(target=lambda n=n: answers.update({n: run_isolated("builtins:abs", -n)})) for n in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert answers == {n: n for n in range(8)}


def test_a_forked_process_starts_a_worker_of_its_own() -> None:
    mine = run_isolated("os:getpid")
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(writer, str(run_isolated("os:getpid")).encode())
        os._exit(0)
    os.waitpid(child, 0)
    assert int(os.read(reader, 32)) != mine
    assert run_isolated("os:getpid") == mine
