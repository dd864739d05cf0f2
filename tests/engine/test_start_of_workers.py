"""What a worker process loads as it starts, which it does anew after each crash."""

from __future__ import annotations

import subprocess
import sys


def test_a_worker_that_meets_no_mesh_loads_no_library_of_meshes() -> None:
    program = (
        "import sys, manitwin.engine.worker, manitwin.dataset.index.parts\n"
        "print({'scipy', 'trimesh', 'networkx'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
