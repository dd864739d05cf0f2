"""The file that a mesh is read from: its limits, the files beside it that it may name, and what is worth telling."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from manitwin.errors import InputError
from manitwin.formats.source_files import inside_folder, spellings


@dataclass(frozen=True)
class MeshLimits:
    """The limits beyond which a mesh file is refused: bytes (with all files it names), triangles, texture pixels.

    ``decode_textures`` false: of textures only the size is looked at, and their pixels are decoded by whoever wants them.
    """

    max_bytes: int = 1 << 30
    max_faces: int = 4_000_000
    max_texture_pixels: int = 1 << 26
    decode_textures: bool = True


@dataclass
class MeshSource:
    """A mesh file, and the only way for a reader to reach the files that it names.

    Names are looked up below the file's own folder and nowhere else: absolute paths, ``..``, links that lead out and
    remote addresses are never followed. ``findings`` collects plain sentences about what was left out or assumed.
    """

    path: Path
    limits: MeshLimits
    findings: list[str] = field(default_factory=list)
    bytes_read: int = 0

    def data(self) -> bytes:
        """Return the bytes of the file itself; raises InputError ``unreadable`` where it is larger than the limit."""
        size = self.path.stat().st_size
        if size > self.limits.max_bytes:
            raise self.unreadable(
                f"{size} bytes are more than the limit of {self.limits.max_bytes}", "simplify it, or raise the limit"
            )
        self.bytes_read += size
        return self.path.read_bytes()

    def sibling(self, name: str, what: str) -> bytes | None:
        """Return the bytes of a file that the mesh names, or None with a finding; ``what`` says what it is for.

        Raises InputError ``unreadable`` where all files together are larger than the limit.
        """
        for spelling in spellings(name):
            found = inside_folder(self.path.parent, spelling)
            if found is None:
                self.find(f"{what} {_short(name)} lies outside the file's own folder and was not read")
                return None
            if found.is_file():
                return self._read(found)
        self.find(f"{what} {_short(name)} is not there; carried on without it")
        return None

    def find(self, sentence: str) -> None:
        """Note a finding once."""
        if sentence not in self.findings:
            self.findings.append(sentence)

    def unreadable(self, cause: str, remedy: str) -> InputError:
        """Return the error for a file that cannot be read: it names the file, the cause and the remedy in one line."""
        return self.refused("unreadable", cause, remedy)

    def refused(self, reason: str, cause: str, remedy: str) -> InputError:
        """Return the error for a file that is refused for one of the input's reasons."""
        return InputError(reason, f"{self.path.name}: {' '.join(cause.split())}; {remedy}")

    def check_faces(self, faces: int) -> None:
        """Raise InputError ``unreadable`` where there are more triangles than the limit."""
        if faces > self.limits.max_faces:
            raise self.unreadable(
                f"{faces} faces are more than the limit of {self.limits.max_faces}", "simplify it, or raise the limit"
            )

    def _read(self, found: Path) -> bytes:
        self.bytes_read += found.stat().st_size
        if self.bytes_read > self.limits.max_bytes:
            raise self.unreadable(
                f"it and the files that it names have more than {self.limits.max_bytes} bytes",
                "simplify it, or raise the limit",
            )
        return found.read_bytes()


def _short(name: str) -> str:
    return repr(name if len(name) <= 80 else name[:77] + "...")
