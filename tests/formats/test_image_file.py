"""Photos in every state that they come in; the shared bad files one by one, as their manifest asks."""

from __future__ import annotations

import io
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageCms, TiffImagePlugin

from manitwin.errors import InputError
from manitwin.formats.image_file import check_header, read_image


def refusal(path: Path) -> InputError:
    with pytest.raises(InputError) as caught:
        read_image(path)
    assert path.name in caught.value.detail and "\n" not in caught.value.detail
    return caught.value


@pytest.mark.shared_data
@pytest.mark.parametrize(
    ("name", "reason", "words"),
    [
        ("truncated.jpg", "unreadable", ("truncated", "again")),
        ("zero_byte.png", "empty", ("zero bytes",)),
        ("text_renamed.png", "wrong_type", ("plain text",)),
        ("one_pixel.png", "too_small", ("1 x 1", "32")),
        ("animated.gif", "animated", ("3 pictures", "frame")),
        ("animated.webp", "animated", ("3 pictures", "frame")),
        ("millimetres.obj", "wrong_type", ("mesh",)),
    ],
)
def test_bad_file_is_refused_by_name_cause_and_remedy(
    shared_data: Path, name: str, reason: str, words: tuple[str]
) -> None:
    error = refusal(shared_data / "bad" / name)
    assert error.reason == reason
    assert [word for word in words if word not in error.detail] == []


@pytest.mark.parametrize("brands", [b"heic\0\0\0\0mif1heic", b"mif1\0\0\0\0mif1heic"])
@pytest.mark.parametrize("name", ["photo.heic", "photo.jpg"])
def test_heic_is_refused_with_the_remedy(tmp_path: Path, name: str, brands: bytes) -> None:
    (tmp_path / name).write_bytes(b"\0\0\0\x18ftyp" + brands + bytes(100))
    error = refusal(tmp_path / name)
    assert (error.reason, error.detail) == ("wrong_type", f"{name}: HEIC is not read; convert it to PNG or JPEG")
    with pytest.raises(InputError) as caught:  # a build and a dry run look at the header first
        check_header(tmp_path / name)
    assert caught.value.detail == error.detail


def test_avif_is_read_with_any_of_its_brands(tmp_path: Path) -> None:
    path = tmp_path / "photo.avif"
    Image.new("RGB", (48, 40), (200, 30, 30)).save(path)
    plain = read_image(path).pixels
    assert plain.shape == (40, 48, 3) and np.abs(plain.astype(int) - (200, 30, 30)).max() < 10
    content = path.read_bytes()
    assert content[8:12] == b"avif"
    path.write_bytes(content[:8] + b"mif1" + content[12:])
    assert (read_image(path).pixels == plain).all()


@pytest.mark.shared_data
def test_chosen_frame_of_an_animation_is_read_and_said(shared_data: Path) -> None:
    first = read_image(shared_data / "bad" / "animated.gif", frame=0)
    last = read_image(shared_data / "bad" / "animated.gif", frame=2)
    assert "used frame 2 of 3" in last.findings
    assert first.pixels.shape[:2] == (240, 320)
    middle = (slice(90, 150), slice(130, 190))
    apple, orange = first.pixels[middle][..., :3].mean((0, 1)), last.pixels[middle][..., :3].mean((0, 1))
    assert orange[1] - apple[1] > 40  # an orange has far more green than a red apple
    with pytest.raises(InputError, match=r"no frame 3; set frame in the configuration to 0\.\.2"):
        read_image(shared_data / "bad" / "animated.gif", frame=3)


def tiff_of(path: Path, *pictures: tuple[Image.Image, int]) -> Path:
    """A TIFF of several pictures, each with its NewSubfileType."""
    written = io.BytesIO()  # a file of its own the writer closes twice
    with TiffImagePlugin.AppendingTiffWriter(written, True) as stream:
        for picture, kind in pictures:
            tags = TiffImagePlugin.ImageFileDirectory_v2()
            tags[254] = kind
            picture.save(stream, format="TIFF", tiffinfo=tags)
            stream.newFrame()
        path.write_bytes(written.getvalue())
    return path


