"""The file that a mesh is read from: its limits, the files beside it that it may name, and what is worth telling."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from PIL import Image

from manitwin.errors import InputError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.printable import printable_line
from manitwin.formats.source_files import inside_folder, is_regular, spellings

Buffer = bytes | memoryview

PACKAGE_SCHEMES = ("package://", "model://")
_SIMPLIFY = "simplify it, or raise the limit"
_MESSAGE_CHARACTERS = 400
_MAX_FINDINGS = 100
_TEXTURES = 8
MAX_PARTS = 20_000
"""Parts of one file, each with a material and a place of its own: more are no single object."""
# broken files fail in more ways than a reader can name; none of them is a fault of this program
_BROKEN = (
    ValueError,
    KeyError,
    IndexError,
    TypeError,
    AttributeError,
    OverflowError,
    RecursionError,
    OSError,
    struct.error,
)


@dataclass(frozen=True)
class MeshLimits:
    """The limits beyond which a mesh file is refused: bytes (with all files it names), triangles, texture pixels.

    ``decode_textures`` false: of textures only the size is looked at, and their pixels are decoded by whoever wants them.
    ``shading`` false: no normals are made for parts without.
    """

    max_bytes: int = 1 << 30
    max_faces: int = 4_000_000
    max_texture_pixels: int = 1 << 26
    decode_textures: bool = True
    shading: bool = True

    @property
    def max_vertices(self) -> int:
        """The most vertices that so many triangles can use."""
        return 3 * self.max_faces

    @property
    def max_total_texture_pixels(self) -> int:
        """The most pixels of all different textures together: eight of the largest."""
        return _TEXTURES * self.max_texture_pixels


@dataclass
class MeshSource:
    """A mesh file, and the only way for a reader to reach the files that it names.

    Names are looked up from the file's own folder, below it or below ``root`` and nowhere else: absolute paths, links that
    lead out and remote addresses are never followed, and only regular files are opened. What is not there is looked for in
    ``texture_folders`` by its name alone. ``hull_of_points``: vertices without faces are their convex hull.

    ``findings`` collects plain sentences about what was left out or assumed, ``textures`` what was decoded, by its bytes'
    digest.
    """

    path: Path
    limits: MeshLimits
    findings: list[str] = field(default_factory=list)
    bytes_read: int = 0
    textures: dict[str, Image.Image | None] = field(default_factory=dict)
    root: Path | None = None
    texture_folders: tuple[Path, ...] = ()
    hull_of_points: bool = False
    _texture_pixels: int = 0
    _contents: dict[Path, bytes] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The file's name as a message shows it."""
        return printable_line(self.path.name, max_characters=200)

    def data(self) -> bytes:
        """Return the bytes of the file itself; raises InputError, ``too_large`` where it is larger than the limit."""
        unreadable, too_large = partial(InputError, "unreadable"), partial(InputError, "too_large")
        data = read_bytes(self.path, self.limits.max_bytes, unreadable, refuse_size=too_large)
        self.bytes_read += len(data)
        return data

    def sibling(self, name: str, what: str) -> bytes | None:
        """Return the bytes of a file that the mesh names, or None with a finding; ``what`` says what it is for.

        Raises InputError ``too_large`` where all files together are larger than the limit.
        """
        outside = False
        for spelling in spellings(name):
            named = list(self._places(spelling))
            outside = outside or all(place is None for place in named)
            places = [(self.root or self.path.parent, place) for place in named]
            places += [(folder, inside_folder(folder, spelling.rpartition("/")[2])) for folder in self.texture_folders]
            for inside, found in places:
                if found is not None and is_regular(found):
                    return self._read(found, inside)
        if outside:
            own = "the file's own folder" if self.root is None else f"the folder {self.root.resolve().name!r}"
            self.find(f"{what} {_short(name)} lies outside {own} and was not read")
        else:
            self.find(f"{what} {_short(name)} is not there; carried on without it")
        return None

    def _places(self, name: str) -> Iterator[Path | None]:
        """Yield where a file that the mesh names may lie; None for a place that is not below the root.

        What names a package or model (``model://NAME/...``, as materials of Gazebo's do) lies in the folder of that name.
        """
        scheme = next((scheme for scheme in PACKAGE_SCHEMES if name.startswith(scheme)), None)
        if scheme is None or self.root is None:
            yield inside_folder(self.path.parent, name, root=self.root)
            return
        package, _, inside = name.removeprefix(scheme).lstrip("/").partition("/")
        root, folder = self.root.resolve(), self.path.parent.resolve()
        above = [each for each in (folder, *folder.parents) if each.is_relative_to(root)]
        yield from (inside_folder(each, inside, root=root) for each in above if each.name == package)
        yield from (inside_folder(each, f"{package}/{inside}", root=root) for each in above)

    def files(self) -> tuple[Path, ...]:
        """Return the other files that were read, sorted."""
        return tuple(sorted(self._contents))

    def find(self, sentence: str) -> None:
        """Note a finding once."""
        line = printable_line(sentence, max_characters=_MESSAGE_CHARACTERS)
        if line not in self.findings and len(self.findings) < _MAX_FINDINGS:
            self.findings.append(line)

    def unreadable(self, cause: str, remedy: str) -> InputError:
        """Return the error for a file that cannot be read: it names the file, the cause and the remedy in one line."""
        return self.refused("unreadable", cause, remedy)

    def too_large(self, cause: str, remedy: str = _SIMPLIFY) -> InputError:
        """Return the error for a file that passes a limit."""
        return self.refused("too_large", cause, remedy)

    def refused(self, reason: str, cause: str, remedy: str) -> InputError:
        """Return the error for a file that is refused for one of the input's reasons."""
        cause = printable_line(" ".join(cause.split()), max_characters=_MESSAGE_CHARACTERS)
        return InputError(reason, f"{self.name}: {cause}; {remedy}")

    def check_faces(self, faces: int) -> None:
        """Raise InputError ``too_large`` where there are more triangles than the limit."""
        if faces > self.limits.max_faces:
            raise self.too_large(f"{faces} faces exceed the limit of {self.limits.max_faces}")

    def check_vertices(self, vertices: int) -> None:
        """Raise InputError ``too_large`` where there are more vertices than triangles within the limit can use."""
        if vertices > self.limits.max_vertices:
            limit = f"{self.limits.max_vertices}, three for each of {self.limits.max_faces} faces"
            raise self.too_large(f"{vertices} vertices exceed the limit of {limit}")

    def count_texture(self, pixels: int) -> None:
        """Count the pixels of one more texture; raises InputError ``too_large`` where all together are too many."""
        self._texture_pixels += pixels
        limit = self.limits.max_total_texture_pixels
        if self.limits.decode_textures and self._texture_pixels > limit:
            cause = f"its textures have more than {limit} pixels together"
            raise self.too_large(cause, "scale them down, or raise the limit of one texture")

    def check_parts(self, parts: int) -> None:
        """Raise InputError ``too_large`` where there are more parts than ``MAX_PARTS``."""
        if parts > MAX_PARTS:
            raise self.too_large(f"it has more than {MAX_PARTS} parts", "merge them before exporting")

    @contextmanager
    def reading(self, format: str) -> Iterator[None]:
        """Turn whatever a broken or too large file makes a reader fail with into an InputError."""
        try:
            yield
        except MemoryError as error:
            raise self.too_large("it needs more memory than is available") from error
        except _BROKEN as error:
            said = f"{type(error).__name__}: {str(error)[:80]}"
            if isinstance(error, KeyError) and error.args:  # an attribute or an entry that the format wants
                said = f"{str(error.args[0])[:60]!r} is not there"
            cause = f"its {format} is broken ({said})"
            raise self.unreadable(cause, "export it again") from error

    def _read(self, found: Path, inside: Path) -> bytes:
        # each file once: many materials may name one texture
        if found not in self._contents:
            together = f"it and the files that it references have more than {self.limits.max_bytes} bytes"
            left, refuse = self.limits.max_bytes - self.bytes_read, partial(InputError, "unreadable")
            self._contents[found] = read_bytes(
                found, left, refuse, inside=inside, refuse_size=lambda _: self.too_large(together)
            )
            self.bytes_read += len(self._contents[found])
        return self._contents[found]


def _short(name: str) -> str:
    return repr(name if len(name) <= 80 else name[:77] + "...")
