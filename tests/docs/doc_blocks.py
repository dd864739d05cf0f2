"""Blocks that are no program: settings by who reads them, manifests, and lists of files by the folder that they are of."""

from __future__ import annotations

import csv
import json
import re
import tomllib
from collections.abc import Callable
from fnmatch import fnmatchcase
from importlib.metadata import EntryPoint
from itertools import pairwise
from pathlib import Path

import yaml
from doc_shell import Shell
from PIL import Image

from input_items import collect_items
from manitwin.config import BuildConfig, load_config
from manitwin.models.annotators.priors import _build_prior, _read, load_priors
from manitwin.models.registry import GROUP
from manitwin.robots.load import load_robot

ARM_LINKS = ("base", *(f"l{i}" for i in range(1, 6)), "tool0")


def read_block(text: str, kind: str, folder: Path) -> None:
    """Have a block read by what reads such a file: ``kind`` is that of the table, and an argument."""
    name, _, argument = kind.partition(" ")
    READERS[name](text, folder, argument)


def _settings(text: str, folder: Path, name: str) -> None:
    """Settings that change something; they are added to the file ``name``, if the page says that they are in it."""
    file = folder / "block.toml"
    file.write_text(text)
    assert load_config(file) != BuildConfig(), "it is what holds anyway"
    if name:
        with (folder / name).open("a") as written:
            written.write(text)
        load_config(folder / name)


def _prior_of_a_category(text: str, folder: Path, domain: str) -> None:
    for category, row in tomllib.loads(text).items():
        assert category not in load_priors(), "it is there already"
        _build_prior(category, row, domain, _read(domain).get("defaults", {}), _read("forms"))


def _robot(text: str, folder: Path, name: str) -> None:
    """A robot's file, beside a URDF that has the joints that it names; of two arms, those of robots that are shipped."""
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).write_text(text)
    if "arms" in tomllib.loads(text):
        assert [arm.name for arm in load_robot(str(folder / name)).arms] == ["giver", "taker"]
        return
    urdf = (folder / name).parent / tomllib.loads(text)["urdf"]["file"]
    urdf.parent.mkdir(parents=True)
    solid = '<collision><origin xyz="0 0 0.05"/><geometry><box size="0.05 0.05 0.1"/></geometry></collision>'
    links = [f'<link name="{link}">{solid if link != "tool0" else ""}</link>' for link in ARM_LINKS]
    joints = [
        f'<joint name="j{i}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="0 0 0.15"/>'
        f'<axis xyz="0 {i % 2} {(i + 1) % 2}"/><limit lower="-3" upper="3" velocity="2" effort="9"/></joint>'
        for i, (parent, child) in enumerate(pairwise(ARM_LINKS), 1)
    ]
    urdf.write_text(f'<robot name="my_arm">{"".join(links + joints)}</robot>')
    assert len(load_robot(str(folder / name)).arm_joints) == len(joints)


def _entry_point(text: str, folder: Path, argument: str) -> None:
    groups = tomllib.loads(text)["project"]["entry-points"]
    assert list(groups) == [GROUP]
    for name, value in groups[GROUP].items():
        assert EntryPoint(name, value, GROUP).module.isascii()


def _tree(text: str, folder: Path, pattern: str) -> None:
    """A list of files: of each line all that stands before two spaces is in the folder."""
    root = next(folder.glob(pattern), None)
    assert root is not None, f"nothing is at {pattern}"
    for line in text.splitlines()[1:]:
        names = re.sub(r"<[^>]*>", "*", re.split(r"\s{2,}", line.strip())[0]).removesuffix(" ...")
        missing = [name for name in names.split() if not list(root.glob(name.rstrip("/")))]
        assert not missing, f"{missing} is not in {pattern}"


def _manifest(text: str, folder: Path, argument: str) -> None:
    (folder / "manifest.csv").write_text(text)
    items, notes = collect_items([folder / "manifest.csv"])
    rows = list(csv.DictReader(text.splitlines()))
    grouped = [row["group"] for row in rows if row.get("group")]
    assert len(items) == len(rows) - len(grouped) + len(set(grouped)) and not notes.remarks


def _account(text: str, folder: Path, name: str) -> None:
    """What is said of a folder of a mesh with its material and texture, five photos, and a file of words."""
    (folder / name).mkdir()
    (folder / name / "thing.obj").write_text("mtllib thing.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n")
    (folder / name / "thing.mtl").write_text("newmtl paint\nmap_Kd paint.png\n")
    for image in ("paint.png", *(f"photo{i}.jpg" for i in range(1, 6))):
        Image.new("RGB", (16, 16)).save(folder / name / image)
    (folder / name / "notes.txt").write_text("words")
    assert collect_items([name])[1].remarks == text.splitlines()


def _answer(text: str, folder: Path, command: str) -> None:
    """The JSON that a command prints which ends with an error; three dots stand for anything."""
    documented = json.loads(text)
    said = json.loads(Shell(folder).run(f"{command} 2>/dev/null", exits=documented["error"]["exit_status"]))
    assert fnmatchcase(json.dumps(said), json.dumps(documented).replace("[", "[[]").replace("...", "*"))


def _hooks(text: str, folder: Path, _: str) -> None:
    """A configuration of pre-commit: its local hooks are run on the folder."""
    for repository in yaml.safe_load(text)["repos"]:
        assert repository["repo"] == "local"
        for hook in repository["hooks"]:
            assert {"id", "name", "entry", "language"} <= hook.keys()
            Shell(folder).run(hook["entry"])


def _workflow(text: str, folder: Path, _: str) -> None:
    """A workflow of GitHub: the steps of this program are run, and what is uploaded is there afterwards."""
    steps = [step for job in yaml.safe_load(text)["jobs"].values() for step in job["steps"]]
    own = [step["run"] for step in steps if step.get("run", "").startswith("manitwin")]
    assert own
    for command in own:
        Shell(folder).run(command)
    for step in steps:
        if file := step.get("with", {}).get("sarif_file"):
            assert json.loads((folder / file).read_bytes())["version"] == "2.1.0"


READERS: dict[str, Callable[[str, Path, str], None]] = {
    "settings": _settings,
    "prior": _prior_of_a_category,
    "robot": _robot,
    "entry_point": _entry_point,
    "tree": _tree,
    "manifest": _manifest,
    "account": _account,
    "answer": _answer,
    "hooks": _hooks,
    "workflow": _workflow,
}
