"""What a person writes: manifests, settings, and descriptions of robots and grippers."""

from __future__ import annotations

from pathlib import Path

from fuzz_target import target
from small_arm import box, mesh, small_arm

from manitwin.config import BuildConfig, load_config
from manitwin.episodes.settings import PicturesConfig, TrajectoriesConfig
from manitwin.models.annotators.vlm.prompt_files import load_prompts
from manitwin.pipeline.manifest import Notes, iterate_items
from manitwin.robots.grippers import definitions
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.load import load_robot
from manitwin.scenes.settings import LayoutsConfig

CSV = """file,text,name,units,up,license,attribution
a.glb,,mug,cm,z,CC-BY-4.0,"Ada, Bo"
,"a red
mug",red mug,,,,
sub/b.obj,,,auto,y,CC0-1.0,
"""
JSONL = """{"file": "a.glb", "name": "mug", "units": "cm", "up": "z", "license": "CC0-1.0"}
{"text": "a red mug", "attribution": "Ada", "more": {"x": [1, 2, 3]}}

{"file": "sub/b.obj", "units": "auto"}
"""
BUILD = """seed = 3
annotator = "rules"
[mesh]
[gate]
[grasps]
grippers = ["panda", "suction"]
simulated = 40
[vlm]
votes = 5
[services]
timeout_s = 30.0
usd_per_job = 0.5
usd_per_million_tokens = [2.0, 8.0]
[run]
cpu = 2
"""


def manifest(folder: Path) -> None:
    (folder / "sub").mkdir()
    for name in ("a.glb", "sub/b.obj"):
        (folder / name).write_bytes(b"x")
    (folder / "m.csv").write_text(CSV)
    (folder / "m.jsonl").write_text(JSONL)


def settings(folder: Path) -> None:
    (folder / "build.toml").write_text(BUILD)
    (folder / "layouts.toml").write_text("seed = 3\n[layout]\nobjects = [2, 5]\n")
    (folder / "trajectories.toml").write_text('seed = 1\nrobot = "panda"\n')
    (folder / "pictures.toml").write_text('cameras = ["front"]\n')


KINDS = {"layouts": LayoutsConfig, "trajectories": TrajectoriesConfig, "pictures": PicturesConfig}


def grippers(folder: Path) -> None:
    shipped = Path(definitions.__path__[0])
    for path in shipped.glob("*.toml"):
        (folder / path.name).write_bytes(path.read_bytes())


def robot(folder: Path) -> None:
    import trimesh

    trimesh.creation.box((0.3, 0.05, 0.05)).export(folder / "link.stl")
    small_arm(folder, upper=mesh("link.stl"), fore=box("0.3 0.05 0.05", "0.2 0 0"))


def prompts(folder: Path) -> None:
    from manitwin.models.annotators.vlm import annotator

    for path in (Path(annotator.__file__).parent / "prompts").glob("*.md"):
        (folder / path.name).write_bytes(path.read_bytes())


target("manifest", manifest, lambda case: list(iterate_items([case.file], {}, Notes())), files=("*.csv", "*.jsonl"))
target("settings", settings, lambda case: load_config(case.file, KINDS.get(case.file.stem, BuildConfig)))
target("grippers", grippers, lambda case: load_gripper(str(case.file)), weight=0.5)
target("robots", robot, lambda case: load_robot(str(case.folder / "small.toml")), weight=0.3)
target("prompts", prompts, lambda case: load_prompts(case.folder))
