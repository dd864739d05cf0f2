"""Events of an episode, latched from the contacts of physics as they happen: an object was pressed, another one struck.

A watch looks at the contacts of every step that it is shown. What it measures is judged later (``goals.functional``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from sapien import physx

from manitwin.episodes.goals.world_state import Event
from manitwin.geometry.poses import inverse, transform_points
from manitwin.physics.sapien.contacts import ContactReader, Push

Pose = Callable[[], np.ndarray]
"""Tells a frame's pose in the world ``(4, 4)`` as it is now."""


class EventWatch(Protocol):
    """The protocol of what latches events."""

    @property
    def events(self) -> tuple[Event, ...]:
        """What has happened so far, in its order."""
        ...

    @property
    def force_n(self) -> float:
        """The force (N) of what is watched, at the last look."""
        ...

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Look at the contacts of the last step."""
        ...


@dataclass
class ContactWatch:
    """Latches nothing: it tells how hard ``subject`` is pressed on by bodies, by their names, while it is ``asked``."""

    subject: str
    by: frozenset[str]
    force_n: float = 0.0
    asked: bool = False

    @property
    def events(self) -> tuple[Event, ...]:
        """None: a touch on the way says nothing of a goal."""
        return ()

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Look at the contacts of the last step."""
        push = reader.push(contacts, self.subject, self.by) if self.asked else None
        self.force_n = 0.0 if push is None else float(np.linalg.norm(push.force_n))


@dataclass
class PressWatch:
    """Latches how a body was pressed at a place: each touch from its beginning to its end, by its largest force.

    ``subject`` and ``by`` are names of bodies; ``place`` gives the frame that is to be pressed, Z out of the surface. Values:
    ``force_n``, ``off_m`` from the place across Z, ``angle_rad`` between the force and -Z, ``time_s``.
    """

    subject: str
    by: frozenset[str]
    place: Pose
    force_n: float = 0.0
    _ended: list[Event] = field(default_factory=list)
    _now: Event | None = None

    @property
    def events(self) -> tuple[Event, ...]:
        """All touches, the one that lasts included."""
        return (*self._ended, *([] if self._now is None else [self._now]))

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Look at the contacts of the last step."""
        push = reader.push(contacts, self.subject, self.by)
        self.force_n = 0.0 if push is None else float(np.linalg.norm(push.force_n))
        if push is None:
            self._ended += [] if self._now is None else [self._now]
            self._now = None
        elif self._now is None or self.force_n > self._now.values["force_n"]:
            place = self.place()
            values = {"force_n": self.force_n, **_at(push, place, -place[:3, 2]), "time_s": time_s}
            self._now = Event("pressed", self.subject, None, values)


@dataclass
class StrikeWatch:
    """Latches how a tool's face struck another body: each touch by its first moment, with the largest force of it.

    ``face`` gives the tool's face in the world, Z out of it; ``timestep_s`` is that between two looks. Values: ``off_m`` from
    the face's middle across Z, ``face_radius_m``, ``angle_rad`` between the force on what is struck and Z, ``speed_m_s`` of
    the face along Z in the step before it touched, ``force_n``, ``time_s``.
    """

    tool: str
    struck: str
    face: Pose
    face_radius_m: float
    timestep_s: float
    force_n: float = 0.0
    _events: list[Event] = field(default_factory=list)
    _before: np.ndarray | None = None
    _speed_m_s: float = 0.0

    @property
    def events(self) -> tuple[Event, ...]:
        """All touches in their order."""
        return tuple(self._events)

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Look at the contacts of the last step."""
        push, face = reader.push(contacts, self.struck, frozenset({self.tool})), self.face()
        touched_before = self.force_n > 0
        self.force_n = 0.0 if push is None else float(np.linalg.norm(push.force_n))
        if push is None:
            if self._before is not None:
                self._speed_m_s = float((face[:3, 3] - self._before[:3, 3]) @ face[:3, 2] / self.timestep_s)
        elif not touched_before:
            values = {**_at(push, face, face[:3, 2]), "face_radius_m": self.face_radius_m, "speed_m_s": self._speed_m_s}
            values |= {"force_n": self.force_n, "time_s": time_s}
            self._events.append(Event("struck", self.tool, self.struck, values))
        elif self.force_n > self._events[-1].values["force_n"]:
            last = self._events[-1]
            self._events[-1] = Event(last.kind, last.subject, last.second, {**last.values, "force_n": self.force_n})
        self._before = face


def _at(push: Push, frame_to_world: np.ndarray, along: np.ndarray) -> dict[str, float]:
    """Return how far from a frame's Z axis a push is, and its angle to a direction ``(3,)``."""
    at_m = transform_points(inverse(frame_to_world), push.at_m[None])[0]
    cosine = float(push.force_n @ along) / max(float(np.linalg.norm(push.force_n)), 1e-12)
    return {"off_m": float(np.linalg.norm(at_m[:2])), "angle_rad": float(np.arccos(np.clip(cosine, -1, 1)))}
