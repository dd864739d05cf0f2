"""JSON, TOML and CSV of outsiders: read as they are, or refused in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from manitwin.errors import UsageError
from manitwin.formats.csv_file import MAX_COLUMNS, MAX_LINE_BYTES, read_csv
from manitwin.formats.json_file import json_number, parse_json, read_json_object
from manitwin.formats.printable import printable, printable_line
from manitwin.formats.toml_file import parse_toml, read_toml


def refused(caught: pytest.ExceptionInfo[UsageError], *parts: str) -> None:
    said = str(caught.value)
    assert "\n" not in said and len(said) < 400 and said.isprintable()
    for part in parts:
        assert part in said


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (b"[" * 200_000, "nested too deep"),
        (b'{"a":' * 200_000, "nested too deep"),
        (b"9" * 10_000, "broken"),
        (b'{"a": -' + b"9" * 5000 + b"}", "broken"),
        (b"1e400", "1e400 is not a finite number"),
        (b"-1e999", "not a finite number"),
        (b'{"a": NaN}', "NaN is not a finite number"),
        (b"[Infinity, -Infinity]", "not a finite number"),
        (b"\xff\xfe{\0}\0", "not UTF-8"),
        (b"", "broken"),
        (b"{" + b"\x1b[31m" * 3, "broken"),
        (b'{"a": 1} {"b": 2}', "broken"),
    ],
)
def test_json_that_cannot_be_read_is_one_line(content: bytes, cause: str) -> None:
    with pytest.raises(UsageError) as caught:
        parse_json(content, "a.json", UsageError)
    refused(caught, "a.json: ", cause)


def test_json_is_read_as_it_is_written() -> None:
    text = '{"a": [1, -2.5, 1e300, true, null, "\\u00e9"], "b": {}}'
    assert parse_json(text, "x", UsageError) == {"a": [1, -2.5, 1e300, True, None, "é"], "b": {}}
    assert parse_json(b"\xef\xbb\xbf[]", "x", UsageError) == []


@pytest.mark.parametrize("text", ["[]", "3", '"x"', "null"])
def test_json_that_is_no_object_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(UsageError) as caught:
        read_json_object(tmp_path / "a.json", UsageError)
    refused(caught, "a.json: contains a JSON", "not an object")


@pytest.mark.parametrize("value", [10**400, -(10**400), float("inf"), float("nan"), 1e10])
def test_number_that_no_object_has_is_refused(value: float) -> None:
    with pytest.raises(Exception, match=r"^mass: .* is out of range for an object"):
        json_number(value, "mass")


@pytest.mark.parametrize("value", ["3", True, None])
def test_what_is_no_number_is_refused(value: Any) -> None:
    with pytest.raises(Exception, match=r"^mass: .* is not a number"):
        json_number(value, "mass")


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (b"a = " + b"[" * 100_000, "nested too deep"),
        (b"a = " + b"9" * 10_000, "not TOML"),
        (b"a = \xff", "not UTF-8"),
        (b"a = [1, 2", "not TOML"),
        (b"a = 1\na = 2", "not TOML"),
    ],
)
def test_toml_that_cannot_be_read_is_one_line(content: bytes, cause: str) -> None:
    with pytest.raises(UsageError) as caught:
        parse_toml(content, "a.toml", UsageError)
    refused(caught, "a.toml: ", cause)


def test_toml_of_more_than_a_mebibyte_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("# " + "x" * (1 << 20))
    with pytest.raises(UsageError, match="exceed the limit of 1048576"):
        read_toml(tmp_path / "a.toml", UsageError)


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (b'file,name\na.obj,"never closed\n' * 3, "not CSV"),
        (
            b",".join(b"c%d" % number for number in range(MAX_COLUMNS + 1)) + b"\na.obj\n",
            ":1: 513 columns; at most 512",
        ),
        (b'file,name\na.obj,"never closed\nb.obj,box\n', "unexpected end of data"),
        (b"file,name\na.obj,b,c\n", ":2: more values than columns"),
        (b"file,name\na.obj," + b"x" * (MAX_LINE_BYTES + 1), ":2: a line of more than"),
        (b"file,name\n" + b'"' + (b"x" * 1000 + b"\n") * 2000, "not CSV (field larger than"),
        (b"file,name\na.obj,caf\xe9\n", "not UTF-8 text (invalid continuation byte at byte 19)"),
    ],
)
def test_csv_that_cannot_be_read_is_one_line(tmp_path: Path, content: bytes, cause: str) -> None:
    (tmp_path / "a.csv").write_bytes(content)
    with pytest.raises(UsageError) as caught:
        list(read_csv(tmp_path / "a.csv", UsageError, name="a.csv"))
    refused(caught, "a.csv:", cause)


def test_csv_is_read_with_its_quotes_line_ends_and_numbers_of_lines(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b'\xef\xbb\xbffile,name\r\na.obj,"a ""b"", c"\r\n"b\n.obj",d\r\n\r\nc.obj,\r\n')
    rows = list(read_csv(tmp_path / "a.csv", UsageError))
    names = [{"file": "a.obj", "name": 'a "b", c'}, {"file": "b\n.obj", "name": "d"}, {"file": "c.obj", "name": ""}]
    assert rows == list(zip([2, 4, 6], names, strict=True))


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("a\x1b[31mred\x07", r"a\x1b[31mred\x07"),
        ("\u202ejbo.exe", r"\u202ejbo.exe"),
        ("zero\u200bwidth\u2066\ufeff", r"zero\u200bwidth\u2066\ufeff"),
        ("caf\udce9.obj", r"caf\udce9.obj"),
        ("\x9b31m\x85\u2028", r"\x9b31m\x85\u2028"),
        ("tag\U000e0041", r"tag\U000e0041"),
        ("Grüße, 日本語 \U0001f600", "Grüße, 日本語 \U0001f600"),
        ("two\nlines\t", "two\nlines\t"),
    ],
)
def test_text_of_outsiders_is_shown_with_what_a_terminal_would_obey_written_out(text: str, shown: str) -> None:
    assert printable(text) == shown
    assert printable_line(text).isprintable()


def test_long_text_is_cut_in_the_middle() -> None:
    assert printable("a" * 50 + "b" * 50, max_characters=11) == "aaaa...bbbb"
