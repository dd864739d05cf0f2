"""Several questions at once: each waits for its own answer, and all are paid for by the work that asked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from manitwin.engine.charges import Bill, charge, counted, note_rehearsal

T = TypeVar("T")


def asked_together(questions: Sequence[Callable[[], T]]) -> list[T]:
    """Ask in threads of their own; return the answers in the order of the questions.

    All are waited for, and what they cost is charged, before the first error is raised, in that order.
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
    # a thread begins without the bill of the one that started it
    with counted() as bill:
        try:
            return [question()], None, bill
        except Exception as error:
            return [], error, bill
