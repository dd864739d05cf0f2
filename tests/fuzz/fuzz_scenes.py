"""What is read of scenes and of views of real ones: drawn scenes, tasks, labels, baselines, and a camera's depth and clouds."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import trimesh
from fuzz_target import Case, target
from PIL import Image

from drawn_scenes import write_drawn_scenes
from manitwin.assets.audit.baseline import read_baseline
from manitwin.dataset.evaluation.labels import read_labels
from manitwin.episodes.batch import read_batch
from manitwin.episodes.episode_pictures import read_pictures
from manitwin.episodes.tasks.task_files import read_tasks
from manitwin.errors import BadReply
from manitwin.formats.json_file import read_json_object
from manitwin.formats.label_picture import label_picture
from manitwin.models.pose_estimators.protocol import parse_guesses
from manitwin.scenes.locate.hand_eye_file import read_camera_to_base
from manitwin.scenes.locate.input_files import read_cloud, read_view
from manitwin.scenes.perception.scene_truth import read_scene_truth
from manitwin.scenes.scene_files import scene_files

CAMERA = {"fx": 60.0, "fy": 61.0, "cx": 31.5, "cy": 23.5, "width": 64, "height": 48, "depth_unit_m": 0.001}
LABELS = """file,category,category_synonyms,plausible_mass_low_kg,plausible_mass_high_kg,hollow,notes
a.glb,mug,cup;beaker,0.2,0.5,yes,"a ""large"" mug"
b.glb,hammer,,0.3,1.2,no,
"""
TASK = {
    "schema_version": 1,
    "task_id": "7b4376a65e3da9a6",
    "scene_id": "layout_2_000000",
    "scene_sha256": "1d" * 32,
    "robot": "panda",
    "seed": 1525293806113953665,
    "kind": "on",
    "source": "enumerated",
    "objects": {"object_00": "fdd6acc5207ffd7e", "object_01": "1c2fe56566f1c079"},
    "steps": [{"skill": "place_on", "target": "object_01", "partner": "object_00"}],
    "goal": {
        "literals": [{"predicate": "on", "subject": "object_01", "second": "object_00"}],
        "stays": [{"predicate": "undisturbed", "subject": "object_00"}],
    },
    "instructions": ["put the box on the board"],
    "held_out": ["please stand the box on the board"],
    "difficulty": {
        "score": 2, "literals": 1, "functional_frames": 0, "close_neighbours": 1, "tight_fits": 0, "hard_to_plan": 0,
    },
}  # fmt: skip


def view(folder: Path) -> None:
    height, width = CAMERA["height"], CAMERA["width"]
    depth = np.full((height, width), 700, np.uint16)
    depth[12:36, 20:44] = 600
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    (folder / "depth.png").write_bytes(label_picture(depth))
    (folder / "mask.png").write_bytes(label_picture((depth == 600).astype(np.uint8)))
    Image.new("RGB", (width, height), (200, 20, 20)).save(folder / "colors.png")


def read_seen(case: Case) -> None:
    names = ("depth.png", "camera.json", "colors.png", "mask.png")
    depth, camera, colors, mask = (case.folder / name for name in names)
    seen, _told = read_view(depth, camera, colors, mask)
    assert np.isfinite(seen.depth_m).all()


def clouds(folder: Path) -> None:
    points = np.random.default_rng(0).uniform((-0.05, -0.05, 0.5), (0.05, 0.05, 0.6), (400, 3))
    trimesh.PointCloud(points).export(folder / "cloud.ply")
    np.savez(folder / "cloud.npz", points=points)


def read_points(case: Case) -> None:
    seen, shown = read_cloud(case.file)
    assert seen.depth_m.shape == shown.shape


def base(folder: Path) -> None:
    (folder / "base.json").write_text(json.dumps({"camera_to_base": np.eye(4).tolist()}))
    told = {"position_m": [0.4, 0.0, 0.6], "quaternion_wxyz": [0.0, 1.0, 0.0, 0.0]}
    (folder / "pose.json").write_text(json.dumps(told))


def read_camera_pose(case: Case) -> None:
    pose = read_camera_to_base(case.file)
    assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-9)


def guessed(folder: Path) -> None:
    pose = np.eye(4)
    pose[2, 3] = 0.6
    told = {"model": "FoundationPose", "poses": [{"object_to_camera": pose.tolist(), "score": 0.9}] * 3}
    (folder / "answer.json").write_text(json.dumps(told))


def read_guesses(case: Case) -> None:
    found = parse_guesses(read_json_object(case.file, BadReply), "command")
    assert np.isfinite(found.poses).all() and (found.poses[:, 2, 3] > 0).all()


def drawn(folder: Path) -> None:
    write_drawn_scenes(folder)


def read_drawn(case: Case) -> None:
    for file in scene_files(case.folder / "scenes"):
        for picture in read_scene_truth(file).pictures:
            for pixels in (picture.rgb, picture.ids, picture.parts, picture.depth_m, picture.normals):
                assert pixels.size


def tasks(folder: Path) -> None:
    lines = (json.dumps({**TASK, "task_id": f"{number:016x}"}) for number in range(3))
    (folder / "tasks.jsonl").write_text("\n".join(lines) + "\n")


def labels(folder: Path) -> None:
    (folder / "labels.csv").write_text(LABELS)


def baseline(folder: Path) -> None:
    told = {"version": 1, "assets": {"a.urdf": ["COL007", "PHY001"], "b/model.sdf": ["GEO002"]}}
    (folder / "baseline.json").write_text(json.dumps(told))


def batch(folder: Path) -> None:
    digests = {"config_sha256": "1d" * 32, "revision": "2e" * 32, "batch_id": "00", "files": {"episodes.h5": "3f" * 32}}
    counts = {"attempted": 5, "planned": 4, "succeeded": 3, "kept": 3, "twins": {"fdd6acc5207ffd7e": "4a" * 32}}
    (folder / "batch.json").write_text(json.dumps({"schema_version": 1, **digests, **counts}))
    (folder / "pictures.json").write_text(json.dumps({**digests, "first_frames": {"traj_0": 0, "traj_1": 41}}))


target("locate-view", view, read_seen, named=True)
target("locate-cloud", clouds, read_points, named=True)
target("locate-base", base, read_camera_pose, named=True)
target("pose-answer", guessed, read_guesses, named=True)
target("drawn-scene", drawn, read_drawn, files=("scene.json", "pictures.json", "front_*.png", "*.webp"), weight=0.3)
target("tasks", tasks, lambda case: read_tasks(case.folder))
target("labels", labels, lambda case: read_labels(case.file), named=True)
target("baseline", baseline, lambda case: read_baseline(case.file), named=True)
target("batch", batch, lambda case: (read_batch(case.folder), read_pictures(case.folder)))
