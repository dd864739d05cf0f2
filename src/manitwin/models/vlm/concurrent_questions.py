"""Concurrent questions: answers are collected in order, and costs are charged to the caller."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from manitwin.engine.charges import Bill, charge, note_rehearsal, record_charges

T = TypeVar("T")


def ask_concurrently(questions: Sequence[Callable[[], T]]) -> list[T]:
    """Ask questions in threads; return the answers in the order of the questions.

    All answers are waited for, and their costs charged, before the first error (in that order) is raised.
    """
    if len(questions) == 1:
        return [questions[0]()]
    with ThreadPoolExecutor(max_workers=len(questions)) as pool:
        waiting = [pool.submit(_counted, question) for question in questions]
        outcomes = [future.result() for future in waiting]
    for _, _, bill in outcomes:
        charge(bill.usd)
        if bill.rehearsed:
            note_rehearsal()
    answers = []
    for answer, error, _ in outcomes:
        if error is not None:
            raise error
        answers += answer
    return answers


def _counted(question: Callable[[], T]) -> tuple[list[T], Exception | None, Bill]:
    # a new thread does not inherit the bill of its parent thread
    with record_charges() as bill:
        try:
            return [question()], None, bill
        except Exception as error:
            return [], error, bill
