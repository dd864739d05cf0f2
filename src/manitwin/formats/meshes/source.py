"""Access of mesh readers to their file: limits, side files, and findings."""

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
"""Limit of parts in one file, each with its own material and position; a single object has fewer."""
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
    """The limits beyond which a mesh file is refused: bytes (including all named files), triangles, texture pixels.

    ``decode_textures`` false: only the sizes of textures are read, and pixels are decoded on demand. ``shading`` false: no
    normals are computed for parts without normals.
    """

    max_bytes: int = 1 << 30
    max_faces: int = 4_000_000
    max_texture_pixels: int = 1 << 26
    decode_textures: bool = True
    shading: bool = True

    @property
    def max_vertices(self) -> int:
        """The largest number of vertices that this many triangles can use."""
        return 3 * self.max_faces

    @property
    def max_total_texture_pixels(self) -> int:
        """The largest total number of pixels of all different textures: eight of the largest."""
        return _TEXTURES * self.max_texture_pixels


@dataclass
class MeshSource:
    """A mesh file, and the only way for a reader to access the files that it names.

    Names are resolved from the file's own folder, inside this folder or ``root``: absolute paths, links that leave it and
    remote addresses are never followed, and only regular files are opened. Missing files are looked up in ``texture_folders``
    by file name. ``hull_of_points``: vertices without faces represent their convex hull.

    ``findings`` collects sentences about what was left out or assumed, ``textures`` the decoded images by digest of their
    bytes.
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
        """The file's name, escaped for messages."""
        return printable_line(self.path.name, max_characters=200)

    def data(self) -> bytes:
        """Return the bytes of the file itself; raises InputError, ``too_large`` beyond the limit."""
        unreadable, too_large = partial(InputError, "unreadable"), partial(InputError, "too_large")
        data = read_bytes(self.path, self.limits.max_bytes, unreadable, refuse_size=too_large)
        self.bytes_read += len(data)
        return data

    def sibling(self, name: str, what: str) -> bytes | None:
        """Return the bytes of a file that the mesh names, or None with a finding; ``what`` describes the file.

        Raises InputError ``too_large`` if all files together exceed the limit.
        """
        outside = False
        for spelling in spellings(name):
            named = list(self._candidates(spelling))
            outside = outside or all(place is None for place in named)
            places = [(self.root or self.path.parent, place) for place in named]
            places += [(folder, inside_folder(folder, spelling.rpartition("/")[2])) for folder in self.texture_folders]
            for inside, found in places:
                if found is not None and is_regular(found):
                    return self._read(found, inside)
        if outside:
            own = "the file's own folder" if self.root is None else f"the folder {self.root.resolve().name!r}"
            self.add_finding(f"{what} {_short(name)} lies outside {own} and was not read")
        else:
            self.add_finding(f"{what} {_short(name)} is not there; carried on without it")
        return None

    def _candidates(self, name: str) -> Iterator[Path | None]:
        """Yield candidate paths of a file that the mesh names; None for a path outside the root.

        A name of a package or model (``model://NAME/...``, as in Gazebo's materials) is resolved in the folder of that name.
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

    def add_finding(self, sentence: str) -> None:
        """Add a finding, unless it was added before."""
        line = printable_line(sentence, max_characters=_MESSAGE_CHARACTERS)
        if line not in self.findings and len(self.findings) < _MAX_FINDINGS:
            self.findings.append(line)

    def unreadable(self, cause: str, remedy: str) -> InputError:
        """Return the error for an unreadable file: one line with file, cause and remedy."""
        return self.refused("unreadable", cause, remedy)

    def too_large(self, cause: str, remedy: str = _SIMPLIFY) -> InputError:
        """Return the error for a file beyond a limit."""
        return self.refused("too_large", cause, remedy)

    def refused(self, reason: str, cause: str, remedy: str) -> InputError:
        """Return the error for a file that is refused for one of the reasons of InputError."""
        cause = printable_line(" ".join(cause.split()), max_characters=_MESSAGE_CHARACTERS)
        return InputError(reason, f"{self.name}: {cause}; {remedy}")

    def check_faces(self, faces: int) -> None:
        """Raise InputError ``too_large`` for more triangles than the limit."""
        if faces > self.limits.max_faces:
            raise self.too_large(f"{faces} faces exceed the limit of {self.limits.max_faces}")

    def check_vertices(self, vertices: int) -> None:
        """Raise InputError ``too_large`` for more vertices than the allowed triangles can use."""
        if vertices > self.limits.max_vertices:
            limit = f"{self.limits.max_vertices}, three for each of {self.limits.max_faces} faces"
            raise self.too_large(f"{vertices} vertices exceed the limit of {limit}")

    def count_texture(self, pixels: int) -> None:
        """Count the pixels of one more texture; raises InputError ``too_large`` beyond the total limit."""
        self._texture_pixels += pixels
        limit = self.limits.max_total_texture_pixels
        if self.limits.decode_textures and self._texture_pixels > limit:
            cause = f"its textures have more than {limit} pixels together"
            raise self.too_large(cause, "scale them down, or raise the limit of one texture")

    def check_parts(self, parts: int) -> None:
        """Raise InputError ``too_large`` for more parts than ``MAX_PARTS``."""
        if parts > MAX_PARTS:
            raise self.too_large(f"it has more than {MAX_PARTS} parts", "merge them before exporting")

    @contextmanager
    def convert_errors(self, format: str) -> Iterator[None]:
        """Convert any failure of a reader on a broken or too large file to InputError."""
        try:
            yield
        except MemoryError as error:
            raise self.too_large("it needs more memory than is available") from error
        except _BROKEN as error:
            said = f"{type(error).__name__}: {str(error)[:80]}"
            if isinstance(error, KeyError) and error.args:  # a missing attribute or entry that the format requires
                said = f"{str(error.args[0])[:60]!r} is not there"
            cause = f"its {format} is broken ({said})"
            raise self.unreadable(cause, "export it again") from error

    def _read(self, found: Path, inside: Path) -> bytes:
        # each file is read once, as many materials may name one texture
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
