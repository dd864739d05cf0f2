"""Build a twin of the sample mug and read it: ``python examples/build_and_read.py [TWINS]``."""

import sys
from pathlib import Path

import manitwin

SAMPLE = Path(__file__).resolve().parent.parent / "samples" / "mug.glb"


def main(out: Path) -> None:
    """Build into ``out`` (a finished twin is not built again), then print what the twin says."""
    report = manitwin.build(SAMPLE, out, name="mug", jobs=1, quick=True)
    (result,) = report.results
    print(result.status, result.folder)
    if result.folder is None or result.status != "accepted":
        sys.exit(result.detail)

    twin = manitwin.load(result.folder, verify=True)  # every file is the one that was written
    physical = twin.physical
    for name in ("mass_kg", "friction_static", "restitution"):
        number = getattr(physical, name)  # each number has an interval, and says where it is from
        print(f"{name:16} {number.value:.3g}, between {number.low:.3g} and {number.high:.3g}, by {number.source}")
    print(f"{'extents_m':16} {' x '.join(f'{side:.3f}' for side in physical.extents_m)}")
    print(f"{'hulls':16} {len(twin.hulls)} convex, {sum(hull.volume for hull in twin.hulls) * 1e6:.0f} cm3")

    grasps = twin.grasps()  # those that held in physics, best first
    print(f"{'grasps':16} {len(grasps)} hold; the best closes to {grasps.width_m[0] * 1000:.1f} mm at")
    print(grasps.gripper_to_object[0].round(3))  # +Z is the approach, X the closing direction
    for point in twin.record.points.grasp if twin.record.points else []:
        print(f"{point.id:16} {point.type}: {point.scenario}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "twins"))
