"""Small functions at the border, for every text: what they return holds, or they raise what they say."""

from __future__ import annotations

import json
import math
import unicodedata
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from manitwin.errors import ConfigError, UsageError
from manitwin.formats.csv_file import read_csv
from manitwin.formats.json_file import parse_json
from manitwin.formats.printable import printable, printable_line
from manitwin.formats.source_files import inside_folder, map_file_name, spellings
from manitwin.formats.toml_file import parse_toml
from manitwin.models.services.keys import redacted, split_url
from manitwin.models.services.refusal import error_message, refusal_by_status, retry_after_s
from manitwin.models.vlm.structured import json_object_in
from manitwin.twin.dataset_root import DatasetRoot

# the same examples each time, and none kept on disk: a failing one is printed, and becomes a test of its own
each = settings(
    derandomize=True,
    database=None,
    deadline=None,
    max_examples=60,
    suppress_health_check=list(HealthCheck),
    print_blob=False,
)
LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text()
VALUES = st.recursive(LEAVES, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4))
NAMES = st.text(max_size=60) | st.lists(
    st.sampled_from(("..", ".", "", "a", "~", "C:", "%2e%2e", "a b", "\\")), max_size=6
).map("/".join)


def one_line(error: Exception) -> bool:
    return "\n" not in str(error) and len(str(error)) < 1000


def finite(value: Any) -> bool:
    if isinstance(value, float):
        return math.isfinite(value)
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return all(map(finite, parts))


@each
@given(VALUES)
def test_json_is_read_as_it_was_written_where_its_numbers_are_finite(value: Any) -> None:
    text = json.dumps(value)
    try:
        read = parse_json(text.encode(), "a.json", UsageError)
    except UsageError as error:
        assert one_line(error) and (not finite(value) or "e+" in text or len(text) > 300)
    else:
        assert finite(read) and read == value


@each
@given(st.binary() | st.text().map(lambda text: text.encode("utf-16")))
def test_bytes_are_json_or_refused(content: bytes) -> None:
    try:
        parse_json(content, "a.json", UsageError)
    except UsageError as error:
        assert one_line(error) and str(error).startswith("a.json")


@each
@given(
    st.binary()
    | st.text().map(str.encode)
    | st.from_regex(r'([a-z]+ = ("[^"]*"|[0-9e+.-]+|\[.*\])\n)+').map(str.encode)
)
def test_bytes_are_toml_or_refused(content: bytes) -> None:
    try:
        assert isinstance(parse_toml(content, "a.toml", ConfigError), dict)
    except ConfigError as error:
        assert one_line(error) and str(error).startswith("a.toml")


@each
@given(content=st.binary() | st.text().map(lambda text: b"file,name\n" + text.encode("utf-8", "surrogatepass")))
def test_bytes_are_csv_or_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    try:
        for line, row in read_csv(path, UsageError):
            assert line > 0 and None not in row
    except UsageError as error:
        assert one_line(error) and "a.csv" in str(error)


@each
@given(st.text(alphabet=st.characters()))
def test_nothing_that_a_terminal_obeys_is_left_in_a_line(text: str) -> None:
    shown = printable_line(text)
    assert all(unicodedata.category(c) not in ("Cc", "Cf", "Cs", "Zl", "Zp") for c in shown)
    assert printable_line(shown) == shown
    assert len(printable(text, max_characters=20)) <= 20 * len("\\U0010ffff")


@each
@given(NAMES)
def test_a_name_leads_into_its_folder_or_nowhere(name: str) -> None:
    folder = Path("/work-of-nobody/inputs")
    for spelling in spellings(name):
        found = inside_folder(folder, spelling)
        assert found is None or found.is_relative_to(folder)


@each
@given(name=NAMES)
def test_no_name_leaves_the_data_set(name: str, tmp_path: Path) -> None:
    try:
        assert Path(DatasetRoot(tmp_path).full(name)).resolve().is_relative_to(tmp_path.resolve())
    except (UsageError, ValueError) as error:
        assert isinstance(error, UsageError) or "\0" in name


@each
@given(st.text())
def test_a_statement_of_a_material_names_a_file(statement: str) -> None:
    assert isinstance(map_file_name(statement), str)


@each
@given(
    st.text()
    | st.integers().map(str)
    | st.floats().map(str)
    | st.datetimes().map(lambda t: t.strftime("%a, %d %b %Y %H:%M:%S GMT"))
)
@example("²")
@example("9" * 400)
@example("Wed, 21 Oct 99999 07:28:00 GMT")
def test_a_server_asks_for_a_finite_wait_or_none(value: str) -> None:
    wait_s = retry_after_s(value)
    assert wait_s is None or (math.isfinite(wait_s) and wait_s >= 0)


@each
@given(st.text() | VALUES.map(json.dumps) | VALUES.map(lambda value: f"so ```json\n{json.dumps(value)}\n``` {{"))
def test_an_answer_holds_an_object_or_is_refused(text: str) -> None:
    try:
        value = json_object_in(text)
    except ValueError as error:
        assert str(error)
    else:
        assert isinstance(value, dict) and json.loads(json.dumps(value)) is not None


@each
@given(st.integers(100, 599), VALUES)
def test_every_body_of_a_refusal_is_told(status: int, body: Any) -> None:
    assert isinstance(error_message(body), str)
    refusal_by_status(status, body)


@each
@given(st.text(), st.text(min_size=4), st.text())
def test_a_key_is_in_no_message(before: str, key: str, after: str) -> None:
    assert key not in redacted(before + key + after, key)


@each
@given(
    st.text() | st.text().map(lambda text: f"name@https://{text}") | st.text().map(lambda text: f"m@http://{text}:x/v1")
)
def test_an_address_is_one_or_is_refused(argument: str) -> None:
    try:
        name, url = split_url(argument)
    except (ConfigError, UsageError) as error:
        assert one_line(error)
    else:
        assert isinstance(name, str) and (url is None or "://" in url)


@pytest.mark.parametrize(
    "text", ["[" * 200_000, "9" * 10_000, "1e400", "NaN", '{"a":' * 200_000, '"\\ud800"', "[1,]", ""]
)
def test_hostile_json_is_one_line(text: str) -> None:
    try:
        parse_json(text, "a.json", UsageError)
    except UsageError as error:
        assert one_line(error)
