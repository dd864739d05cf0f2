"""Links and cookies that outlive a server, in a file that holds neither of them."""

from __future__ import annotations

import json
import stat
from pathlib import Path

import pytest
from access_requests import asked, header

from manitwin.errors import UsageError
from manitwin.web.access import Guard, ServerNames
from manitwin.web.serve import PageServer
from manitwin.web.tokens import LASTING_S, MOST_LINKS, AccessFile, Tokens


@pytest.fixture
def kept(tmp_path: Path) -> AccessFile:
    return AccessFile(tmp_path / "reviews.access.json")


def test_who_was_let_in_and_links_that_nobody_used_are_known_to_the_next_server(kept: AccessFile) -> None:
    before = Tokens(kept)
    used, unused = before.link("ada"), before.link("ben")
    secret = before.redeem(used)
    assert secret is not None
    after = Tokens(kept)
    assert after.person(secret) == "ada" and after.person("another") is None
    assert after.redeem(used) is None, "a link is of one use, over a restart too"
    again = after.redeem(unused)
    assert again is not None and Tokens(kept).person(again) == "ben"


def test_the_file_is_its_owners_and_opens_nothing_by_itself(kept: AccessFile) -> None:
    tokens = Tokens(kept)
    token = tokens.link("ada")
    secret = tokens.redeem(token) or ""
    later = tokens.link("ada")
    content = kept.path.read_text()
    assert stat.S_IMODE(kept.path.stat().st_mode) == 0o600
    assert not any(each in content for each in (token, secret, later))
    for digest in (*json.loads(content)["links"], *json.loads(content)["cookies"]):
        assert tokens.person(digest) is None and tokens.redeem(digest) is None


def test_links_and_cookies_end_after_a_month_and_by_revoking(kept: AccessFile) -> None:
    now = 1e9
    tokens = Tokens(kept, lambda: now)
    secret, link = tokens.redeem(tokens.link("ada")) or "", tokens.link("ada")
    now += LASTING_S - 1
    assert tokens.person(secret) == "ada" and Tokens(kept, lambda: now).person(secret) == "ada"
    now += 2
    assert tokens.person(secret) is None and tokens.redeem(link) is None
    assert Tokens(kept, lambda: now).person(secret) is None
    fresh = tokens.redeem(tokens.link("ada")) or ""
    Tokens(kept, lambda: now).revoke_all()
    assert Tokens(kept, lambda: now).person(fresh) is None


def test_every_one_of_many_annotators_has_a_link(kept: AccessFile) -> None:
    tokens = Tokens(kept)
    links = {f"a{number}": tokens.link(f"a{number}") for number in range(3 * MOST_LINKS)}
    assert all(tokens.redeem(link) for link in links.values())


def test_without_a_file_nothing_is_written_and_the_cookie_ends_with_the_browser(tmp_path: Path) -> None:
    for tokens, lasting in ((Tokens(), False), (Tokens(AccessFile(tmp_path / "a.json")), True)):
        guard = Guard(lambda *_: None, ServerNames.of("127.0.0.1", 80), tokens)  # type: ignore[arg-type, return-value]
        answer = asked(guard, f"/enter?token={tokens.link('ada')}", [("host", "127.0.0.1")])
        assert ("Max-Age=2592000" in header(answer, "set-cookie")) == lasting
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{", '{"links": 3}', '{"cookies": {"x": {"person": 1, "at": 0}}}', '{"port": 99999}', '{"a": 1}'],
)
def test_a_file_that_is_none_of_ours_is_said_with_what_to_do(kept: AccessFile, content: str) -> None:
    kept.path.write_text(content)
    with pytest.raises(UsageError, match=r"reviews\.access\.json"):
        Tokens(kept)


def test_a_server_that_starts_again_has_the_port_that_it_had_where_it_is_free(kept: AccessFile) -> None:
    async def nothing(*_: object) -> None: ...

    first = PageServer(nothing, "127.0.0.1", 0, tokens=Tokens(kept))
    beside = PageServer(nothing, "127.0.0.1", 0, tokens=Tokens(kept))
    assert beside.port != first.port
    for server in (first, beside):
        server.socket.close()
    again = PageServer(nothing, "127.0.0.1", 0, tokens=Tokens(kept))
    assert again.port == beside.port
    again.socket.close()
