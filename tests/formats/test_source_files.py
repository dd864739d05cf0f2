import json
from pathlib import Path

from manitwin.formats.source_files import side_files


def test_side_files_never_leave_the_folder(tmp_path: Path) -> None:
    secret = tmp_path / "secret.png"
    secret.write_bytes(b"secret")
    folder = tmp_path / "mesh"
    folder.mkdir()
    (folder / "link.png").symlink_to(secret)
    (folder / "inside.png").write_bytes(b"fine")
    images = [
        {"uri": u}
        for u in ("../secret.png", str(secret), "link.png", "inside.png", "http://x/y.png", "data:image/png;base64,")
    ]
    (folder / "a.gltf").write_text(json.dumps({"images": images, "buffers": "nonsense"}))
    assert side_files(folder / "a.gltf") == [folder / "inside.png"]


def test_files_are_found_as_the_reader_finds_them(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text('mtllib "m.mtl"\n')
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd -bm 0.5 tex\\my map.png\nnorm %2e%2e/secret.png\n")
    (tmp_path / "tex").mkdir()
    (tmp_path / "tex" / "my map.png").write_bytes(b"png")
    assert side_files(tmp_path / "a.obj") == [tmp_path / "m.mtl", tmp_path / "tex" / "my map.png"]
