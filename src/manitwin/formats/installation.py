"""Version of the installed package, and system libraries that its wheels lack, with the Debian packages that provide them.

The loader itself (``ldd``) is queried for every shared object and program below a folder, so that no list is maintained by
hand. The set-up script imports this module before anything is installed, so it only uses the standard library.
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
AT_A_TIME = 100  # files for each call of ldd: command lines are limited
GLIB = re.compile(r"lib(glib|gobject|gio|gmodule|gthread)-2\.0\.so\.0")
"""GLib's libraries, which Debian ships in one package with an unrelated name."""


def installed_version() -> str:
    """Return manitwin's version; ``0+unknown`` for a source tree that was never installed."""
    from importlib.metadata import PackageNotFoundError, version  # takes 20 ms, which `import manitwin` avoids

    try:
        return version("manitwin")
    except PackageNotFoundError:
        return NO_METADATA


def missing_libraries(folder: Path) -> list[str]:
    """Return the sorted names of shared libraries that objects below ``folder`` need and the loader does not find.

    Libraries that another file below ``folder`` provides are not missing: wheels load each other's libraries themselves, also
    under a longer name (``libx.so.2`` as ``libx.so.2.0.1``).
    """
    objects = list(elf_files(folder))
    bundled = {part for path in objects for part in _provided_names(path.name)}
    wanted: set[str] = set()
    for start in range(0, len(objects), AT_A_TIME):
        said = subprocess.run(["ldd", *map(str, objects[start : start + AT_A_TIME])], capture_output=True, text=True)
        wanted |= set(re.findall(r"^\s*(\S+) => not found$", said.stdout, re.MULTILINE))
    return sorted(wanted - bundled)


def names_shared_library(error: ImportError) -> bool:
    """Return whether an import failed because of a missing shared library, by the loader's message (dlerror(3) of glibc)."""
    return "cannot open shared object file" in str(error)


def import_remedy(error: ImportError, otherwise: str) -> str:
    """Return the remedy of a failed import: the doctor for a missing shared library, else that of the caller."""
    return "manitwin doctor names the system packages that contain it" if names_shared_library(error) else otherwise


@dataclass(frozen=True)
class _BlockedImport:
    """Import finder that reports a library as not installed."""

    name: str

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        """Raise ModuleNotFoundError for the library; other names are left to other finders."""
        if name == self.name:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


@contextmanager
def block_import(name: str) -> Iterator[None]:
    """Make imports of a library fail in the ``with`` statement as if it were not installed; a loaded one stays available.

    Meant for an optional dependency of another library that costs memory and is not used. A None in ``sys.modules`` would
    suffice for Python's own imports, but Cython modules (pyarrow) take it for the library.
    """
    finder = _BlockedImport(name)
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)


class _LazyModule(ModuleType):
    """A module that is executed on the first access to an attribute."""

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


def defer_import(name: str, *classes: str) -> None:
    """Defer loading of a library until something of it is used, instead of when another one imports it.

    A library that is loaded or missing stays so. ``classes`` are those that the other library imports for its annotations; they
    are placeholders until the library is loaded. Meant for a program that owns its process, while it has one thread, and if
    nothing imports submodules of the library before it. ``importlib.util.LazyLoader`` would load at the import statement, which
    reads the module's ``__spec__``.
    """
    spec = None if name in sys.modules else find_spec(name)
    if spec is None or spec.loader is None:
        return
    module = module_from_spec(spec)
    module.__class__ = _LazyModule
    for each in classes:
        setattr(module, each, type(each, (), {}))
    sys.modules[name] = module


def elf_files(folder: Path) -> Iterator[Path]:
    """Yield the shared objects and programs in ELF format below a folder, sorted within each folder."""
    for place, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            path = Path(place, name)
            if path.is_symlink() or not (".so" in name or os.access(path, os.X_OK)):
                continue
            with path.open("rb") as stream:
                if stream.read(4) == ELF:
                    yield path


def _provided_names(name: str) -> list[str]:
    """Return the library names that a file can provide: ``libx.so.2.0.1`` also ``libx.so.2`` and ``libx.so``."""
    base, dot_so, version = name.partition(".so")
    parts = version.split(".")
    return [base + dot_so + ".".join(parts[:count]) for count in range(1, len(parts) + 1)]


def package_by_policy(library: str) -> str:
    """Return the name of a library's package by Debian Policy 8.1: libgomp.so.1 is in libgomp1; also handles GLib."""
    if GLIB.fullmatch(library):
        return "libglib2.0-0"
    base, _, version = library.partition(".so")
    version = version.lstrip(".")
    hyphen = "-" if version and base[-1:].isdigit() else ""
    return f"{base}{hyphen}{version}".lower().replace("_", "-")


def package_by_contents(library: str, apt_file_list: Iterable[str]) -> str | None:
    """Return the package that contains a library, from the output lines of ``apt-file search``; None if there is none.

    Of several, it is the one with the shortest name; the others are for debugging, cross-building or alternatives.
    """
    found = set()
    for line in apt_file_list:
        package, _, path = line.partition(": ")
        if Path(path.strip()).name == library and Path(path).parts[:2] in (("/", "usr"), ("/", "lib")):
            found.add(package.strip())
    return min(found, key=lambda name: (len(name), name)) if found else None
