"""Measure how a model's dimensions affect templates fitted to photos: correct ones, wrong ones, and wrong ones corrected once.

    python benchmarks/filled_templates.py OUT [--categories mug,bottle,"frying pan"] [--seeds 1] [--elevation 30]

No model is asked. A simulated chat answers with the true dimensions of the rendered object (``template_photos``), or with the end
of each interval that is farther from the truth. The true mask is given, so that only the shape is measured. ``usual`` is built
without a model. OUT receives the compared pictures and ``results.csv``.
"""

from __future__ import annotations

import argparse
import csv
import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import trimesh
from shape_agreement import agreement
from template_photos import TemplatePhoto, photograph

from manitwin.config import VlmConfig
from manitwin.errors import Rejected
from manitwin.formats.glb import read_glb
from manitwin.models.annotators.vlm.prompt_files import load_prompts
from manitwin.models.annotators.vlm.template_reader import TemplateReader
from manitwin.models.generators.lift import LiftGenerator
from manitwin.models.generators.protocol import GenerationRequest
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.vlm.protocol import Picture, Question, Reply, Turn, Usage

ANSWERS = ("usual", "true", "wrong", "wrong, then true")


class Eyes:
    """A simulated model that chooses the right template, fills in the given dimensions, and corrects them once if asked to."""

    name, model = "benchmark", "eyes"

    def __init__(self, category: str, measures: dict[str, float], correction: dict[str, float] | None, out: Path):
        self._category, self._measures, self._correction, self._out = category, measures, correction, out
        self._looks = 0

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        """Answer a question."""
        return Reply(json.dumps(self._answer(question)), Usage(1, 1), self.model)

    def _answer(self, question: Question) -> dict[str, Any]:
        if question.name == "template":
            return {"shown": "", "category": self._category}
        if question.name == "template_measures":
            return {"shown": "", "measures": self._measures, "looks": []}
        self._looks += 1
        pictures = [cv2.imdecode(np.frombuffer(p.png, np.uint8), 1) for p in question.parts if isinstance(p, Picture)]
        cv2.imwrite(str(self._out.with_name(f"{self._out.name}-{self._looks}.png")), np.hstack(pictures))
        corrected = dict.fromkeys(self._measures) if self._correction is None else self._correction
        wrong = self._correction is not None and self._looks == 1
        said = [{"aspect": "proportions", "evidence": "too wide", "severity": "severe"}] if wrong else []
        right = "no" if wrong else "yes"
        return {"shown": "", "differences": said, "right": right, "corrected": corrected, "looks": []}


@dataclass(frozen=True)
class Result:
    """Results of one photo with one kind of answers: IoU with the mask and with the true solid, 0 to 1."""

    category: str
    seed: int
    answers: str
    primitive: str
    confidence: float | None
    outline_iou: float | None
    filled_iou: float | None
    cpu_s: float


def built(photo: TemplatePhoto, category: str, seed: int, answers: str, out: Path) -> Result:
    """Build a photo with one kind of answers and compare the result with the truth."""
    measures = load_templates()[category].measures
    limits = {name: (each.low, each.high) for name, each in measures.items()}
    truth = {name: float(np.clip(photo.made.measures[name], *limits[name])) for name in measures}
    wrong = {name: max(limits[name], key=lambda end: abs(end - truth[name])) for name in measures}
    generator = LiftGenerator()
    if answers != "usual":
        eyes = Eyes(
            category,
            truth if answers == "true" else wrong,
            truth if answers == "wrong, then true" else None,
            out / f"{category}-{seed}-{answers}",
        )
        generator = generator.guided_by(TemplateReader(eyes, VlmConfig(picture_px=512), load_prompts(None)))
    rgba = np.dstack([photo.rgb, np.where(photo.mask, 255, 0).astype(np.uint8)])
    started = time.process_time()
    try:
        made = generator.fetch(generator.submit(GenerationRequest(rgba, None, category, seed)), out)
    except Rejected:
        return Result(category, seed, answers, "rejected", None, None, None, round(time.process_time() - started, 1))
    cpu_s = round(time.process_time() - started, 1)
    (part,) = read_glb(made.path)
    solid = trimesh.Trimesh(part.vertices, part.faces, process=True, merge_tex=True, merge_norm=True)
    figures = round(agreement(solid, photo.truth).filled_iou, 3)
    residual = made.notes.get("residual", {})
    return Result(
        category,
        seed,
        answers,
        str(made.notes["primitive"]),
        made.notes.get("confidence"),
        residual.get("iou"),
        figures,
        cpu_s,
    )


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--categories", default="mug,bottle,frying pan")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--elevation", type=float, default=30.0)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    results = []
    for category in options.categories.split(","):
        for seed in range(options.seeds):
            (photo,) = photograph(category, seed, [options.elevation])
            for answers in ANSWERS:
                results.append(built(photo, category, seed, answers, options.out))
                print(results[-1], flush=True)
    with (options.out / "results.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(asdict(results[0])))
        writer.writeheader()
        writer.writerows(asdict(result) for result in results)


if __name__ == "__main__":
    main()
