"""The installed package's version, and shared libraries that installed wheels lack with the Debian packages that have them.

The loader itself is asked (``ldd``) for every shared object and program below a folder, so that no list is kept by hand. The
set-up script imports this before anything is installed: it wants nothing but Python.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec, module_from_spec
from pathlib import Path
from types import ModuleType
from typing import Any

ELF = b"\x7fELF"
NO_METADATA = "0+unknown"
AT_A_TIME = 100  # files a call of ldd: a command line has its limits
GLIB = re.compile(r"lib(glib|gobject|gio|gmodule|gthread)-2\.0\.so\.0")
"""GLib's libraries, which Debian has in one package of a name that is none of theirs."""


def installed_version() -> str:
    """Return manitwin's version; of a source tree that was never installed, ``0+unknown``."""
    from importlib.metadata import PackageNotFoundError, version  # 20 ms that `import manitwin` does without

    try:
        return version("manitwin")
    except PackageNotFoundError:
        return NO_METADATA


def missing_libraries(folder: Path) -> list[str]:
    """Return the names of the shared libraries that objects below ``folder`` want and the loader does not find, sorted.

    What another file below ``folder`` provides is not missing: wheels load each other's libraries by themselves, also under
    a longer name (``libx.so.2`` as ``libx.so.2.0.1``).
    """
    objects = list(elf_files(folder))
    bundled = {part for path in objects for part in _names_answered(path.name)}
    wanted: set[str] = set()
    for start in range(0, len(objects), AT_A_TIME):
        said = subprocess.run(["ldd", *map(str, objects[start : start + AT_A_TIME])], capture_output=True, text=True)
        wanted |= set(re.findall(r"^\s*(\S+) => not found$", said.stdout, re.MULTILINE))
    return sorted(wanted - bundled)


def names_shared_library(error: ImportError) -> bool:
    """Tell whether an import failed for want of a shared library, in the loader's words (dlerror(3) of glibc)."""
    return "cannot open shared object file" in str(error)


def import_remedy(error: ImportError, otherwise: str) -> str:
    """Return the remedy of a failed import: the doctor where a shared library is missing, else what the caller knows."""
    return "manitwin doctor names the system packages that contain it" if names_shared_library(error) else otherwise


@dataclass(frozen=True)
class _LeftOut:
    """Finds that a library is not installed."""

    name: str

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        """Raise ModuleNotFoundError for the library; of others nothing is known here."""
        if name == self.name:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


@contextmanager
def left_out(name: str) -> Iterator[None]:
    """Make imports of a library fail in the ``with`` statement as if it were not installed; one that is loaded already stays.

    For an optional dependency of another library that costs memory and is not used. A None in ``sys.modules`` would do for
    Python's own imports, but modules in Cython (pyarrow) take it for the library.
    """
    finder = _LeftOut(name)
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)


class _PutOff(ModuleType):
    """A module that is executed when something of it is asked for."""

    def __getattr__(self, name: str) -> Any:
        spec = self.__spec__
        assert spec is not None and spec.loader is not None
        self.__class__ = ModuleType  # type: ignore[assignment]
        try:
            spec.loader.exec_module(self)
        except BaseException:
            sys.modules.pop(spec.name, None)
            raise
        return getattr(self, name)


def put_off(name: str, *classes: str) -> None:
    """Have a library loaded once something of it is used, not as another one imports it; what is loaded or missing stays so.

    ``classes`` are those that the other one imports for its annotations: they stand for nothing until the library is loaded.
    For a program that owns its process, while it has one thread, and where nobody imports what is below the library before it.
    ``importlib.util.LazyLoader`` would load at the import statement, which asks for the module's ``__spec__``.
    """
    spec = None if name in sys.modules else find_spec(name)
    if spec is None or spec.loader is None:
        return
    module = module_from_spec(spec)
    module.__class__ = _PutOff
    for each in classes:
        setattr(module, each, type(each, (), {}))
    sys.modules[name] = module


def elf_files(folder: Path) -> Iterator[Path]:
    """Yield the shared objects and programs in the ELF format below a folder, sorted within each folder."""
    for place, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            path = Path(place, name)
            if path.is_symlink() or not (".so" in name or os.access(path, os.X_OK)):
                continue
            with path.open("rb") as stream:
                if stream.read(4) == ELF:
                    yield path


def _names_answered(name: str) -> list[str]:
    """Return the library names that a file can stand for: ``libx.so.2.0.1`` also for ``libx.so.2`` and ``libx.so``."""
    base, dot_so, version = name.partition(".so")
    parts = version.split(".")
    return [base + dot_so + ".".join(parts[:count]) for count in range(1, len(parts) + 1)]


def package_by_policy(library: str) -> str:
    """Return the name that a Debian package of a library has by Debian Policy 8.1: libgomp.so.1 is in libgomp1; GLib's too."""
    if GLIB.fullmatch(library):
        return "libglib2.0-0"
    base, _, version = library.partition(".so")
    version = version.lstrip(".")
    hyphen = "-" if version and base[-1:].isdigit() else ""
    return f"{base}{hyphen}{version}".lower().replace("_", "-")


def package_by_contents(library: str, apt_file_list: Iterable[str]) -> str | None:
    """Return the package that holds a library, of the lines that ``apt-file search`` printed; None: none does.

    Of several the one with the shortest name: the others are debugging, cross-building or alternative ones.
    """
    found = set()
    for line in apt_file_list:
        package, _, path = line.partition(": ")
        if Path(path.strip()).name == library and Path(path).parts[:2] in (("/", "usr"), ("/", "lib")):
            found.add(package.strip())
    return min(found, key=lambda name: (len(name), name)) if found else None
