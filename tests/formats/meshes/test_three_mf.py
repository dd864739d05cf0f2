"""3MF archives: units, places, colours and textures, what slicers note, and broken or hostile ones in one line."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.errors import InputError
from manitwin.formats.meshes.read import MeshFile, read_mesh
from manitwin.formats.meshes.source import MeshLimits
from manitwin.formats.meshes.textures import material_of, uv_of
from manitwin.formats.sniff import sniff
from three_mf_archive import archive, mesh_object, model

BOX = trimesh.creation.box((10, 20, 30))


def _read(folder: Path, content: bytes, limits: MeshLimits | None = None) -> MeshFile:
    place = folder / "thing.3mf"
    place.write_bytes(content)
    return read_mesh(place, limits=limits)


def _colors(read: MeshFile) -> list[tuple[int, int, int]]:
    """Return the linear colours of the parts, as bytes."""
    return [tuple(material_of(part).baseColorFactor[:3].tolist()) for part in read.parts]


def test_what_trimesh_writes_is_read(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=30)
    read = _read(tmp_path, ball.export(file_type="3mf"))
    (part,) = read.parts
    assert (read.format, read.unit_m, read.up, read.findings) == ("3mf", 0.001, None, [])
    assert part.volume == pytest.approx(ball.volume) and part.is_watertight


def test_it_is_told_by_what_it_holds_and_not_by_its_name(tmp_path: Path) -> None:
    place = tmp_path / "thing.zip"
    place.write_bytes(archive(model(mesh_object(1, BOX))))
    assert sniff(place).format == "3mf"
    place.write_bytes(archive("<a/>").replace(b"3dmodel.model", b"document.text"))
    with pytest.raises(InputError, match="an archive; unpack it"):
        sniff(place)


@pytest.mark.parametrize(("unit", "metres"), [("micron", 1e-6), ("inch", 0.0254), ("foot", 0.3048), ("meter", 1.0)])
def test_the_unit_is_the_models(tmp_path: Path, unit: str, metres: float) -> None:
    assert _read(tmp_path, archive(model(mesh_object(1, BOX), attributes=f'unit="{unit}"'))).unit_m == metres
    assert _read(tmp_path, archive(model(mesh_object(1, BOX), attributes=""))).unit_m == 0.001


def test_objects_of_objects_are_placed_and_those_that_help_to_print_are_not(tmp_path: Path) -> None:
    resources = (
        mesh_object(1, BOX)
        + mesh_object(2, BOX, attributes='type="support"')
        + '<object id="3"><components><component objectid="1" transform="0 1 0 -1 0 0 0 0 1 100 0 0"/>'
        '<component objectid="2"/></components></object>'
    )
    read = _read(tmp_path, archive(model(resources, '<item objectid="3" transform="2 0 0 0 2 0 0 0 2 0 0 7"/>')))
    (part,) = read.parts
    assert np.allclose(part.bounds, [[180, -10, -23], [220, 10, 37]]), "a quarter turn about Z, moved, then scaled"
    assert read.findings == ["objects of type 'support' in it help to print it, and were left out"]


def test_an_object_in_a_part_of_its_own_is_found(tmp_path: Path) -> None:
    root = model(
        '<object id="1"><components><component p:path="/3D/Objects/a.model" objectid="5"/></components></object>'
    )
    held = model(mesh_object(5, BOX), items="")
    (part,) = _read(tmp_path, archive(root, {"3D/Objects/a.model": held})).parts
    assert part.volume == pytest.approx(6000)
    with pytest.raises(InputError, match=r"its part '/3D/Objects/a\.model' is not in the archive"):
        _read(tmp_path, archive(root))


def test_base_materials_are_parts_of_their_name_and_colour(tmp_path: Path) -> None:
    materials = (
        '<basematerials id="9"><base name="red PLA" displaycolor="#FF0000"/><base name="clear" displaycolor="#0000FF80"/>'
        "</basematerials>"
    )
    properties = ["" if face < 8 else 'p1="1"' for face in range(12)]
    read = _read(
        tmp_path,
        archive(model(materials + mesh_object(1, BOX, attributes='pid="9" pindex="0"', properties=properties))),
    )
    by_name = {material_of(part).name: part for part in read.parts}
    assert {name: len(part.faces) for name, part in by_name.items()} == {"red PLA": 8, "clear": 4}
    assert material_of(by_name["red PLA"]).baseColorFactor.tolist() == [255, 0, 0, 255]
    assert material_of(by_name["clear"]).baseColorFactor.tolist() == [0, 0, 255, 128]
    assert material_of(by_name["clear"]).alphaMode == "BLEND"


def test_colours_of_corners_are_painted(tmp_path: Path) -> None:
    group = '<m:colorgroup id="9"><m:color color="#FF0000"/><m:color color="#00FF00"/></m:colorgroup>'
    properties = ['pid="9" p1="0" p2="1" p3="1"'] * 12
    (part,) = _read(tmp_path, archive(model(group + mesh_object(1, BOX, properties=properties)))).parts
    shown = np.asarray(material_of(part).baseColorTexture).reshape(-1, 3)
    assert shown.max(axis=0).tolist() == [255, 255, 0]


def test_textures_lie_where_they_are_said_to(tmp_path: Path) -> None:
    stream = io.BytesIO()
    Image.fromarray(np.array([[[255, 0, 0]], [[0, 0, 255]]], np.uint8)).save(stream, "PNG")
    resources = (
        '<m:texture2d id="7" path="/3D/Texture/a.png" contenttype="image/png"/><m:texture2dgroup id="9" texid="7">'
        '<m:tex2coord u="0" v="0"/><m:tex2coord u="1" v="0.25"/><m:tex2coord u="1" v="1"/></m:texture2dgroup>'
        + mesh_object(1, BOX, properties=['pid="9" p1="0" p2="1" p3="2"'] * 12)
    )
    read = _read(tmp_path, archive(model(resources), {"3D/Texture/a.png": stream.getvalue()}))
    (part,) = read.parts
    uv = uv_of(part)
    assert uv is not None and np.allclose(uv[part.faces], [[0, 0], [1, 0.25], [1, 1]])
    assert np.asarray(material_of(part).baseColorTexture)[1, 0].tolist() == [0, 0, 255]
    read = _read(tmp_path, archive(model(resources)))
    assert read.findings == ["texture '/3D/Texture/a.png' is not in the archive; carried on without it"]


def test_layers_of_properties_show_the_top_one(tmp_path: Path) -> None:
    resources = (
        '<m:colorgroup id="7"><m:color color="#FF0000"/></m:colorgroup>'
        '<m:colorgroup id="8"><m:color color="#00FF00"/><m:color color="#0000FF"/></m:colorgroup>'
        '<m:multiproperties id="9" pids="7 8"><m:multi pindices="0 0"/><m:multi pindices="0 1"/></m:multiproperties>'
        + mesh_object(1, BOX, properties=['pid="9" p1="1"'] * 12)
    )
    assert _colors(_read(tmp_path, archive(model(resources)))) == [(0, 0, 255)]


def test_mixtures_of_materials_have_the_mean_of_their_colours(tmp_path: Path) -> None:
    resources = (
        '<basematerials id="7"><base name="a" displaycolor="#FF0000"/><base name="b" displaycolor="#0000FF"/></basematerials>'
        '<m:compositematerials id="9" matid="7" matindices="0 1"><m:composite values="1 0"/><m:composite values="2 2"/>'
        "</m:compositematerials>" + mesh_object(1, BOX, properties=['pid="9" p1="1"'] * 12)
    )
    assert _colors(_read(tmp_path, archive(model(resources)))) == [(55, 0, 55)]


def test_colours_and_places_that_are_not_there_are_told_and_grey(tmp_path: Path) -> None:
    resources = (
        '<m:colorgroup id="7"><m:color color="#FF0000"/></m:colorgroup><m:texture2dgroup id="8" texid="6">'
        '<m:tex2coord u="0" v="0"/></m:texture2dgroup>'
        + mesh_object(1, BOX, properties=['pid="7" p1="0"'] * 4 + ['pid="7" p1="4"'] * 4 + ['pid="8" p1="1"'] * 4)
    )
    read = _read(tmp_path, archive(model(resources)))
    by_color = {color: len(part.faces) for color, part in zip(_colors(read), read.parts, strict=True)}
    assert by_color == {(255, 0, 0): 4, (204, 204, 204): 8}
    assert sorted(read.findings) == [
        "colours that triangles in it name are not there; what has them is grey",
        "texture coordinates that triangles in it name are not there; what has them is grey",
    ]


PRUSA = (
    '<config><object id="1" instances_count="1"><metadata type="object" key="extruder" value="1"/>'
    '<volume firstid="0" lastid="11"><metadata type="volume" key="volume_type" value="ModelPart"/></volume>'
    '<volume firstid="12" lastid="23"><metadata type="volume" key="extruder" value="2"/></volume>'
    '<volume firstid="24" lastid="35"><metadata type="volume" key="volume_type" value="{kind}"/></volume></object></config>'
)


@pytest.mark.parametrize(
    ("kind", "finding"),
    [
        ("ParameterModifier", "pieces in it that only tell a slicer how to print were left out"),
        (
            "NegativeVolume",
            "pieces in it that a slicer cuts out of the thing were left out, and so were the holes that they make",
        ),
    ],
)
def test_pieces_that_prusaslicer_does_not_print_are_left_out(tmp_path: Path, kind: str, finding: str) -> None:
    apart = [BOX.copy().apply_translation((20 * k, 0, 0)) for k in range(3)]
    whole = trimesh.util.concatenate(apart)
    beside: dict[str, str | bytes] = {
        "Metadata/Slic3r_PE_model.config": PRUSA.format(kind=kind),
        "Metadata/Slic3r_PE.config": "; layer_height = 0.2\n; extruder_colour = #FF0000;#0000FF\n",
    }
    read = _read(tmp_path, archive(model(mesh_object(1, whole)), beside))
    assert sum(part.volume for part in read.parts) == pytest.approx(12000)
    assert sorted(_colors(read)) == [(0, 0, 255), (255, 0, 0)]
    assert read.findings == [finding]


@pytest.mark.parametrize(
    ("settings", "color"),
    [
        ("; filament_colour = #FF0000;#0000FF;\n", (0, 0, 255)),
        ("; filament_colour = #FF0000;#0000FF\n; extruder_colour = ;#00FF00\n", (0, 255, 0)),
        ("; filament_colour = #FF0000;#0000FF\n; extruder_colour = #00FF00;\n", (0, 0, 255)),
        ("; filament_colour = ;#0000FF\n", (0, 0, 255)),
        ("; filament_colour = #FF0000;blue\n", (204, 204, 204)),
        ("; filament_colour = #FF0000\n", (204, 204, 204)),
    ],
)
def test_the_second_filament_is_the_second_also_where_the_first_has_no_colour(
    tmp_path: Path, settings: str, color: tuple[int, int, int]
) -> None:
    parts = (
        '<config><object id="1"><volume firstid="0" lastid="11"><metadata type="volume" key="extruder" value="2"/></volume>'
        "</object></config>"
    )
    beside: dict[str, str | bytes] = {
        "Metadata/Slic3r_PE_model.config": parts,
        "Metadata/Slic3r_PE.config": settings,
    }
    assert _colors(_read(tmp_path, archive(model(mesh_object(1, BOX)), beside))) == [color]


def test_pieces_that_bambu_studio_does_not_print_are_left_out(tmp_path: Path) -> None:
    resources = '<object id="8"><components>' + "".join(
        f'<component p:path="/3D/Objects/object_1.model" objectid="{k}" transform="1 0 0 0 1 0 0 0 1 {20 * k} 0 0"/>'
        for k in (1, 2, 3)
    )
    settings = (
        '<config><object id="8"><metadata key="extruder" value="1"/><part id="1" subtype="normal_part"/>'
        '<part id="2" subtype="normal_part"><metadata key="extruder" value="2"/></part>'
        '<part id="3" subtype="modifier_part"/></object></config>'
    )
    beside: dict[str, str | bytes] = {
        "3D/Objects/object_1.model": model("".join(mesh_object(k, BOX) for k in (1, 2, 3)), items=""),
        "Metadata/model_settings.config": settings,
        "Metadata/project_settings.config": '{"filament_colour": ["#FF0000", "#0000FFFF"]}',
    }
    document = model(resources + "</components></object>", '<item objectid="8"/>')
    read = _read(tmp_path, archive(document, beside))
    assert _colors(read) == [(255, 0, 0), (0, 0, 255)]
    assert np.ptp([part.bounds for part in read.parts], axis=(0, 1)).tolist() == [30, 20, 30]


def test_several_objects_on_the_plate_are_told_and_none_built_means_all(tmp_path: Path) -> None:
    both = mesh_object(1, BOX) + mesh_object(2, BOX)
    read = _read(tmp_path, archive(model(both, '<item objectid="1"/><item objectid="2"/>')))
    assert read.findings == ["its plate has 2 objects, which were taken together as they lie"]
    read = _read(tmp_path, archive(model(mesh_object(1, BOX), items="")))
    assert len(read.parts) == 1 and "nothing of what is to be built" in read.findings[0]


LAUGHS = mesh_object(1, BOX) + "".join(
    f'<object id="{k}"><components>' + f'<component objectid="{k - 1}"/>' * 10 + "</components></object>"
    for k in range(2, 12)
)


@pytest.mark.parametrize(
    ("document", "reason", "cause"),
    [
        (model(LAUGHS, '<item objectid="11"/>'), "too_large", "more than 20000"),
        (model('<object id="1"><components><component objectid="1"/></components></object>'), "too_large", "64 levels"),
        (model("", '<item objectid="4"/>'), "unreadable", "object 4 is not there"),
        (model(mesh_object(1, BOX).replace('v1="7"', 'v1="8"')), "unreadable", "refers to a vertex that does not exist"),
        (model(mesh_object(1, BOX), attributes='unit="cubit"'), "unreadable", "unit 'cubit' is none of micron"),
        (
            model(mesh_object(1, BOX), attributes='requiredextensions="b" xmlns:b="http://x.org/beamlattice/2017"'),
            "unreadable",
            "it requires 'http://x.org/beamlattice/2017'",
        ),
        ('<!DOCTYPE model [<!ENTITY a "b">]>' + model("")[38:], "unreadable", "declares a document type"),
        (model(mesh_object(1, BOX))[:-90], "unreadable", "its XML is broken"),
        (model(mesh_object(1, BOX).replace('x="', 'y="', 1)), "unreadable", "XML is broken"),
        (model(mesh_object(1, BOX).replace('x="', 'w="', 1)), "unreadable", "its 3mf is broken"),
        (model('<object id="1"/>'), "no_faces", "it has no faces"),
    ],
    ids=["laughs", "loop", "missing", "vertex", "unit", "required", "type", "cut", "twice", "no x", "empty"],
)  # fmt: skip
def test_broken_and_hostile_models_are_one_clear_line(tmp_path: Path, document: str, reason: str, cause: str) -> None:
    with pytest.raises(InputError) as caught:
        _read(tmp_path, archive(document))
    line = str(caught.value)
    assert caught.value.reason == reason and line.startswith(f"{reason}: thing.3mf: ") and "\n" not in line
    assert cause in line


def test_bombs_and_cut_archives_are_refused(tmp_path: Path) -> None:
    bomb = archive(model(" " * 50_000_000))
    assert len(bomb) < 100_000
    with pytest.raises(InputError, match="it unpacks to more than 1000000 bytes"):
        _read(tmp_path, bomb, MeshLimits(max_bytes=1_000_000))
    whole = archive(model(mesh_object(1, BOX)))
    with pytest.raises(InputError, match="truncated or broken: its archive cannot be read"):
        _read(tmp_path, whole[:-40])
    many = trimesh.creation.icosphere(subdivisions=3)
    with pytest.raises(InputError, match="1280 faces exceed the limit of 1000"):
        _read(tmp_path, archive(model(mesh_object(1, many))), MeshLimits(max_faces=1000))


def test_an_archive_without_a_model_says_so(tmp_path: Path) -> None:
    content = archive("<a/>").replace(b"3dmodel.model", b"3dmodel.label")
    with pytest.raises(InputError, match=r"part '/3d/3dmodel\.model' is not in the archive"):
        _read(tmp_path, content)
    with pytest.raises(InputError, match="its archive contains no 3D model"):
        _read(tmp_path, content.replace(b"_rels/.rels", b"_rels/.text"))
