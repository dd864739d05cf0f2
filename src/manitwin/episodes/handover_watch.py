"""Event watch of a handover: the second arm took an object from the first and held it alone, and how it was released."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from sapien import physx

from manitwin.episodes.goals.world_state import Event
from manitwin.physics.sapien.contacts import ContactReader

HELD_ALONE_S = 0.2


@dataclass
class HandoverWatch:
    """Records that ``taker`` held ``subject`` for 0.2 s without any other contact, after ``giver`` had held it.

    Arms are given by name. ``center`` returns the object's centre of mass ``(3,)`` in the world. Values: ``rise_m``, the
    largest height while held alone, above that at the first look; ``fell_m``, its descent since the last contact of the
    second arm; ``time_s`` of the beginning. A later contact of the first arm cancels the event.
    """

    subject: str
    giver: str
    taker: str
    center: Callable[[], np.ndarray]
    force_n: float = 0.0
    _start_m: float | None = None
    _given: bool = False
    _alone_since_s: float | None = None
    _values: dict[str, float] = field(default_factory=dict)
    _let_go_m: float = 0.0

    @property
    def events(self) -> tuple[Event, ...]:
        """One event if the second arm holds the object or was the last to hold it."""
        if not self._values:
            return ()
        fell_m = max(0.0, self._let_go_m - float(self.center()[2]))
        return (Event("handed_over", self.subject, None, {**self._values, "fell_m": fell_m}),)

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Process the contacts of the last step."""
        height_m = float(self.center()[2])
        self._start_m = height_m if self._start_m is None else self._start_m
        pairs = (pair for pair in reader.pressing_pairs(contacts) if self.subject in pair)
        touching = frozenset().union(*pairs) - {self.subject}
        if self.giver in touching:
            self._given, self._values = True, {}
        if self.taker in touching:
            self._let_go_m = height_m
        if not (self._given and touching == {self.taker}):
            self._alone_since_s = None
            return
        if self._alone_since_s is None:
            self._alone_since_s = time_s
        if time_s - self._alone_since_s >= HELD_ALONE_S:
            rise_m = max(self._values.get("rise_m", 0.0), height_m - self._start_m)
            self._values = {"time_s": self._values.get("time_s", self._alone_since_s), "rise_m": rise_m}
