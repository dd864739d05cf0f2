"""A network is one of the opinions: a tiny one, made by the test, that calls red things objects."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from kept_opinions import kept_opinions
from manitwin.errors import Rejected, UsageError
from manitwin.formats.isolated import Limits, run_isolated
from manitwin.models.matting import learned, matte_photo, study
from manitwin.models.matting.learned import find_network, find_networks, learned_alpha, require_working
from manitwin.models.matting.study import study_photo
from manitwin.models.weights.store import FOLDER
from tiny_networks import tiny_network

SIZE = (240, 320)


@pytest.fixture(autouse=True)
def forget() -> None:
    find_network.cache_clear()


@pytest.fixture(scope="module", autouse=True)
def rules_and_the_built_in_network_asked_once() -> Iterator[None]:
    """Keep what they say of a picture: the same few are studied with one network and another."""
    with kept_opinions():
        yield


def _network(tmp_path: Path, **more: object) -> str:
    tmp_path.mkdir(exist_ok=True)
    path = tmp_path / "tiny-isnet.onnx"
    path.write_bytes(tiny_network(**more))  # type: ignore[arg-type]
    return str(path)


def _photo(color: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    truth = np.zeros(SIZE, np.uint8)
    cv2.ellipse(truth, (160, 120), (70, 45), 20, 0, 360, 1, -1)
    scene = np.full((*SIZE, 3), (205.0, 200.0, 190.0)) + np.random.default_rng(0).normal(0, 1.5, (*SIZE, 3))
    scene[truth > 0] = color
    return np.clip(cv2.GaussianBlur(scene, (0, 0), 0.8), 0, 255).astype(np.uint8), truth > 0


@pytest.mark.parametrize("logistic", [True, False])
def test_the_share_of_object_of_each_pixel_is_read(tmp_path: Path, logistic: bool) -> None:
    network = find_network(_network(tmp_path, logistic=logistic, weights=(12.0, -6.0, -6.0)))
    photo, truth = _photo((220, 30, 30))
    alpha = learned_alpha(network, photo)
    assert alpha.shape == SIZE and alpha.min() >= 0 and alpha.max() <= 1
    found = alpha > 0.8
    assert (found & truth).sum() / (found | truth).sum() > 0.9


def test_a_network_that_agrees_is_one_of_the_opinions(tmp_path: Path) -> None:
    photo, truth = _photo((220, 30, 30))
    matte = matte_photo(photo, "x.png", networks=find_networks(_network(tmp_path, weights=(40.0, -30.0, -30.0))))
    assert matte.agreement["network"] > 0.9 and matte.confidence > 0.88
    found = matte.rgba[..., 3] > 127
    assert (found & truth).sum() / (found | truth).sum() > 0.97


def test_a_network_that_nothing_bears_out_is_outvoted(tmp_path: Path) -> None:
    """It calls the whole picture an object but for the object: rules and the built-in network agree on another."""
    photo, truth = _photo((30, 30, 220))
    network = find_network(_network(tmp_path, weights=(20.0, 20.0, 0.0)))
    outvoted = study_photo(photo, networks=[network])
    assert outvoted.agreement["network"] < 0.2 and outvoted.agreement["built_in_network"] > 0.95
    assert outvoted.judged[0].confidence == pytest.approx(study_photo(photo).judged[0].confidence, abs=0.02)
    found = matte_photo(photo, "x.png", networks=[network]).rgba[..., 3] > 127
    assert (found & truth).sum() / (found | truth).sum() > 0.97


def test_what_two_networks_see_alike_is_likelier(tmp_path: Path) -> None:
    """A third, the built-in one, does not count: it is asked anyway."""
    photo, truth = _photo((220, 30, 30))
    alike, other = (
        _network(tmp_path / name, weights=(share, -30.0, -30.0)) for name, share in (("a", 40.0), ("b", 41.0))
    )
    blind = _network(tmp_path / "c", weights=(-30.0, 40.0, 40.0))
    one, two, differing = (
        study_photo(photo, networks=find_networks(names)).judged
        for names in (alike, f"{alike}, {other}", f"{alike},{blind}")
    )
    assert not any(each.is_agreed for each in (*one, *differing))
    agreed = [each for each in two if each.is_agreed]
    assert {each.candidate.maker for each in agreed} >= {"network", "second_network"}
    assert all(each.photo_confidence < each.confidence < 1 for each in agreed)
    asked = study_photo(photo, networks=find_networks(f"{alike},{other}"))
    assert set(asked.agreement) == {"rules", "colours", "network", "second_network", "built_in_network"}
    found = asked.alpha > 127
    assert (found & truth).sum() / (found | truth).sum() > 0.97


def test_two_networks_are_asked_only_about_what_is_doubted_without_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    photo, _ = _photo((220, 30, 30))
    networks = find_networks(
        ",".join(_network(tmp_path / name, weights=(share, 0.0, 0.0)) for name, share in (("a", 1.0), ("b", 2.0)))
    )
    asked: list[int] = []

    def study_of(rgb: np.ndarray, **more: Any) -> Any:
        asked.append(len(more.get("networks", ())))
        return study_photo(rgb, **more)

    monkeypatch.setattr(study, "study_photo", study_of)
    matte_photo(photo, "x.png", networks=networks)
    assert asked == [0]
    with pytest.raises(Rejected):
        matte_photo(photo, "x.png", networks=networks, min_confidence=1.0)
    assert asked == [0, 0, 2]


@pytest.mark.slow
def test_that_two_networks_agree_does_not_tell_one_whole_thing(tmp_path: Path) -> None:
    one, _ = _photo((220, 30, 30))
    several = one.copy()
    several[20:60, 20:80] = (220, 30, 30)
    cut = np.ascontiguousarray(one[:, 150:])
    networks = find_networks(
        ",".join(_network(tmp_path / name, weights=(share, -30.0, -30.0)) for name, share in (("a", 40.0), ("b", 41.0)))
    )
    for photo, counts in ((one, True), (several, False), (cut, False)):
        assert any(each.is_agreed for each in study_photo(photo, networks=networks).judged) is counts


def test_at_most_two_different_networks_are_asked(tmp_path: Path) -> None:
    first, second, third = (
        _network(tmp_path / name, weights=(share, 0.0, 0.0)) for name, share in (("a", 1.0), ("b", 2.0), ("c", 3.0))
    )
    assert [network.file for network in find_networks(f"{first}, {second}")] == [Path(first), Path(second)]
    assert find_networks("none") == ()
    for names in (f"{first},{first}", f"{first},{second},{third}"):
        with pytest.raises(UsageError, match="at most 2 different ones"):
            find_networks(names)
    with pytest.raises(UsageError, match="'none' cannot be combined"):
        find_networks(f"none,{first}")


def test_networks_are_run_once_before_a_build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[str] = []

    def run(function: str, *arguments: Any, limits: Limits) -> Any:
        ran.append(function)
        return run_isolated(function, *arguments, limits=limits)

    monkeypatch.setattr(learned, "run_isolated", run)
    require_working(find_network(_network(tmp_path)))
    assert ran == ["manitwin.models.matting.learned:learned_alpha"]


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (b"\x00" * 100, "no ONNX network"),
        (tiny_network(side_px=16), "64 to 2048"),
        (tiny_network(outside=True), "another file"),
    ],
)
def test_a_file_that_cannot_be_run_is_refused_in_one_line(tmp_path: Path, content: bytes, cause: str) -> None:
    path = tmp_path / "net.onnx"
    path.write_bytes(content)
    with pytest.raises(UsageError, match=cause) as caught:
        require_working(find_network(str(path)))
    assert "\n" not in str(caught.value)


def test_a_network_that_opencv_cannot_run_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "net.onnx"
    path.write_bytes(tiny_network().replace(b"Conv", b"Konv"))
    with pytest.raises(UsageError, match="cannot be run here") as caught:
        require_working(find_network(str(path)))
    assert "\n" not in str(caught.value)


def test_names_without_weights_say_how_to_get_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER, str(tmp_path))
    with pytest.raises(UsageError, match="manitwin models add isnet"):
        find_network("isnet")
    with pytest.raises(UsageError, match="did you mean 'isnet'"):
        find_network("isnett")
