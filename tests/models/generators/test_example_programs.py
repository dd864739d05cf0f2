"""The example programs of the documents: run by the command generator, with stand-ins for the packages that they need."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import trimesh
from rehearsed_jobs import made, photo

from manitwin.config import BuildConfig
from manitwin.models.fakes.meshes import bottle, glb
from manitwin.models.generators.command import CommandGenerator

EXAMPLES = Path(__file__).resolve().parents[3] / "docs" / "examples"

STAND_INS = {
    "trellis2": {
        "trellis2/__init__.py": "",
        "trellis2/pipelines.py": """
class _Mesh:
    vertices = faces = attrs = coords = layout = voxel_size = None
    def simplify(self, target): pass
class Trellis2ImageTo3DPipeline:
    @classmethod
    def from_pretrained(cls, name): return cls()
    def cuda(self): pass
    def run(self, image, seed=42):
        assert image.mode == "RGBA" and seed == 3
        return [_Mesh()]
""",
        "o_voxel/__init__.py": "from o_voxel import postprocess\n",
        "o_voxel/postprocess.py": """
import shutil
class _Glb:
    def export(self, path, extension_webp): shutil.copy(BOTTLE, path)
def to_glb(**given):
    assert set(given) >= {"vertices", "faces", "attr_volume", "coords", "attr_layout", "voxel_size", "aabb"}
    return _Glb()
""",
    },
    "sam3d": {
        "notebook/inference.py": """
import shutil
class _Glb:
    def export(self, path): shutil.copy(BOTTLE, path)
class _Pipeline:
    def run(self, image, mask, seed, **given):
        assert image.shape[2] == 4 and mask is None and seed == 3 and given["with_texture_baking"]
        return {"glb": _Glb()}
class Inference:
    def __init__(self, config, compile): self._pipeline = _Pipeline()
""",
    },
    "triposr": {
        "torch.py": """
import contextlib
class cuda:
    is_available = staticmethod(lambda: False)
no_grad = contextlib.nullcontext
""",
        "tsr/__init__.py": "",
        "tsr/utils.py": "def resize_foreground(image, ratio): return image\n",
        "tsr/system.py": """
import numpy, trimesh
class _Renderer:
    def set_chunk_size(self, size): pass
class TSR:
    renderer = _Renderer()
    @classmethod
    def from_pretrained(cls, name, config_name, weight_name): return cls()
    def to(self, device): pass
    def __call__(self, images, device):
        grey = numpy.asarray(images[0])
        assert grey.shape[2] == 3 and grey[0, 0].tolist() == [127, 127, 127]
        return "codes"
    def extract_mesh(self, codes, has_vertex_color, resolution):
        return [trimesh.creation.box((1, 2, 3))]  # 3 high along Z
""",
    },
}


@pytest.mark.parametrize("name", sorted(STAND_INS))
def test_example_says_how_it_is_used_without_its_heavy_packages(name: str) -> None:
    done = subprocess.run(
        [sys.executable, EXAMPLES / f"{name}.py", "--help"], capture_output=True, text=True, check=True
    )
    assert "image" in done.stdout and "--seed" in done.stdout
    assert "was not run here" in (EXAMPLES / f"{name}.py").read_text()


@pytest.mark.parametrize("name", sorted(STAND_INS))
def test_example_makes_a_mesh_as_a_command(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "bottle.glb").write_bytes(glb([bottle()]))
    for place, text in STAND_INS[name].items():
        path = tmp_path / place
        path.parent.mkdir(exist_ok=True)
        path.write_text(text.replace("BOTTLE", repr(str(tmp_path / "bottle.glb"))))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    more = f" --checkout {tmp_path}" if name == "sam3d" else ""
    line = f"{sys.executable} {EXAMPLES / name}.py {{image}} {{out}} --seed {{seed}}{more}"
    got = made(CommandGenerator.from_spec(line, BuildConfig()), photo(), tmp_path)
    assert got.path.read_bytes()[:4] == b"glTF" and str(got.model).endswith(f"{name}.py")


def test_triposr_example_stands_its_mesh_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    test_example_makes_a_mesh_as_a_command(tmp_path, "triposr", monkeypatch)
    extents = trimesh.load_scene(tmp_path / "generated.glb").to_mesh().extents
    assert extents.tolist() == pytest.approx([1, 3, 2])
