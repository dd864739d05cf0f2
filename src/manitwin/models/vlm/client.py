"""Chat clients: chat models with a price and an identity that determines their answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from manitwin.config import ServicesConfig, VlmConfig
from manitwin.engine.charges import charge
from manitwin.errors import BadReply
from manitwin.models.vlm.prices import TokenPrice, token_price
from manitwin.models.vlm.protocol import ChatModel, Question, Reply, Turn, Usage

MOST_TOKENS = 100_000_000
"""Upper bound of plausible token counts; larger counts of a server are ignored."""
MOST_CHARACTERS = 1 << 20
"""Maximum length of an answer; a ``vlm.max_tokens`` of 4,096 gives about 16,000 characters."""


def counted_tokens(value: Any) -> int | None:
    """Return a token count of a server if it is a plausible integer, else None."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MOST_TOKENS:
        return None
    return value


class ChatClient(ChatModel, Protocol):
    """A chat model whose cost is known before it is asked.

    ``price`` is the price of its tokens. ``decides`` holds what, besides the question, determines an answer (server, model
    and settings; never a key): two clients with equal values may share answers.
    """

    @property
    def price(self) -> TokenPrice: ...

    @property
    def decides(self) -> Mapping[str, str | float | None]: ...


class ServedChat:
    """Base class of a chat model at one server; ``key_name`` is the environment variable of its key."""

    name: str

    def __init__(self, model: str, base_url: str, settings: VlmConfig, services: ServicesConfig, key_name: str):
        self.model, self.base_url = model, base_url
        self.price = token_price(model, base_url, services)
        self._settings, self._services, self._who = settings, services, f"{model} at {base_url}"
        self._remedy = f"set a valid key in {key_name}, and check the account's credit and its right to the model"

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.model!r}, {self.base_url!r})"

    @property
    def decides(self) -> Mapping[str, str | float | None]:
        """Server, model and settings, which besides the question determine an answer."""
        settings = {"max_tokens": self._settings.max_tokens, "temperature": self._settings.temperature}
        return {"protocol": self.name, "server": self.base_url, "model": self.model, **settings}


class ChatWrapper:
    """Base class of a chat client that wraps another one."""

    def __init__(self, inner: ChatClient):
        self.inner = inner
        self.name, self.model = inner.name, inner.model

    @property
    def price(self) -> TokenPrice:
        """Price of tokens that have to be paid."""
        return self.inner.price

    @property
    def decides(self) -> Mapping[str, str | float | None]:
        """Server, model and settings, which besides the question determine an answer."""
        return self.inner.decides


@runtime_checkable
class ForgettingChat(Protocol):
    """A chat model that stores answers and can delete one that proved useless."""

    def forget(self, question: Question, turns: tuple[Turn, ...] = ()) -> None:
        """Delete the stored answer to a question, so that it is asked again."""
        ...


@dataclass(frozen=True)
class Completion:
    """A server's completion with its token usage; ``fault`` says why it is not a usable answer."""

    text: str
    usage: Usage
    model: str
    fault: str | None = None

    def paid(self, price: TokenPrice, who: str) -> Reply:
        """Charge for the completion and return it as an answer; raises BadReply, after charging, if it is not usable."""
        charge(price.usd(self.usage))
        if self.fault is None and not self.text.strip():
            raise BadReply(f"{who}: its answer is empty; ask again, or choose another model")
        if self.fault is not None:
            raise BadReply(f"{who}: {self.fault}")
        if len(self.text) > MOST_CHARACTERS:
            raise BadReply(
                f"{who}: its answer has more than {MOST_CHARACTERS} characters; ask again, or choose another model"
            )
        return Reply(self.text, self.usage, self.model)
