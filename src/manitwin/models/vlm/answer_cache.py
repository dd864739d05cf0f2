"""Disk cache of answers by question, so that no answer is paid for twice."""

from __future__ import annotations

import json
import logging
import os
import tempfile
from hashlib import sha256
from pathlib import Path

from manitwin.engine.charges import note_rehearsal, record_charges
from manitwin.errors import BadReply
from manitwin.formats.json_file import read_json_object
from manitwin.formats.user_folders import cache_home
from manitwin.models.vlm.client import ChatClient, ChatWrapper
from manitwin.models.vlm.protocol import Question, Reply, Turn, Usage, question_digest

RUN = logging.getLogger("manitwin.run")
_MAX_BYTES = 16 << 20


def default_folder() -> Path:
    """Return ``$XDG_CACHE_HOME/manitwin/vlm``, by default under ``~/.cache`` (XDG Base Directory Specification)."""
    return cache_home() / "vlm"


class CachedChat(ChatWrapper):
    """A chat client with a disk cache of answers.

    The cache key covers the question, its turns and what else ``decides`` the answer: server, model and settings. Several
    processes may share a folder: files are written atomically, and the last of concurrent answers is kept. A cached answer
    costs nothing; one of a rehearsal is marked as such again. An unreadable file is replaced by asking again.
    """

    def __init__(self, inner: ChatClient, folder: Path):
        super().__init__(inner)
        self.folder = folder

    def __repr__(self) -> str:
        return f"Cached({self.inner!r}, {str(self.folder)!r})"

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        """Return the cached answer to a question, or ask and cache the answer."""
        path = self._path(question, turns)
        kept = _read(path)
        if kept is None:
            with record_charges() as bill:
                reply = self.inner.ask(question, turns)
            try:
                _write(path, reply, bill.rehearsed)
            except OSError as error:  # the answer was received and paid for, so this is not an error
                RUN.warning(
                    "%s: the answer is not kept (%s); look at the folder and the disk", path, error.strerror or error
                )
            return reply
        reply, rehearsed = kept
        if rehearsed:
            note_rehearsal()
        return reply

    def forget(self, question: Question, turns: tuple[Turn, ...] = ()) -> None:
        """Delete the cached answer to a question, so that it is asked again."""
        self._path(question, turns).unlink(missing_ok=True)

    def _path(self, question: Question, turns: tuple[Turn, ...]) -> Path:
        asked = json.dumps([question_digest(question, turns), dict(self.decides)], sort_keys=True)
        digest = sha256(asked.encode()).hexdigest()
        return self.folder / digest[:2] / f"{digest}.json"


def _read(path: Path) -> tuple[Reply, bool] | None:
    """Return a cached reply and whether it is a rehearsal's; None if the file is missing or invalid."""
    if not os.path.lexists(path):
        return None
    try:
        kept = read_json_object(path, BadReply, limit_bytes=_MAX_BYTES)
    except BadReply:  # truncated by a crash or altered: treated as missing
        return None
    text, model, tokens = kept.get("text"), kept.get("model"), kept.get("tokens")
    counts = isinstance(tokens, list) and len(tokens) == 2 and all(type(n) is int and 0 <= n < 10**12 for n in tokens)
    if not isinstance(text, str) or not isinstance(model, str) or not isinstance(tokens, list) or not counts:
        return None
    return Reply(text, Usage(*tokens), model), bool(kept.get("rehearsal"))


def _write(path: Path, reply: Reply, rehearsed: bool) -> None:
    """Write a reply to the cache atomically."""
    path.parent.mkdir(parents=True, exist_ok=True)
    kept = {"text": reply.text, "model": reply.model, "tokens": [reply.usage.input_tokens, reply.usage.output_tokens]}
    marked = {**kept, "rehearsal": True} if rehearsed else kept
    handle, part = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".part")
    with os.fdopen(handle, "w", encoding="utf-8") as stream:
        json.dump(marked, stream)
    try:
        os.replace(part, path)
    except OSError:
        os.unlink(part)
        raise
