"""Generate docs/audit.md from the audit rules.

python docs/make_audit_page.py            writes the page
python docs/make_audit_page.py --check    exits with status 1 if the page is out of date
"""

from __future__ import annotations

import sys
from pathlib import Path

from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.rules import MODULES, RULES

PAGE = Path(__file__).parent / "audit.md"
INTRODUCTION = """# Audit: is this asset true?

`manitwin audit` finds what is wrong with assets of any tool: mass, inertia, collision, scale, frames, grasps, files and licences.

```sh
manitwin audit PATH...
manitwin audit ASSETS --select MAS,INE001 --ignore LIC --format sarif > audit.sarif
manitwin audit ASSETS --fix --jobs 2
manitwin audit ASSETS --write-baseline audit_baseline.json
manitwin audit ASSETS --baseline audit_baseline.json
manitwin audit ASSETS --engines mujoco,sapien,pybullet
manitwin audit ASSETS --engine mujoco --html audit.html
manitwin audit --explain INE004
```

It reads every asset at or below the paths (twins, URDF, MJCF, SDF, USD, and folders of RoboTwin, ManiTwin-100K, EmbodiedGen and
Google Scanned Objects), holds the rules below against it, and prints what it found: no GPU, no model, nothing is downloaded. Exit
status: 0 no errors, 1 errors, 2 wrong use.

- **error**: what the asset says is wrong, and simulation with it too. **warning**: something that a simulator needs is not said,
  or looks wrong and may be meant. **note**: worth knowing.
- Rules are chosen by code or by the beginning of one; the longer beginning wins, so `--select INE001 --ignore INE` leaves INE001.
  What cannot be read or measured (FIL001, FIL005, FIL006) is said whatever is selected.
- What an asset names (meshes, textures, includes) is read from beside it and from above it up to its **root**: the folder that
  you gave; of a single file the repository (`.git`) that it lies in, or its package or model (`package.xml`, `model.config`), or
  its own folder. FIL007 notes what was read from above. Descriptions without a shape, which others include, are no assets,
  nor are worlds that only include models, USD layers that show nothing by themselves, and templates with words where numbers
  should be. What one loader takes and another refuses is read as the more lenient one
  does, and FIL009 says so, as it does of files that lie elsewhere below the root than the asset says.
- What most assets of a folder have in common (LIC001, LIC002, FRI001) is said once, with the count; JSON and SARIF have each.
- One cause is one finding: of an object in millimetres the size is wrong, and its mass, inertia and grasps are not held
  against it; of one that lacks a mesh the file is missing, and what is left of its shape is not judged.
- What stands fast (`<static>` in SDF; in MJCF shapes of the world, and bodies without a joint beside others that have one) is
  asked for no mass, inertia, friction or collision. Its size and mass are held against a category where the asset declares one or
  its name says no less: a "lock" need not be a padlock, a "truck" no toy. What is soft is asked for nothing of a rigid body.
- `--fix` writes what follows from the asset's own words, each file whole, with the old one beside it as `<name>.orig`. It never
  moves an origin.
- `--write-baseline FILE` notes what is found of each asset, and `--baseline FILE` leaves that out from then on: a project with
  old findings fails for new ones alone ([in continuous integration](audit_in_ci.md)). A
  finding is known by its asset's path from the baseline's folder and its rule.
- `--html FILE` writes a page of all findings: by rule, by cause of what could not be read, and the 24 worst assets with what is
  seen beside what collides. It is one file that loads nothing else.
- Of twenty assets and more it ends with what they amount to: by rule, what could not be read and why, and the worst ones.
- `--engine mujoco|pybullet|sapien|physx|gazebo` judges collision shapes (COL) as that engine takes them: PyBullet makes a hull of
  each group of an OBJ file, MuJoCo, SAPIEN and PhysX one hull of a mesh, Gazebo collides with the triangles, whose hulls are
  not judged. Without it the groups of an OBJ count as their author divided them.
- `--engines` also runs each asset (the RUN rules): its collision shapes, with its declared mass, centre of mass, inertia and
  friction (0.5 where it declares none), are put down on a plane from 5 mm, as they stand in the file, in each of the engines at
  its usual step and at half of it, for 4 s. What declares no mass or inertia is not run, and that is said. Convex hulls of the
  shapes are taken, as the engines do of bodies that move; joints do not move. A ball that fits into the opening that is seen is
  dropped into it, and has to stay there. PyBullet is one's own to install.
- What joints move is held against the rest of the file with it (RUN009, RUN010, in URDF, SDF and MJCF): parts that lie in each
  other or in the ground as the asset is loaded, and joints whose range leads a part through what holds it. Of an MJCF the
  overlaps are MuJoCo's own contacts.
- `--format json` has the numbers behind every finding; `sarif` (2.1.0) is what code hosts show beside a change.

[Findings checked by hand](audit_checked.md) says how often it is right.

From Python: `manitwin.audit_assets(["assets"], ignore=["LIC"], jobs=2)` returns what was found of each asset.

This page is written by `python docs/make_audit_page.py`.
"""


def section(rule: Rule) -> str:
    """Return the section of one rule, with an anchor named by its code."""
    fix = " `--fix` can mend it." if rule.fix is not None and "--fix" not in rule.remedy else ""
    head = f'<a id="{rule.code.lower()}"></a>\n### {rule.code} {rule.name}\n\n'
    return f"{head}*{rule.severity}.* {rule.why}\n\n{rule.remedy}{fix}\n"


def page() -> str:
    """Return the whole page."""
    text = [INTRODUCTION, "| code | name | severity |", "|---|---|---|"]
    text += [f"| [{rule.code}](#{rule.code.lower()}-{rule.name}) | {rule.name} | {rule.severity} |" for rule in RULES]
    for module in MODULES:
        text += ["", f"## {(module.__doc__ or '').strip()}", ""]
        text += [section(rule) for rule in module.RULES]
    return "\n".join(text).rstrip() + "\n"


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        current = PAGE.is_file() and PAGE.read_text(encoding="utf-8") == page()
        sys.exit(0 if current else "docs/audit.md is out of date: python docs/make_audit_page.py")
    PAGE.write_text(page(), encoding="utf-8")
