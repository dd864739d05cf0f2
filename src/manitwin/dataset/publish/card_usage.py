"""The part of the dataset card that tells how to load a published data set, and in which frames its numbers are."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, Protocol


class Facts(Protocol):
    """What the examples are made of: any one twin."""

    @property
    def twins(self) -> Sequence[Mapping[str, Any]]: ...


_TEXT = """\
## How to load it

The tables, and from them the shards that hold what you want ([datasets](https://huggingface.co/docs/datasets); `PATH` is
this folder or the name of its repository):

```python
from datasets import load_dataset

twins = load_dataset(PATH, "twins", split="train")
wanted = twins.filter(lambda twin: twin["category"] == "{category}" and twin["verified"] >= 20)
shards = sorted(set(wanted["shard"]))  # ["{shard}"]
grasps = load_dataset(PATH, "grasps", split="train")  # also: points, placements, shards
```

The twins, as a stream ([webdataset](https://github.com/webdataset/webdataset); of a repository, `PATH` here is
`https://huggingface.co/datasets/NAME/resolve/main`):

```python
import io, json
import trimesh, webdataset

for sample in webdataset.WebDataset([f"{{PATH}}/{{shard}}" for shard in shards], shardshuffle=False):
    twin = json.loads(sample["twin.json"])
    visual = trimesh.load(io.BytesIO(sample["visual.glb"]), file_type="glb")  # Y-up
    hulls = trimesh.load(io.BytesIO(sample["collision.zip"]), file_type="zip")  # a scene of convex hulls, Z-up
```

The twins as folders, checked against their digests, ready for SAPIEN and MuJoCo, with manitwin:

```python
import manitwin
from manitwin.dataset.publish.unpack import unpack_shard

for folder in unpack_shard("{shard}", "unpacked"):
    twin = manitwin.load(folder)
    twin.grasps().gripper_to_object  # (N, 4, 4), the verified ones
```

## What a sample has

| part | what it is |
| --- | --- |
| `twin.json` | everything that is known of the object, with sources, intervals and the sha256 of every file |
| `visual.glb` | the textured mesh, metres, Y-up (glTF's rule) |
| `collision.zip` | convex hulls `hull_00.obj` ..., metres, object frame, stored uncompressed |
| `grasps.parquet` | every grasp that was tried, held or failed |
| `rgb_00.webp` ... | pictures from eight sides |
| `marked_00.webp` ... | the same with the numbered candidate points |
| `card.png` | one picture of all that |
| `source.*` or `prompt.txt` | what the twin was made of, byte for byte |
| `run.json` | seconds and cost of each stage |

The key of a sample is the `twin_id`, the same in all tables.

## Frames and units

SI units everywhere: metres, kilograms, seconds, newtons, radians. Quaternions are **wxyz**.

- **Object frame**: right-handed, +Z up, origin at the bottom centre: the object stands on z = 0. GLB files are Y-up:
  object (x, y, z) is glTF (x, z, -y).
- **Grasp frame**: origin at the gripper's base link, +Z the approach, X the closing direction. `position_m` and
  `quaternion_wxyz` of a grasp are the pose of that frame in the object frame; the fingertips' centre lies `depth_m` along
  +Z. A Panda's `panda_hand` closes along Y: turn it by 90 degrees about Z.
- **Placement**: the pose of the object frame in a frame on the supporting plane (z = 0, z up).
- `outcome` of a grasp is `held`, or where it failed: collides, unreachable, misses, penetrates, drops, unstable, slips.
  A `proposer` that ends in `:unfiltered` is a sample taken before any filter, one that ends in `:jittered` a negative
  control: leave both out of success rates.
- Mass, friction and size are estimates with an interval unless `mass_source` says `measured`."""


def usage_text(facts: Facts) -> list[str]:
    """Return the lines of both sections, with one of the data set's own categories and shards in the examples."""
    example = max(facts.twins, key=lambda twin: (twin["verified"], twin["twin_id"]))
    category = re.sub(r"[^\w .-]", "", str(example["category"]))  # it stands in code
    return _TEXT.format(category=category, shard=example["shard"]).splitlines()
