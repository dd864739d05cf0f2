"""Make layouts.png, episode.png and episode.webp beside this file from twins of the project's samples.

    manitwin build samples/samples.csv -o demo
    python docs/make_data_pictures.py demo

layouts.png shows a layout on each kind of furniture with depth, normals and instance ids; episode.png shows moments of one
episode from three cameras; episode.webp shows the whole episode.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from picture_file import of_episode, of_scene, save_picture
from PIL import Image

from manitwin.episodes.cameras import named_cameras
from manitwin.episodes.collect import batch_folders, stored_episodes
from manitwin.episodes.episodes_run import make_episodes
from manitwin.episodes.replay_pictures import EpisodeReplay, twin_drawable
from manitwin.episodes.settings import TrajectoriesConfig
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.episodes.video import write_animation
from manitwin.render.false_colors import depth_in_colors, depth_range_m, ids_in_colors
from manitwin.robots.load import load_robot
from manitwin.scenes.furniture_pictures import render_lighting
from manitwin.scenes.layouts.layouts_run import make_layouts
from manitwin.scenes.layouts.previews import scene_pictures
from manitwin.scenes.scene import Furniture, Light
from manitwin.scenes.scene_files import read_scene, scene_name
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings
from manitwin.twin.loaded_twin import TwinSource

DOCS = Path(__file__).resolve().parent
TILE_PX, ANIMATION_PX = 300, 360
CAMERAS = ("front", "side", "wrist")
MOMENTS = 6
SEED = 3


def sheet(rows: list[list[np.ndarray]]) -> Image.Image:
    """Return pictures of equal size as a grid with thin white lines."""
    height, width, _ = rows[0][0].shape
    page = Image.new("RGB", (len(rows[0]) * (width + 4) - 4, len(rows) * (height + 4) - 4), "white")
    for y, row in enumerate(rows):
        for x, picture in enumerate(row):
            page.paste(Image.fromarray(picture), (x * (width + 4), y * (height + 4)))
    return page


def layouts(twins: Path, work: Path) -> tuple[Image.Image, dict[str, str]]:
    """Draw a layout on a table, a tray and a shelf: colours, depth, normals, ids; return the picture and the scenes' digests."""
    rows, shown = [], {}
    source = TwinSource(twins)
    for surface in ("table", "tray", "shelf"):
        config = LayoutsConfig(seed=SEED, layout=LayoutSettings(objects=(4, 6), surface=surface, clutter="dense"))
        make_layouts(twins, work / surface, 1, config, executor="inline")
        scene = read_scene(work / surface / scene_name(f"layout_{SEED}_000000"))
        frames, _ = scene_pictures(scene, source.folder, width_px=TILE_PX, height_px=TILE_PX)
        front, oblique = frames["front"], frames["oblique"]
        range_m = depth_range_m(oblique.depth_m, oblique.ids)
        assert range_m is not None, "a layout has objects"
        depth = depth_in_colors(oblique.depth_m, range_m)
        normals = (127.5 * (oblique.normals + 1) * (oblique.depth_m > 0)[..., None]).astype(np.uint8)
        rows.append([front.rgb, oblique.rgb, depth, normals, ids_in_colors(oblique.ids)])
        shown[surface] = of_scene(scene)
    return sheet(rows), shown


def pictures(episode: StoredEpisode, twins: Path, size_px: int) -> list[list[np.ndarray]]:
    """Return all frames of an episode from each camera."""
    robot, source = load_robot(episode.robot.name), TwinSource(twins)
    visuals = [twin_drawable(source.folder(thing.twin_id)) for thing in episode.objects]
    lighting = render_lighting(
        tuple(episode.facts["ambient"]), tuple(Light(**each) for each in episode.facts["lights"])
    )
    with EpisodeReplay(
        robot, visuals, furniture=Furniture(**episode.facts["furniture"]), lighting=lighting, seed=1
    ) as replay:
        frames = replay.frames(episode.recording, named_cameras(CAMERAS, robot), width_px=size_px, height_px=size_px)
        return [[frame.rgb for frame in each] for each in frames]


def an_episode(twins: Path, work: Path) -> StoredEpisode:
    """Record a few episodes and return the first."""
    make_episodes(twins, work, 4, TrajectoriesConfig(seed=SEED, others=2, batch=2), executor="inline")
    return next(stored_episodes(batch_folders(work)))


def episode_picture(episode: StoredEpisode, twins: Path) -> Image.Image:
    """Draw moments of an episode, one row per camera."""
    frames = pictures(episode, twins, TILE_PX)
    moments = np.linspace(10, len(frames) - 1, MOMENTS).astype(int)
    return sheet([[frames[m][camera] for m in moments] for camera in range(len(CAMERAS))])


def main() -> None:
    """Make the pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("twins", type=Path, help="what `manitwin build samples/samples.csv` wrote")
    twins = parser.parse_args().twins
    with tempfile.TemporaryDirectory() as folder:
        picture, shown = layouts(twins, Path(folder))
        save_picture(picture, DOCS / "layouts.png", shown)
        episode = an_episode(twins, Path(folder) / "episodes")
    save_picture(episode_picture(episode, twins), DOCS / "episode.png", {"episode": of_episode(episode)})
    small = pictures(episode, twins, ANIMATION_PX)
    write_animation((np.hstack([each[0], each[2]]) for each in small[::2]), DOCS / "episode.webp", quality=55)


if __name__ == "__main__":
    main()
