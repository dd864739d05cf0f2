"""What this package's own chat models have besides answering: a price, and what decides their answers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

from manitwin.models.vlm.prices import TokenPrice
from manitwin.models.vlm.protocol import ChatModel, Question, Turn


class ChatClient(ChatModel, Protocol):
    """A chat model whose cost can be told before it is asked.

    ``price`` is what its tokens cost. ``decides`` names what else than the question decides an answer (server, model and
    settings; never a key): two clients that agree in it may share answers.
    """

    @property
    def price(self) -> TokenPrice: ...

    @property
    def decides(self) -> Mapping[str, str | float | None]: ...


class Around:
    """A chat client around another one, which it is like but for how it answers."""

    def __init__(self, inner: ChatClient):
        self.inner = inner
        self.name, self.model = inner.name, inner.model

    @property
    def price(self) -> TokenPrice:
        """What tokens cost, where they have to be paid."""
        return self.inner.price

    @property
    def decides(self) -> Mapping[str, str | float | None]:
        """What decides an answer besides the question."""
        return self.inner.decides


@runtime_checkable
class Forgetful(Protocol):
    """A chat model that keeps answers, and can drop one that turned out to be of no use."""

    def forget(self, question: Question, turns: tuple[Turn, ...] = ()) -> None:
        """Drop the answer to a question: it will be asked again."""
        ...
