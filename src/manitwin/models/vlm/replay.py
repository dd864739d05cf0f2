"""Recording of a model's answers and replay from the record: a run can be repeated without a server or a key.

A record is JSON Lines: ``{"question", "key", "model", "text", "answered_by", "tokens": [read, written]}``. ``key`` is the
digest of the question and its turns; ``model`` is the same in all lines. Of two lines with the same key the later one counts.
An answer of a rehearsal also has ``"rehearsal": true`` and counts as a rehearsal when replayed.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from manitwin.engine.charges import note_rehearsal, record_charges
from manitwin.errors import BadReply, ConfigError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.json_file import parse_json
from manitwin.formats.printable import printable_line
from manitwin.models.vlm.client import ChatClient, ChatWrapper, ForgettingChat
from manitwin.models.vlm.prices import FREE, TokenPrice
from manitwin.models.vlm.protocol import Question, Reply, Turn, Usage, question_digest

_LONGEST_LINE = 16 << 20


class Replay:
    """A chat model that answers from a record; ``model`` is the recorded model.

    Raises ConfigError for a file that is not a record of one model, BadReply for a question that is not recorded.
    """

    name = "replay"
    price: TokenPrice = FREE

    def __init__(self, path: Path):
        self.path, self._replies, self._rehearsed = path, dict[str, Reply](), dict[str, bool]()
        models = set[str]()
        with open_regular(path, ConfigError, name=str(path)) as stream:
            for line in _lines(stream, path):
                models.add(line["model"])
                self._replies[line["key"]] = Reply(line["text"], Usage(*line["tokens"]), line["answered_by"])
                self._rehearsed[line["key"]] = bool(line.get("rehearsal"))
        if not models:
            raise ConfigError(
                f"{path}: no answer is in it; what is built already is not asked again: record into a new folder"
            )
        if len(models) != 1:
            found = printable_line(", ".join(sorted(models)), max_characters=200)
            raise ConfigError(
                f"{path}: a record is of one model, this one of {found}; record each to a file of its own"
            )
        self.model = models.pop()

    def __repr__(self) -> str:
        return f"Replay({str(self.path)!r})"

    @property
    def decides(self) -> Mapping[str, str | float | None]:
        """The recorded model, which besides the question determines an answer."""
        return {"protocol": self.name, "model": self.model}

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        """Return the recorded answer."""
        key = question_digest(question, turns)
        reply = self._replies.get(key)
        if reply is None:
            after = f" after {len(turns)} turns" if turns else ""
            raise BadReply(
                f"{self.path}: no answer to {question.name!r} (vote {question.vote}){after} is recorded: the object, its"
                " pictures, the prompt or the settings differ from those of the recording; record it again"
            )
        if self._rehearsed[key]:
            note_rehearsal()
        return reply


class RecordedChat(ChatWrapper):
    """A chat client whose answers are appended to a record, which any number of processes may share.

    An answer that is already recorded is not appended again. Raises ConfigError for a record of another model.
    """

    def __init__(self, inner: ChatClient, path: Path):
        super().__init__(inner)
        self.path = path
        self._there, self._read_to = set[tuple[str, str]](), 0
        with _locked(self.path) as stream:
            self._read_on(stream)

    def __repr__(self) -> str:
        return f"Recorded({self.inner!r}, {str(self.path)!r})"

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        """Answer a question, and record the answer."""
        with record_charges() as bill:
            reply = self.inner.ask(question, turns)
        self._record(question, question_digest(question, turns), reply, bill.rehearsed)
        return reply

    def forget(self, question: Question, turns: tuple[Turn, ...] = ()) -> None:
        """Delete the answer from the wrapped client's storage; the record is unchanged."""
        if isinstance(self.inner, ForgettingChat):
            self.inner.forget(question, turns)

    def _record(self, question: Question, key: str, reply: Reply, rehearsed: bool) -> None:
        line: dict[str, Any] = {
            "question": question.name,
            "key": key,
            "model": self.model,
            "text": reply.text,
            "answered_by": reply.model,
            "tokens": [reply.usage.input_tokens, reply.usage.output_tokens],
            **({"rehearsal": True} if rehearsed else {}),
        }
        with _locked(self.path) as stream:
            self._read_on(stream)
            if (key, reply.text) in self._there:
                return
            stream.seek(self._read_to)
            stream.truncate()  # removes an incomplete line of a writer that crashed
            stream.write(json.dumps(line).encode("ascii") + b"\n")

    def _read_on(self, stream: BinaryIO) -> None:
        """Read lines that were added since the last read; the lock must be held."""
        stream.seek(self._read_to)
        for line in _lines(stream, self.path):
            if line["model"] != self.model:
                raise ConfigError(
                    f"{self.path}: it records {line['model']}, not {self.model}; record each model to a file of its own"
                )
            self._there.add((line["key"], line["text"]))
            self._read_to = stream.tell()


@contextmanager
def _locked(path: Path) -> Iterator[BinaryIO]:
    """Open a record for reading and appending, with an exclusive lock."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if os.path.exists(path) and not os.path.isfile(path):
            raise OSError(errno.EINVAL, "no regular file")
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except (OSError, ValueError) as error:
        cause = getattr(error, "strerror", None) or error
        raise ConfigError(f"{path}: the record cannot be written ({cause}); choose another file") from None
    with os.fdopen(handle, "r+b") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)  # closing flushes, then unlocks
        yield stream


def _lines(stream: BinaryIO, path: Path) -> Iterator[dict[str, Any]]:
    """Yield the complete lines from the current position; a last line without newline was truncated by a crash and is ignored."""
    number = 0
    while (line := stream.readline(_LONGEST_LINE + 1)).endswith(b"\n"):
        number += 1
        value = parse_json(line, f"{path}: line {number}", ConfigError)
        if not _is_answer(value):
            raise ConfigError(f"{path}: line {number} is no recorded answer; record it again")
        yield value
    if len(line) > _LONGEST_LINE:
        raise ConfigError(f"{path}: line {number + 1} has more than {_LONGEST_LINE} bytes; it is no recorded answer")


def _is_answer(value: Any) -> bool:
    """Tell whether the value of a line has the form that ``Recorded`` writes."""
    if not isinstance(value, dict) or not all(
        isinstance(value.get(name), str) for name in ("key", "model", "text", "answered_by")
    ):
        return False
    tokens = value.get("tokens")
    return isinstance(tokens, list) and len(tokens) == 2 and all(type(n) is int and 0 <= n < 10**12 for n in tokens)