def test_a_preview_behind_a_tiff_s_picture_is_no_second_picture(tmp_path: Path) -> None:
    blue, preview = Image.new("RGB", (128, 96), (30, 60, 160)), Image.new("RGB", (64, 48), (200, 0, 0))
    read = read_image(tiff_of(tmp_path / "preview.tif", (blue, 0), (preview, 1)))
    assert read.pixels.shape == (96, 128, 3) and (read.pixels == (30, 60, 160)).all()
    assert refusal(tiff_of(tmp_path / "pages.tif", (blue, 0), (blue, 0))).reason == "animated"
    assert refusal(tiff_of(tmp_path / "first.tif", (preview, 1), (blue, 0))).reason == "animated"


@pytest.mark.shared_data
def test_exif_orientation_is_honoured(shared_data: Path) -> None:
    turned = read_image(shared_data / "bad" / "exif_rotated.jpg")
    original = read_image(shared_data / "photos" / "claw_hammer.jpg", max_side_px=1280)
    assert turned.pixels.shape == original.pixels.shape == (960, 1280, 3)
    assert np.abs(turned.pixels.astype(int) - original.pixels).mean() < 3


@pytest.mark.shared_data
def test_cmyk_is_converted_and_not_inverted(shared_data: Path) -> None:
    cmyk = read_image(shared_data / "bad" / "cmyk.jpg").pixels
    original = read_image(shared_data / "photos" / "steel_fork.jpg").pixels
    assert cmyk.shape == original.shape
    assert np.abs(cmyk.astype(int) - original).mean() < 3


@pytest.mark.shared_data
def test_sixteen_bits_are_scaled_not_clipped(shared_data: Path) -> None:
    path = shared_data / "bad" / "gray16.png"
    pixels = read_image(path).pixels
    raw = np.asarray(Image.open(path)).astype(float)
    assert pixels.shape == (*raw.shape, 3)
    assert np.abs(pixels[..., 0] - raw / 257).max() <= 0.51
    assert len(np.unique(pixels)) > 100


def test_sixteen_bit_extremes_map_to_black_and_white(tmp_path: Path) -> None:
    values = np.zeros((40, 40), np.uint16)
    values[:, 20:] = 65535
    values[0, 0] = 32896  # 128 * 257
    Image.fromarray(values).save(tmp_path / "wide.png")
    pixels = read_image(tmp_path / "wide.png").pixels
    assert pixels[0, 0, 0] == 128 and pixels[5, 5, 0] == 0 and pixels[5, 30, 0] == 255


def test_embedded_profile_is_converted_to_srgb(tmp_path: Path) -> None:
    lab = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB"))
    image = Image.new("RGB", (40, 40), (200, 40, 90))
    image.save(tmp_path / "plain.png", icc_profile=lab.tobytes())
    assert tuple(read_image(tmp_path / "plain.png").pixels[5, 5]) == (200, 40, 90)


def test_broken_profile_is_said_and_ignored(tmp_path: Path) -> None:
    Image.new("RGB", (40, 40), (200, 40, 90)).save(tmp_path / "odd.png", icc_profile=b"no profile at all")
    photo = read_image(tmp_path / "odd.png")
    assert tuple(photo.pixels[5, 5]) == (200, 40, 90)
    assert any("profile" in finding for finding in photo.findings)


def test_palette_transparency_becomes_alpha(tmp_path: Path) -> None:
    image = Image.new("P", (40, 40), 0)
    image.putpalette([255, 0, 255, 10, 200, 30])
    image.paste(1, (10, 10, 30, 30))
    image.save(tmp_path / "palette.png", transparency=0)
    pixels = read_image(tmp_path / "palette.png").pixels
    assert tuple(pixels[20, 20]) == (10, 200, 30, 255) and pixels[0, 0, 3] == 0


def test_scaling_down_does_not_mix_in_hidden_colours(tmp_path: Path) -> None:
    pixels = np.zeros((400, 400, 4), np.uint8)
    pixels[...] = (255, 0, 255, 0)
    pixels[101:299, 101:299] = (240, 130, 10, 255)
    Image.fromarray(pixels).save(tmp_path / "cut.png")
    small = read_image(tmp_path / "cut.png", max_side_px=100).pixels
    seen = small[small[..., 3] > 60]
    assert small.shape[:2] == (100, 100) and np.abs(seen[:, :3].astype(int) - [240, 130, 10]).max() <= 4


