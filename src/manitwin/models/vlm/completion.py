"""What a server says a model wrote, whether or not it can be used."""

from __future__ import annotations

from dataclasses import dataclass

from manitwin.engine.charges import charge
from manitwin.errors import BadReply
from manitwin.models.vlm.prices import TokenPrice
from manitwin.models.vlm.protocol import Reply, Usage


@dataclass(frozen=True)
class Completion:
    """What was written and counted; ``fault`` says why it is no answer."""

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
        return Reply(self.text, self.usage, self.model)
