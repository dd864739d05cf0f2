"""Processes that ask a chat model at once; light to import, as each of them does."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from manitwin.models.vlm.answer_cache import CachedChat
from manitwin.models.vlm.prices import FREE
from manitwin.models.vlm.protocol import Question, Reply, Turn, Usage
from manitwin.models.vlm.replay import RecordedChat


def asked(vote: int) -> Question:
    return Question("made_of", "You judge objects.", ("What is it made of?",), {}, vote)


class Echo:
    """A chat model whose long answers name the vote; long, so that no single write takes a line."""

    name = model = "echo"
    price = FREE
    decides: dict[str, str | float | None] = {"model": "echo"}  # noqa: RUF012

    def __init__(self, length: int = 0):
        self.length = length

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        return Reply(f"answer to {question.vote}" + "." * self.length, Usage(1, 1), self.model)


def ask_cached(folder: Path, first: int, count: int) -> None:
    chat = CachedChat(Echo(), folder)
    for vote in range(first, first + count):
        assert chat.ask(asked(vote)).text == f"answer to {vote}"


def ask_recorded(path: Path, first: int, count: int) -> None:
    chat = RecordedChat(Echo(100_000), path)
    for vote in range(first, first + count):
        chat.ask(asked(vote))


def at_once(work: Callable[..., None], arguments: Sequence[tuple[Any, ...]]) -> list[int | None]:
    """Do the work in a process for each of the arguments; return how they ended."""
    context = multiprocessing.get_context("spawn")
    workers = [context.Process(target=work, args=given) for given in arguments]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(60)
    return [worker.exitcode for worker in workers]
