"""A chat model that answers from a list, and a subject with pictures to ask it about."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image

from handmade import visual
from manitwin.config import BuildConfig, VlmConfig
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import farthest_point_sampling, sample_surface
from manitwin.models.annotators.protocol import PointsRequest, Subject
from manitwin.models.annotators.vlm.annotator import VlmAnnotator
from manitwin.models.vlm.protocol import Question, Reply, Turn, Usage
from manitwin.render.cameras import orbit_cameras
from manitwin.render.raycast import cast_camera, visible_points

Answer = dict[str, Any] | Callable[[Question], dict[str, Any]]
SIZE_PX = 256


class ScriptedChat:
    """Gives the answers in order, the last one for ever; keeps what was asked."""

    name, model = "scripted", "eyes-1"

    def __init__(self, *answers: Answer):
        self.answers = list(answers)
        self.asked: list[tuple[Question, tuple[Turn, ...]]] = []

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        self.asked.append((question, turns))
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        value = answer(question) if callable(answer) else answer
        return Reply(json.dumps(value), Usage(1000, 100), self.model)

    def complaint(self) -> str:
        """What was said to be wrong the last time that something was asked again."""
        return next(turns[-1].text for _, turns in reversed(self.asked) if turns)


def annotator(chat: ScriptedChat, **vlm: Any) -> VlmAnnotator:
    return VlmAnnotator(chat, BuildConfig(vlm=VlmConfig(**vlm)))


def changed(answer: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return copy.deepcopy(answer) | changes


def subject(mesh: trimesh.Trimesh, folder: Path, name: str | None, *, metric: bool = True) -> Subject:
    """The mesh with eight pictures: its silhouette in dark grey on light grey."""
    cameras = orbit_cameras(np.asarray(mesh.vertices), fov_y_deg=30.0, size_px=SIZE_PX)
    caster, views = RayCaster(mesh), []
    for number, camera in enumerate(cameras):
        face = cast_camera(caster, camera)[2]
        picture = np.where((face >= 0)[..., None], 90, 230).astype(np.uint8).repeat(3, axis=2)
        views.append(folder / f"rgb_{number:02d}.webp")
        Image.fromarray(picture).save(views[-1], lossless=True)
    return Subject(
        name, mesh, (visual(mesh, baseColorFactor=[120, 120, 120, 255]),), metric, tuple(views), tuple(cameras), 0
    )


def points_request(mesh: trimesh.Trimesh, folder: Path, name: str | None, count: int = 42) -> PointsRequest:
    """Candidates by farthest point sampling, seen where rays say so."""
    of = subject(mesh, folder, name)
    points, normals, _ = sample_surface(mesh, 4000, np.random.default_rng(0))
    chosen = farthest_point_sampling(points, count)
    caster = RayCaster(mesh)
    seen = [visible_points(points[chosen], normals[chosen], camera, caster, 1e-3) for camera in of.cameras]
    visible = tuple(tuple(int(i) for i in np.flatnonzero(row)) for row in seen)
    return PointsRequest(of, points[chosen], normals[chosen], (), visible, mesh.center_mass, 0.08)
