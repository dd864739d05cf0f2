"""A data set to look at: a mug whose words are HTML, a kettle, a can, and a rejected twin; with pictures and an index."""

from __future__ import annotations

import io
import json
from pathlib import Path

from PIL import Image

from grasped_twins import write_brick
from manitwin.dataset.index.rebuild import rebuild
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.store import RECORD, write_twin_record
from scene_twins import can, write_thing
from twin_folders import write_rejected

HOSTILE = "<script>document.title='owned'</script><img src=x onerror=\"document.title='owned'\">'\"&\u202e"


def write_viewed(root: Path) -> list[str]:
    """Write the data set; returns the ids of mug, kettle, can and the rejected one."""
    made = [write_brick(root, 0, "mug"), write_brick(root, 1, "kettle"), write_thing(root, 2, can())]
    for identity, caption in zip(made, (HOSTILE, "A kettle.", "A can."), strict=True):
        folder = root / twin_name(identity)
        (folder / "views").mkdir()
        stream = io.BytesIO()
        Image.new("RGB", (64, 64), (200, 40, 40)).save(stream, "WEBP")
        for name in ("rgb_00", "marked_00"):
            (folder / "views" / f"{name}.webp").write_bytes(stream.getvalue())
        Image.new("RGB", (64, 32)).save(folder / "card.png")
        record = json.loads((folder / RECORD).read_bytes())
        record["language"]["caption"] = caption
        record["points"]["functional"][0]["description"] = caption
        record["name"] = caption if caption == HOSTILE else caption.split()[1].strip(".")
        del record["revision"], record["files"]
        write_twin_record(folder, record)
    made.append(write_rejected(root, 3))
    rebuild(DatasetRoot(root), jobs=1)
    return made
