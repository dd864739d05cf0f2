"""Event watches of an episode: presses, strikes and contact forces, recorded from physics contacts as they happen.

A watch processes the contacts of every step that it is shown. Its measurements are judged later (``goals.functional``).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from sapien import physx

from manitwin.episodes.goals.world_state import Event
from manitwin.geometry.poses import inverse, transform_points
from manitwin.physics.sapien.contacts import ContactReader, ResultantForce

Pose = Callable[[], np.ndarray]
"""Returns a frame's current pose in the world ``(4, 4)``."""


class EventWatch(Protocol):
    """Interface of event watches."""

    @property
    def events(self) -> tuple[Event, ...]:
        """The events so far, in order."""
        ...

    @property
    def force_n(self) -> float:
        """The watched force (N) at the last look."""
        ...

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Process the contacts of the last step."""
        ...


@dataclass
class ContactWatch:
    """Measures the contact force of named bodies on ``subject`` while ``asked``; records no events."""

    subject: str
    by: frozenset[str]
    force_n: float = 0.0
    asked: bool = False

    @property
    def events(self) -> tuple[Event, ...]:
        """Always empty: incidental contact is irrelevant for goals."""
        return ()

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Process the contacts of the last step."""
        push = reader.resultant_force(contacts, self.subject, self.by) if self.asked else None
        self.force_n = 0.0 if push is None else float(np.linalg.norm(push.force_n))


@dataclass
class PressWatch:
    """Records presses of a body at a place: each contact from start to end, by its largest force.

    ``subject`` and ``by`` are names of bodies; ``place`` returns the frame to press, Z out of the surface. Values:
    ``force_n``, ``off_m`` from the frame's Z axis, ``angle_rad`` between the force and -Z, ``time_s``.
    """

    subject: str
    by: frozenset[str]
    place: Pose
    force_n: float = 0.0
    _ended: list[Event] = field(default_factory=list)
    _now: Event | None = None

    @property
    def events(self) -> tuple[Event, ...]:
        """All contacts, including the current one."""
        return (*self._ended, *([] if self._now is None else [self._now]))

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Process the contacts of the last step."""
        push = reader.resultant_force(contacts, self.subject, self.by)
        self.force_n = 0.0 if push is None else float(np.linalg.norm(push.force_n))
        if push is None:
            self._ended += [] if self._now is None else [self._now]
            self._now = None
        elif self._now is None or self.force_n > self._now.values["force_n"]:
            place = self.place()
            values = {"force_n": self.force_n, **_push_offset_and_angle(push, place, -place[:3, 2]), "time_s": time_s}
            self._now = Event("pressed", self.subject, None, values)


@dataclass
class StrikeWatch:
    """Records strikes of a tool's face on another body: each contact by its first moment, with its largest force.

    ``face`` returns the face's frame in the world, Z outwards; ``timestep_s`` is the time between two looks. Values:
    ``off_m`` from the face's Z axis, ``face_radius_m``, ``angle_rad`` between the force on the struck body and Z,
    ``speed_m_s`` of the face along Z in the step before contact, ``force_n``, ``time_s``.
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
        """All contacts in order."""
        return tuple(self._events)

    def look(self, reader: ContactReader, contacts: Sequence[physx.PhysxContact], time_s: float) -> None:
        """Process the contacts of the last step."""
        push, face = reader.resultant_force(contacts, self.struck, frozenset({self.tool})), self.face()
        touched_before = self.force_n > 0
        self.force_n = 0.0 if push is None else float(np.linalg.norm(push.force_n))
        if push is None:
            if self._before is not None:
                self._speed_m_s = float((face[:3, 3] - self._before[:3, 3]) @ face[:3, 2] / self.timestep_s)
        elif not touched_before:
            values = {
                **_push_offset_and_angle(push, face, face[:3, 2]),
                "face_radius_m": self.face_radius_m,
                "speed_m_s": self._speed_m_s,
            }
            values |= {"force_n": self.force_n, "time_s": time_s}
            self._events.append(Event("struck", self.tool, self.struck, values))
        elif self.force_n > self._events[-1].values["force_n"]:
            last = self._events[-1]
            self._events[-1] = Event(last.kind, last.subject, last.second, {**last.values, "force_n": self.force_n})
        self._before = face


def _push_offset_and_angle(push: ResultantForce, frame_to_world: np.ndarray, along: np.ndarray) -> dict[str, float]:
    """Return the distance of a push from a frame's Z axis, and its angle to the direction ``along (3,)``."""
    at_m = transform_points(inverse(frame_to_world), push.at_m[None])[0]
    cosine = float(push.force_n @ along) / max(float(np.linalg.norm(push.force_n)), 1e-12)
    return {"off_m": float(np.linalg.norm(at_m[:2])), "angle_rad": float(np.arccos(np.clip(cosine, -1, 1)))}
