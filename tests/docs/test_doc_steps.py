"""The reading of pages: nothing of a block is passed over, and a step that fails is a failure."""

from __future__ import annotations

from pathlib import Path

import doc_pages
import pytest
from doc_blocks import read_block
from doc_pages import blocks, steps
from doc_shell import Shell

PAGE = """\
# A page
````{note}
of the site
````
```sh
# a remark
echo one \\
  two            # said
cat > file <<'END'
# no remark
END
echo 'three
four'
```
  ```toml
  seed = 1
  ```
"""


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "page.md"
    path.write_text(PAGE)
    monkeypatch.setitem(doc_pages.PAGES, "page.md", path)
    return path


def test_a_page_is_its_commands_and_blocks_in_order(page: Path) -> None:
    assert [(step.line, step.language, step.text) for step in steps("page.md")] == [
        (7, "sh", "echo one \\\n  two            # said"),
        (9, "sh", "cat > file <<'END'\n# no remark\nEND"),
        (12, "sh", "echo 'three\nfour'"),
        (15, "toml", "seed = 1\n"),
    ]


def test_a_fence_that_is_not_closed_is_said(page: Path) -> None:
    page.write_text("```sh\necho\n")
    with pytest.raises(ValueError, match=r"page\.md:1: the fence is not closed"):
        blocks("page.md")


def test_what_is_exported_and_where_one_went_to_stays_and_a_failure_fails(tmp_path: Path) -> None:
    shell = Shell(tmp_path)
    shell.run("mkdir inner && cd inner && export WORD=said")
    assert shell.run("echo $WORD; pwd").split() == ["said", str(tmp_path / "inner")]
    with pytest.raises(AssertionError, match="exit status 1"):
        shell.run("false")
    with pytest.raises(AssertionError, match="exit status 0"):
        shell.run("true", exits=3)


def test_keys_of_whoever_runs_the_tests_are_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "a real one")
    assert "a real one" not in Shell(tmp_path).run("env")


def test_a_file_that_a_page_lists_and_that_is_not_there_is_a_failure(tmp_path: Path) -> None:
    (tmp_path / "OUT" / "data").mkdir(parents=True)
    read_block("OUT/\n  data/    what is there\n", "tree OUT", tmp_path)
    with pytest.raises(AssertionError, match="missing"):
        read_block("OUT/\n  data/    what is there\n  missing  what is not\n", "tree OUT", tmp_path)
