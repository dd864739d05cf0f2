from __future__ import annotations

import re
from pathlib import Path

import pytest

import manitwin
from manitwin.errors import AssetError, ConfigError, ExportError
from manitwin.formats import xml_file
from manitwin.formats.xml_file import add, document, new_element, number_text, parse_xml, read_xml, xml_text

LAUGHS = "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 10))
BOMB = f'<!DOCTYPE a [<!ENTITY a0 "ha">{LAUGHS}]><a b="&a9;">&a9;</a>'


def test_xml_is_parsed_as_a_tree_and_as_a_walk_in_one_module_each() -> None:
    parses = re.compile(
        r"etree\.(fromstring|parse|XMLParser|iterparse|XML\()|ElementTree|minidom|expat|\bpulldom|\.xinclude"
    )
    package = Path(manitwin.__file__).parent
    found = [path.name for path in sorted(package.rglob("*.py")) if parses.search(path.read_text())]
    assert found == ["xml_file.py", "xml_walk.py"]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "latin-1"])
@pytest.mark.parametrize(
    "text",
    [
        BOMB,
        '<!DOCTYPE a [<!ENTITY e SYSTEM "file:///etc/hostname">]><a>&e;</a>',
        '<!DOCTYPE a SYSTEM "http://localhost/a.dtd"><a/>',
        "<!-- first --><!DOCTYPE a><a/>",
    ],
)
def test_a_document_type_is_refused_before_an_entity_is_put_in(text: str, encoding: str) -> None:
    declared = f'<?xml version="1.0" encoding="{encoding}"?>' + text
    with pytest.raises(AssetError, match=r"x\.urdf: its XML declares a document type, which is not read; remove it"):
        parse_xml(declared.encode(encoding), "a", "x.urdf", max_bytes=None)


def test_a_document_type_in_an_encoding_that_few_know_is_refused_too() -> None:
    with pytest.raises(AssetError, match=r"x\.dae: its XML"):
        parse_xml(f'<?xml version="1.0" encoding="IBM037"?>{BOMB}'.encode("cp037"), "a", "x.dae", max_bytes=None)


def test_includes_and_unknown_entities_open_nothing() -> None:
    include = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="/etc/hostname" parse="text"/>'
    root = parse_xml(f"<a>{include}</a>", "a", "x")
    assert not "".join(root.itertext()) and len(root) == 1
    with pytest.raises(AssetError, match="its XML is broken"):
        parse_xml("<a>&hostname;</a>", "a", "x")


def test_other_roots_broken_and_large_files_are_refused_as_the_reader_s_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "thing.urdf"
    with pytest.raises(
        ConfigError, match=r"thing\.urdf: cannot be opened \(No such file or directory\); check the path"
    ):
        read_xml(path, "robot", refusal=ConfigError)
    path.write_text("<robot>")
    with pytest.raises(ConfigError, match=r"here: its XML is broken"):
        read_xml(path, "robot", name="here", refusal=ConfigError)
    path.write_text("<sdf/>")
    with pytest.raises(AssetError, match=r"its XML is <sdf>, not <robot>"):
        read_xml(path, "robot")
    monkeypatch.setattr(xml_file, "MAX_XML_BYTES", 3)
    with pytest.raises(AssetError, match=r"thing\.urdf: 6 bytes exceed the limit of 3"):
        read_xml(path, "sdf")


def test_root_is_known_in_any_namespace_and_comments_go_where_they_are_not_wanted() -> None:
    assert len(parse_xml('<a xmlns="urn:x"><!-- b --></a>', "a", "x")) == 1
    assert len(parse_xml('<a xmlns="urn:x"><!-- b --></a>', "a", "x", comments=False)) == 0


def test_document_has_its_comments_first_and_none_that_ends_early() -> None:
    root = new_element("a", z="1", b="2")
    add(root, "c", "text", x=number_text(-0.0, 0.1))
    assert xml_text(root) == '<a z="1" b="2"><c x="0.0 0.1">text</c></a>'
    assert document(root, ["from -- there\n-"]).decode() == (
        "<?xml version='1.0' encoding='utf-8'?>\n"
        '<a z="1" b="2">\n  <!-- from - - there  -->\n  <c x="0.0 0.1">text</c>\n</a>\n'
    )
    with pytest.raises(ExportError, match="no number"):
        number_text(float("nan"))


@pytest.mark.parametrize(
    "head",
    [
        b'<?xml version="0.0"?>', b'\n<?xml version="1.0" encoding="utf-8"?>', b"<!-- a -- --><?xml version='1.1'?>",
        b'\xef\xbb\xbf \n<?xml version="1.0"?>', b'<!-- a -->\r\n<!-- <b> --><?xml version="1.0" standalone="yes"?>',
    ],
)  # fmt: skip
def test_a_declaration_of_another_version_or_below_comments_is_read(head: bytes) -> None:
    assert parse_xml(head.replace(b"a -- -", b"a -") + "<a b='ä'/>".encode(), "a", "x").get("b") == "ä"


@pytest.mark.parametrize(
    "data", [b"<a/><?xml version='1.0'?>", b"<!-- <?xml version='1.0'?>", b"text <?xml version='0'?><a/>"]
)
def test_a_declaration_elsewhere_is_broken(data: bytes) -> None:
    with pytest.raises(AssetError, match="broken"):
        parse_xml(data, "a", "x")


def test_the_encoding_that_a_late_declaration_says_is_kept() -> None:
    assert (
        parse_xml("\n<?xml version='1.0' encoding='iso-8859-1'?><a b='ä'/>".encode("latin-1"), "a", "x").get("b") == "ä"
    )


def test_an_ampersand_that_begins_no_reference_is_read_as_itself() -> None:
    for text in ("rail & curtain", "a &amp b", "&"):
        data = f"<model><d k='1&2'>{text} &lt; &#38;</d></model>".encode()
        root = parse_xml(data, "model", "m.config")
        assert root.findtext("d") == text + " < &" and root.find("d").get("k") == "1&2"
    with pytest.raises(AssetError, match="broken"):
        parse_xml(b"<model><d>a & b</model>", "model", "m.config")


def test_what_begins_as_a_declaration_and_is_none_is_skipped() -> None:
    root = parse_xml(r"<a><b/> <!-\- no - comment -\-><c/></a>", "a", "a.xml")
    assert [each.tag for each in root] == ["b", "c"]


def test_what_comes_after_the_root_is_not_looked_at_and_a_broken_root_is() -> None:
    assert [each.tag for each in parse_xml("<a><b/></a>\n<a><c/></a> and", "a", "a.xml")] == ["b"]
    with pytest.raises(AssetError, match="its XML is broken"):
        parse_xml("<a><b></a><a/>", "a", "a.xml")


def test_less_than_within_a_value_is_read_as_itself() -> None:
    assert parse_xml('<a b="<STL>"><c d="1"/></a>', "a", "a.xml").get("b") == "<STL>"
