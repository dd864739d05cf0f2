"""Every fenced block of README.md and docs/ is run, in order: commands, Python, settings; see ``doc_arrangements``."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
from doc_arrangements import EVERYWHERE, PAGES, SLOW, Arrangement
from doc_blocks import read_block
from doc_command_line import check_words
from doc_folders import Folders
from doc_pages import PAGES as FILES
from doc_pages import Step, blocks, steps
from doc_services import services
from doc_shell import Shell

PROGRAMS = {"sh", "python"}
LANGUAGES = PROGRAMS | {"toml", "json", "text", "yaml"}
SERVED = re.compile(r"--(vlm|generator|grasper|embedder)\b")
NONE = Arrangement()

WITH_STEPS = [page for page in FILES if steps(page)]


def arranged(page: str) -> Arrangement:
    return PAGES.get(page, NONE)


def reason_not_run(step: Step) -> str | None:
    return next((why for what, why in arranged(step.page).not_run.items() if re.search(what, step.text)), None)


def read_by(step: Step) -> str:
    """Return what reads a block that is no program: what the table says of it; by itself settings are read as such."""
    named = (kind for what, kind in arranged(step.page).blocks.items() if re.search(what, step.text))
    return next(named, "settings" if step.language == "toml" else "nothing: the table of tests/docs does not name it")


def slow_steps(page: str) -> set[Step]:
    """Return the steps that only the slow test does: what is expensive, and what may go on with it.

    That is Python after it, or of a page that the table does not name, all of it.
    """
    slow = set[Step]()
    for step in steps(page):
        expensive = any(re.search(each, does(step)) for each in (*SLOW, *arranged(page).slow))
        if expensive or (step.language == "python" and any(each.language == "python" for each in slow)):
            slow.add(step)
    return slow if page in PAGES or not slow else set(steps(page))


def rewritten(step: Step) -> str:
    """Return a step with the substitutions of its page, and those for all pages where it is a command."""
    text = step.text
    for found, instead in arranged(step.page).rewritten.items():
        text = re.sub(found, instead, text, flags=re.MULTILINE)
    for found, instead in EVERYWHERE.items() if step.language == "sh" else ():
        text = re.sub(found, instead, text)
    return text


def does(step: Step) -> str:
    """Return what a step does, in the words that say what is expensive and which folders it wants: without its comments."""
    return re.sub(r"(^|\s)#.*", "", rewritten(step)) if step.language in PROGRAMS else read_by(step)


SLOW_PAGES = [page for page in WITH_STEPS if any(not reason_not_run(step) for step in slow_steps(page))]


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Folders:
    return Folders(tmp_path_factory.mktemp("prepared"))


@pytest.fixture(scope="module")
def served() -> Iterator[dict[str, str]]:
    with services() as environment:
        yield environment


class Reader:
    """Somebody who does what a page says, from its top to its end."""

    def __init__(self, folder: Path, folders: Folders, todo: list[Step], environment: dict[str, str]):
        folders.prepare(folder, "\n".join(map(does, todo)))
        self.shell = Shell(folder, **environment, TWIN=folders.twin_id(folder))
        self.folder, self.names = folder, {"__name__": "__main__"}

    def do(self, step: Step) -> None:
        """Do a step; raises AssertionError, or what the step raises."""
        page, text = arranged(step.page), rewritten(step)
        if step.language == "python":
            exec(compile(text, f"{step.page}:{step.line}", "exec"), self.names)
        elif step.language == "sh" and re.match(r"manitwin (fake (?!--list)|view (?!.*--static)|review DATASET)", text):
            self.shell.serve(text.split(" #")[0])
        elif step.language == "sh":
            self.shell.run(text, next((status for what, status in page.exits.items() if re.search(what, step.text)), 0))
        else:
            read_block(text, read_by(step), self.folder)


def read(page: str, folder: Path, folders: Folders, request: pytest.FixtureRequest, slow: bool) -> None:
    left_out = set() if slow else slow_steps(page)
    todo = [step for step in steps(page) if not reason_not_run(step) and step not in left_out]
    asks = any(SERVED.search(step.text) for step in todo)
    reader = Reader(folder, folders, todo, request.getfixturevalue("served") if asks else {})
    for step in todo:
        try:
            reader.do(step)
        except Exception as error:
            error.add_note(str(step))
            raise


@pytest.mark.parametrize("page", WITH_STEPS)
def test_what_a_page_says_works(
    page: str, tmp_path: Path, folders: Folders, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    read(page, tmp_path, folders, request, slow=False)


@pytest.mark.slow
@pytest.mark.parametrize("page", SLOW_PAGES)
def test_all_that_a_page_says_works(
    page: str, tmp_path: Path, folders: Folders, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    read(page, tmp_path, folders, request, slow=True)


@pytest.mark.parametrize("page", SLOW_PAGES)
def test_commands_that_only_the_slow_test_runs_have_the_options_of_the_command_line(page: str) -> None:
    for step in slow_steps(page):
        if step.language == "sh":
            check_words(shlex.split(step.text.replace("\\\n", " "), comments=True))


@pytest.mark.parametrize("page", WITH_STEPS)
def test_every_block_says_what_it_is(page: str) -> None:
    unknown = [f"{page}:{block.line}: ```{block.language}" for block in blocks(page) if block.language not in LANGUAGES]
    assert not unknown, f"give one of {', '.join(sorted(LANGUAGES))}"


def test_the_table_has_nothing_that_no_page_says() -> None:
    unused = [page for page in PAGES if page not in FILES]
    for page, table in PAGES.items():
        said = [step.text for step in steps(page)] if page in FILES else []
        for what in (*table.rewritten, *table.not_run, *table.slow, *table.exits, *table.blocks):
            if not any(re.search(what, text, re.MULTILINE) for text in said):
                unused.append(f"{page}: {what}")
    everything = [step.text for page in WITH_STEPS for step in steps(page) if step.language == "sh"]
    for what in EVERYWHERE:
        if not any(re.search(what, text) for text in everything):
            unused.append(what)
    assert not unused


def test_each_reason_for_not_running_is_a_sentence_and_hides_no_command_of_ours() -> None:
    for page, table in PAGES.items():
        for what, why in table.not_run.items():
            assert len(why) > 10, f"{page}: {what}"
            hidden = [step.text for step in steps(page) if re.search(what, step.text) and step.language == "sh"]
            assert not [text for text in hidden if text.startswith(("manitwin ", ".venv/bin/manitwin "))], what
