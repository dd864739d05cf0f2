"""Isaac Lab export: the USD export and a module with the RigidObjectCfg that spawns it."""

from __future__ import annotations

import json

from manitwin.assets.writers import usd
from manitwin.assets.writers.exporter import Exported, TwinContent

_MODULE = '''"""Isaac Lab configuration of one object: a dynamic rigid body in metres, +Z up, its origin at the bottom centre.

    from {module} import {constant}
    class MySceneCfg(InteractiveSceneCfg):
        thing = {constant}.replace(prim_path="{{ENV_REGEX_NS}}/{name}")

On a surface of height h it stands at init_state.pos = (x, y, h), unturned.
"""

# twin {twin_id}, revision {revision}
# source {source}, licence {license}, attribution {attribution}

from pathlib import Path

import isaaclab.sim as sim_utils
from isaaclab.assets import RigidObjectCfg

{constant} = RigidObjectCfg(
    prim_path="/World/{name}",
    # mass, centre of mass, inertia, friction and collision shapes are in the stage: no mass_props and no collision_props
    # here, for they would write over them
    spawn=sim_utils.UsdFileCfg(usd_path=str(Path(__file__).resolve().parent / "{main}")),
)
'''


def export(twin: TwinContent) -> Exported:
    """Return the USD export with ``<name>_cfg.py`` beside it.

    No initial pose is written, because quaternions are wxyz up to Isaac Lab 2.x and xyzw from 3.0. Source: Isaac Lab 2.x and
    3.0, isaaclab.assets.RigidObjectCfg and isaaclab.sim.UsdFileCfg.
    """
    stage = usd.export(twin.as_one_body())
    module, source = f"{twin.name}_cfg", twin.record.source
    text = _MODULE.format(
        module=module,
        constant=f"{twin.name.upper()}_CFG",
        name=twin.name,
        main=stage.main,
        twin_id=twin.record.twin_id,
        revision=twin.record.revision,
        source=_quoted(source.file),
        license=_quoted(source.license),
        attribution=_quoted(source.attribution or "none given"),
    )
    return Exported(
        {**stage.files, f"{module}.py": text.encode()},
        f"{module}.py",
        (
            f"{module}.py has not been run in Isaac Lab, which needs Isaac Sim and its GPU; its names are those of "
            "Isaac Lab 2.x and 3.0",
            "setting mass_props or scale in UsdFileCfg writes over the mass, or leaves it at that of another size",
            *stage.cannot_say,
        ),
    )


def _quoted(text: str) -> str:
    """Quote free text as one line that cannot end a comment."""
    return json.dumps(text, ensure_ascii=False)
