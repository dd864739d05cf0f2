"""Measure questions about rendered scenes: CPU, balance, language bias, and a second derivation of every answer.

    python benchmarks/vqa.py SCENES OTHER_SCENES [--twins DATASET] [--per-scene 80] [--checked N]

The language-only reader (``manitwin.scenes.vqa.blind``) is trained on the questions of SCENES and tested on those of
OTHER_SCENES, which were drawn with another seed, and then the other way round. The answers of the first N scenes of OTHER_SCENES
are derived again by ``tests/scene_answers.py``, whose ``second_scene.py`` reads the files directly and uses MuJoCo to detect
contacts.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from manitwin.scenes.scene_files import dataset_of, scene_files
from manitwin.scenes.vqa.blind import blind_scores
from manitwin.scenes.vqa.question import YES_NO, Question
from manitwin.scenes.vqa.write import generate_questions
from scene_answers import rederived
from second_scene import SecondScene, SecondView


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("scenes", type=Path)
    parser.add_argument("other_scenes", type=Path)
    parser.add_argument("--twins", type=Path)
    parser.add_argument("--per-scene", type=int, default=80)
    parser.add_argument("--checked", type=int, default=1_000_000)
    asked = parser.parse_args()
    sets = []
    for place in (asked.scenes, asked.other_scenes):
        files, start = scene_files(place), time.process_time()
        questions, _ = generate_questions(files, dataset=asked.twins, per_scene=asked.per_scene, validation_share=0.0)
        cpu_s = time.process_time() - start
        print(f"{place}: {len(files)} scenes, {len(questions)} questions, {cpu_s / len(files):.2f} CPU-s a scene")
        sets.append(questions)
    _balance(sets[1])
    _blind(sets)
    _checked(sets[1], scene_files(asked.other_scenes)[: asked.checked], asked.twins)


def _balance(questions: list[Question]) -> None:
    counts = Counter(each.category for each in questions)
    print("shares of the categories:", {name: round(count / len(questions), 3) for name, count in counts.items()})
    for family in sorted({each.family for each in questions}):
        of_family = [each for each in questions if each.family == family]
        answers = Counter(each.answer for each in of_family)
        most = answers.most_common(1)[0][1] / len(of_family)
        told = f", commonest answer {most:.3f}" if of_family[0].kind == YES_NO else ""
        print(f"  {family}: {len(of_family)} {of_family[0].kind}{told}")


def _blind(sets: list[list[Question]]) -> None:
    tables = [blind_scores(sets[0], sets[1]), blind_scores(sets[1], sets[0])]
    for family in sorted({name for table in tables for name in table}):
        found = [table[family] for table in tables if family in table]
        count = sum(each.questions for each in found)
        chance = sum(each.questions * each.chance for each in found) / count
        blind = sum(each.questions * each.blind for each in found) / count
        print(
            f"blind {family}: {count} questions, chance {chance:.3f}, blind {blind:.3f}, {100 * (blind - chance):+.1f} points"
        )


def _checked(questions: list[Question], files: list[Path], twins: Path | None) -> None:
    right, wrong = Counter[str](), Counter[str]()
    start = time.process_time()
    for file in files:
        scene = SecondScene(file.parent, Path(twins or dataset_of(file)))
        views = {camera: SecondView(scene, camera) for camera in scene.facts["cameras"]}
        for each in questions:
            if each.scene_id != scene.scene["scene_id"]:
                continue
            told = json.loads(json.dumps(each.to_json()))
            try:
                agrees, why = bool(rederived(told, views[each.camera])), ""
            except (KeyError, ValueError, StopIteration, IndexError, TypeError) as error:
                agrees, why = False, repr(error)
            (right if agrees else wrong)[each.family] += 1
            if not agrees:
                print(
                    "differs:", each.question_id, each.family, each.question, "|", each.answer, dict(each.evidence), why
                )
    print(f"derived again: {right.total()} of {right.total() + wrong.total()} agree", dict(wrong), end=" ")
    print(f"({(time.process_time() - start) / max(len(files), 1):.1f} CPU-s a scene)")


if __name__ == "__main__":
    main()
