"""All targets: importing this adds them."""

from __future__ import annotations

import fuzz_assets
import fuzz_collections
import fuzz_datasets
import fuzz_episodes
import fuzz_images
import fuzz_meshes
import fuzz_scenes
import fuzz_services
import fuzz_texts
import fuzz_twins

__all__ = [
    "fuzz_assets",
    "fuzz_collections",
    "fuzz_datasets",
    "fuzz_episodes",
    "fuzz_images",
    "fuzz_meshes",
    "fuzz_scenes",
    "fuzz_services",
    "fuzz_texts",
    "fuzz_twins",
]