@pytest.mark.parametrize("side", [31, 32])
def test_side_limit(tmp_path: Path, side: int) -> None:
    Image.new("RGB", (100, side)).save(tmp_path / "thin.png")
    if side < 32:
        error = refusal(tmp_path / "thin.png")
        assert error.reason == "too_small" and f"100 x {side}" in error.detail
    else:
        assert read_image(tmp_path / "thin.png").pixels.shape == (side, 100, 3)


def test_decompression_bomb_is_refused_before_decoding(tmp_path: Path) -> None:
    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0))
    (tmp_path / "bomb.png").write_bytes(
        b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")
    )
    error = refusal(tmp_path / "bomb.png")
    assert error.reason == "too_large" and "megapixels" in error.detail and "scale" in error.detail


def test_broken_exif_is_told_and_the_picture_read(tmp_path: Path) -> None:
    Image.new("RGB", (48, 40), (200, 20, 20)).save(tmp_path / "a.png", exif=b"Exif\0\0MM\0*")
    photo = read_image(tmp_path / "a.png")
    assert photo.pixels.shape == (40, 48, 3)
    assert photo.findings == ("its EXIF is broken (error) and was not read",)


def _pnm(magic: int, values: np.ndarray, most: int) -> bytes:
    """A picture ``(H, W)`` or ``(H, W, 3)`` in one of Netpbm's six formats, with a comment in its header."""
    head = f"P{magic} # of a test\n{values.shape[1]} {values.shape[0]}\n" + ("" if magic in (1, 4) else f"{most}\n")
    if magic < 4:
        body = " ".join(map(str, values.ravel())).encode()
    elif magic == 4:
        body = np.packbits(values.astype(bool), axis=1).tobytes()
    else:
        body = values.astype(">u2" if most > 255 else np.uint8).tobytes()
    return head.encode() + body


@pytest.mark.parametrize("most", [255, 15, 1023, 65535])
@pytest.mark.parametrize("magic", range(1, 7))
def test_pictures_of_netpbm_are_read_as_png_are(tmp_path: Path, magic: int, most: int) -> None:
    share = np.linspace(0, 1, 48 * 40 * 3).reshape(40, 48, 3)
    share = share if magic in (3, 6) else share[..., 0]
    path = tmp_path / "photo.ppm"
    if magic in (1, 4):
        black = share > 0.5
        path.write_bytes(_pnm(magic, black.astype(int), 1))
        wanted = np.where(black, 0, 255)
    else:
        path.write_bytes(_pnm(magic, np.round(share * most).astype(int), most))
        wanted = np.round(255 * np.round(share * most) / most)
    found = read_image(path).pixels.astype(int)
    assert found.shape == (40, 48, 3)
    assert np.abs(found - (wanted if magic in (3, 6) else wanted[..., None])).max() <= 1


@pytest.mark.parametrize(
    ("content", "reason", "words"),
    [
        (b"P6\n64 64\n255\n" + bytes(100), "unreadable", "truncated or corrupt"),
        (b"P3\n64 64\n255\n" + b"7 " * 100, "unreadable", "truncated or corrupt"),
        (b"P2\n64 64\n255\n" + b"1" * 100_000, "unreadable", "truncated or corrupt"),
        (b"P5\n99999 99999\n255\n", "too_large", "megapixels"),
        (b"P3\n4000 4000\n255\n7 7 7", "too_large", "in a text format"),
        (b"P6\n8 8\n255\n" + bytes(192), "too_small", "8 x 8"),
        (b"P6 and other words", "wrong_type", "plain text"),
    ],
)
def test_a_broken_picture_of_netpbm_is_refused(tmp_path: Path, content: bytes, reason: str, words: str) -> None:
    (tmp_path / "photo.ppm").write_bytes(content)
    error = refusal(tmp_path / "photo.ppm")
    assert error.reason == reason and words in error.detail
