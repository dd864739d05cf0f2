"""Protocol of a 3D generator: requests, jobs and results."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np

from manitwin.config import Resource
from manitwin.formats.camera_poses.posed_camera import PosedCamera
from manitwin.twin.import_record import ImportRecord

Asked = Literal["image", "text"]
"""Kind of input that a generator takes."""
MOST_PHOTOS = 72
"""Maximum number of photos of one object, one every 5 degrees: more add nothing about its shape and take memory."""
IMAGE_OR_TEXT: frozenset[Asked] = frozenset({"image", "text"})


@dataclass(frozen=True)
class PhotoView:
    """One of several photos of an object: its file name, the matted photo ``rgba (H, W, 4) uint8``, and its camera.

    ``turn_deg`` is the camera's rotation about the vertical, counter-clockwise seen from above, 0 for the first photo; None
    if not stated. ``focal_mm`` is the 35 mm equivalent focal length, None if the photo does not state it. ``pose`` is the
    camera pose if a file states it: its world frame has z up and its intrinsics are those of the uncropped photo;
    ``turn_deg`` then agrees with it.
    """

    name: str
    rgba: np.ndarray
    turn_deg: float | None
    focal_mm: float | None = None
    pose: PosedCamera | None = None


@dataclass(frozen=True)
class GenerationRequest:
    """Request for a mesh of a photo, several photos of one object, or a text.

    - ``rgba``: the matted photo, ``(H, W, 4) uint8`` upright sRGB with the object's mask as alpha; None if ``text`` is given
    - ``name``: name of the object as given by the user, or predicted by a classifier if ``guessed``
    - ``seed``: makes the result repeatable if the generator supports it
    - ``views``: all photos if there are several, with ``rgba`` the first of them; only passed to a generator with
      ``takes_views``
    - ``focal_mm``: 35 mm equivalent focal length of ``rgba``, if stated
    - ``likely``: candidate names of an unnamed object with their probabilities, the most probable first
    - ``unit_m``: length in metres of the unit of the views' poses, None if unknown
    """

    rgba: np.ndarray | None
    text: str | None
    name: str | None
    seed: int
    guessed: bool = False
    views: tuple[PhotoView, ...] = ()
    focal_mm: float | None = None
    likely: tuple[tuple[str, float], ...] = ()
    unit_m: float | None = None


@dataclass(frozen=True)
class JobState:
    """State of a job; ``message`` is the generator's reason for a failure."""

    state: Literal["queued", "running", "done", "failed"]
    message: str = ""


@dataclass(frozen=True)
class Generated:
    """A generated mesh file (GLB or USDZ, any scale) and the generator's notes on how it was made.

    - ``metric``: its unit is the true metre
    - ``rests``: it stands or lies on y = 0 in its natural pose, so the pose is kept
    - ``unseen_share``: share of the surface that neither the photo nor a model determines; None if the generator does not say
    - ``known``: what the generator knows about the object by construction, in the object frame (Z up) of its mesh
    """

    path: Path
    model: str | None
    notes: dict[str, Any] = field(default_factory=dict)
    metric: bool = False
    rests: bool = False
    unseen_share: float | None = None
    known: ImportRecord | None = None


class Generator(Protocol):
    """Protocol of a generator that turns an image or a text into a mesh.

    ``model`` names the model if known, and ``usd_per_job`` is the price of a job. ``asked_with`` lists the kinds of input
    that the generator takes, both if the attribute is missing; other inputs are refused before anything is built.

    A generator that uses several photos of an object has ``takes_views = True``; others get only the first photo. A generator
    that supports only some texts also has ``why_not(text)``, which returns why it cannot make a text, or None if it can.

    ``submit`` returns a job id that survives a restart of this process if the generator supports that. ``fetch`` may be
    called once ``poll`` returns done, and writes into ``folder``. The methods raise BackendError, or Rejected if the input is
    at fault.
    """

    name: str
    model: str | None
    needs: Resource
    usd_per_job: float
    asked_with: frozenset[Asked]

    def submit(self, request: GenerationRequest) -> str:
        """Start a job and return its id."""
        ...

    def poll(self, job_id: str) -> JobState:
        """Return the state of a job."""
        ...

    def fetch(self, job_id: str, folder: Path) -> Generated:
        """Write the finished mesh into ``folder``."""
        ...
