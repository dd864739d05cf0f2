"""Chat clients: chat models with a price, and with what decides their answers."""

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
"""More than any question or answer has: what a server counts beyond is no count."""
MOST_CHARACTERS = 1 << 20
"""Of an answer that is read; ``vlm.max_tokens`` of 4,096 make about 16,000."""


def counted_tokens(value: Any) -> int | None:
    """Return the tokens that a server counted; None for what is no count (negative, a text, more than MOST_TOKENS)."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MOST_TOKENS:
        return None
    return value


class ChatClient(ChatModel, Protocol):
    """A chat model whose cost can be told before it is asked.

    ``price`` is what its tokens cost. ``decides`` names what else than the question decides an answer (server, model and
    settings; never a key): two clients that agree in it may share answers.
    """

    @property
    def price(self) -> TokenPrice: ...

    @property
    def decides(self) -> Mapping[str, str | float | None]: ...


class ServedChat:
    """A chat model at one server; ``key_name`` is the variable of the environment that its key was in."""

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
        """The server, the model and the settings that decide an answer besides the question."""
        settings = {"max_tokens": self._settings.max_tokens, "temperature": self._settings.temperature}
        return {"protocol": self.name, "server": self.base_url, "model": self.model, **settings}


class Around:
    """A chat client around another one, which it is like but for how it answers."""

    def __init__(self, inner: ChatClient):
        self.inner = inner
        self.name, self.model = inner.name, inner.model

    @property
    def price(self) -> TokenPrice:
        """The price of tokens, where they have to be paid."""
        return self.inner.price

    @property
    def decides(self) -> Mapping[str, str | float | None]:
        """The server, the model and the settings that decide an answer besides the question."""
        return self.inner.decides


@runtime_checkable
class Forgetful(Protocol):
    """A chat model that keeps answers, and can drop one that turned out to be of no use."""

    def forget(self, question: Question, turns: tuple[Turn, ...] = ()) -> None:
        """Drop the answer to a question: it will be asked again."""
        ...


@dataclass(frozen=True)
class Completion:
    """A server's report of what a model wrote, with its tokens; ``fault`` says why it is no answer."""

    text: str
    usage: Usage
    model: str
    fault: str | None = None

    def paid(self, price: TokenPrice, who: str) -> Reply:
        """Charge for it, and return it as an answer; raises BadReply, charged all the same, where it is none."""
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
