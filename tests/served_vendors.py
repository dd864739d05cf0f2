"""Rodin and Tripo as fakes on this machine, and generators that ask them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from generator_runs import KEY
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.rodin import FakeRodin
from manitwin.models.fakes.server import FakeServer
from manitwin.models.fakes.tripo import FakeTripo
from manitwin.models.generators.rodin import RodinGenerator
from manitwin.models.generators.tripo import TripoGenerator

VENDORS: dict[str, tuple[Any, Any, str, str]] = {
    "rodin": (FakeRodin, RodinGenerator, "/api/v2", "/rodin"),
    "tripo": (FakeTripo, TripoGenerator, "/v2/openapi", "/task"),
}
MODELS = {"rodin": "Regular", "tripo": "v2.5-20250123"}


@dataclass
class Vendor:
    """A fake service and how to reach it."""

    name: str
    fake: Any
    server: FakeServer
    waits: list[float]

    def generator(self, settings: Any) -> Any:
        """A new generator as from_spec makes it, but for the waits of its client, which are not waited."""
        _, kind, prefix, _ = VENDORS[self.name]
        key = os.environ.get(f"{self.name.upper()}_API_KEY")
        return kind(MODELS[self.name], self.server.url + prefix, key, settings, sleep=self.waits.append)

    @property
    def submits(self) -> int:
        """How many tasks were asked for, taken or not."""
        path = VENDORS[self.name][2] + VENDORS[self.name][3]
        return sum(request.method == "POST" and request.path == path for request in self.server.requests)

    @property
    def seeds(self) -> list[int]:
        if self.name == "rodin":
            return [int(task.form["seed"]) for task in self.fake.tasks.values()]
        return [task.input["model_seed"] for task in self.fake.tasks.values()]


@contextmanager
def serving(name: str, **faults: int) -> Iterator[Vendor]:
    fake = VENDORS[name][0](Faults(faults), KEY)
    with FakeServer(fake) as server:
        yield Vendor(name, fake, server, [])


def set_keys(monkeypatch: Any) -> None:
    """Set the fakes' key in the environment of a test."""
    for variable in ("RODIN_API_KEY", "TRIPO_API_KEY"):
        monkeypatch.setenv(variable, KEY)
