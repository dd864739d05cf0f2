"""What a worker process loads as it starts, which it does anew after each crash."""

from __future__ import annotations

from imported_modules import imported_of


def test_a_worker_that_meets_no_mesh_loads_no_library_of_meshes() -> None:
    loaded = imported_of({"scipy", "trimesh", "networkx"}, "manitwin.engine.worker", "manitwin.dataset.index.parts")
    assert loaded == set()
