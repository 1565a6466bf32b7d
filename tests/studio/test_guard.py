"""Who gets in: names of this machine, pages of the studio, holders of a cookie."""

import asyncio

import pytest

from cdpr_drake.errors import CdprError
from cdpr_drake.studio.door import SESSION, Entrance, Guard, is_token
from cdpr_drake.studio.server import StudioOptions, serve

TOKEN = "secret-token-of-a-test"
ENTRANCE = Entrance(TOKEN, 80)
COOKIE = ENTRANCE.new_cookie().partition(";")[0]


async def inside(scope, receive, send):
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
        return
    session = scope[SESSION].encode()
    await send({"type": "http.response.start", "status": 200, "headers": [(b"in", session)]})
    await send({"type": "http.response.body", "body": b"inside"})


def sent_for(kind, headers, *, bound="127.0.0.1", entrance=ENTRANCE, query="", path="/", **more):
    sent = []

    async def send(message):
        sent.append(message)

    scope = {
        "type": kind, "path": path, "query_string": query.encode(), "method": "GET",
        "headers": [(k.encode(), v.encode("latin-1")) for k, v in headers], **more,
    }  # fmt: skip
    asyncio.run(Guard(inside, bound, entrance)(scope, None, send))
    return sent


def ask(host="127.0.0.1:80", *, cookie=COOKIE, origin=None, **options):
    """Status, headers and body of the answer."""
    named = [("host", host)]
    named += [("cookie", cookie)] if cookie else []
    named += [("origin", origin)] if origin is not None else []
    start, body = sent_for("http", named, **options)
    return start["status"], dict(start["headers"]), body["body"].decode()


@pytest.mark.parametrize("host", ["127.0.0.1:80", "localhost:80", "[::1]:80", "LOCALHOST"])
def test_names_of_this_machine(host):
    assert ask(host)[0] == 200


@pytest.mark.parametrize(
    "host",
    ["evil.example", "127.0.0.1.evil.example:80", "", "192.168.1.7", "evil.com\\@127.0.0.1",
     "evil.com@127.0.0.1", "127.0.0.1:80@evil.com", "127.0.0.1/evil.com", "127.0.0.1#evil.com",
     "127.0.0.1?evil.com", " 127.0.0.1", "127.0.0.1 evil.com", "127.0.0.1:", "127.0.0.1:x",
     "127.0.0.1\tevil.com", "[::1", "::1", "[::1]evil.com", "[::1%25evil.com]", "127.0.0.1:80:80",
     "127.0.0.1,evil.com", "\u00b9\u00b27.0.0.1", "127.1", "2130706433", "0x7f.1", "localhost."],
)  # fmt: skip
def test_other_names_are_refused_on_loopback(host):
    status, _, said = ask(host)
    assert status == 403
    assert said.startswith("Host: found ")


def test_a_request_names_one_host():
    hosts = [("host", "127.0.0.1"), ("host", "evil.example"), ("cookie", COOKIE)]
    assert sent_for("http", hosts)[0]["status"] == 403
    assert sent_for("http", hosts[::-1])[0]["status"] == 403
    assert sent_for("http", hosts[2:])[0]["status"] == 403


def test_other_pages_are_refused():
    assert ask(origin="http://127.0.0.1:80")[0] == 200
    for other in ("http://evil.example", "http://127.0.0.1:81", "null", "", "http://localhost:80",
                  "http://evil.com\\@127.0.0.1:80", "http://x@127.0.0.1:80", "ftp://127.0.0.1:80",
                  "127.0.0.1:80", "http://127.0.0.1:80/", "http://127.0.0.1:80 evil"):  # fmt: skip
        assert ask(origin=other)[0] == 403, other


@pytest.mark.parametrize(
    ("query", "words"),
    [("", "A token is missing"), ("token=", "The token is wrong"), ("token=wrong", "is wrong"),
     (f"token={TOKEN}x", "is wrong"), (f"token={TOKEN[:-1]}", "is wrong"),
     (f"token={TOKEN}&token=wrong", "is wrong"), ("token=%ff%00", "is wrong"),
     (f"TOKEN={TOKEN}", "is missing")],
)  # fmt: skip
def test_without_the_token_nobody_gets_in(query, words):
    status, headers, said = ask(cookie="", query=query)
    assert status == 403
    assert words in said
    assert said.count("\n") == 1
    assert TOKEN not in said
    assert b"set-cookie" not in headers
    if "wrong" in words:  # not even with a cookie
        assert ask(query=query)[0] == 403


def test_the_token_is_exchanged_for_a_cookie_of_a_new_session():
    status, headers, said = ask(cookie="", query=f"a=1&token={TOKEN}")
    assert status == 200
    assert 'content="0;url=/?a=1"' in said  # the browser goes on, without the token
    assert TOKEN not in said
    assert headers[b"referrer-policy"] == b"no-referrer"
    cookie = headers[b"set-cookie"].decode()
    assert TOKEN not in cookie
    assert cookie.endswith("; Path=/; HttpOnly; SameSite=Strict")
    given = cookie.partition(";")[0]
    first, second = ask(cookie=given), ask(cookie=COOKIE)
    assert first[2] == second[2] == "inside"
    assert first[1][b"in"] != second[1][b"in"]
    for wrong in (given + "x", given[:-1], given.replace(".", ""), "cdpr_studio_80=.", TOKEN,
                  f"cdpr_studio_80={TOKEN}", given.replace("_80", "_81"), given + "\u00e9",
                  Entrance(TOKEN, 81).new_cookie().replace("_81", "_80").partition(";")[0],
                  Entrance(TOKEN + "2", 80).new_cookie().partition(";")[0]):  # fmt: skip
        assert ask(cookie=wrong)[0] == 403, wrong
    assert ask("evil.example", cookie=given)[0] == 403


def test_a_session_is_kept_when_the_address_is_opened_again():
    status, headers, said = ask(query=f"token={TOKEN}")
    assert (status, "refresh" in said) == (200, True)
    assert b"set-cookie" not in headers


def test_cookies_of_other_servers_of_this_machine_are_passed_over():
    others = 'a={"x": [1, 2]}; cdpr_studio_80=toss.ed; b; =c; '
    assert ask(cookie=others + COOKIE)[0] == 200


def test_a_cookie_is_handed_out_for_a_page_only():
    assert ask(cookie="", query=f"token={TOKEN}", method="POST")[0] == 403


def test_the_way_back_stays_on_this_machine():
    for path in ("//evil.example/x", "/\\evil.example/x"):
        _, _, said = ask(cookie="", query=f"token={TOKEN}", path=path)
        assert 'content="0;url=/evil.example/x"' in said
    _, _, said = ask(cookie="", query=f"token={TOKEN}", path='/"><script>')
    assert "<script>" not in said


@pytest.mark.parametrize("path", ["/scene/", "/_nicegui_ws/socket.io/"])
def test_websockets_need_the_cookie_and_a_page_of_the_studio(path):
    host, cookie = ("host", "127.0.0.1:80"), ("cookie", COOKIE)
    closed = [{"type": "websocket.close", "code": 1008}]
    assert sent_for("websocket", [host], path=path) == closed
    assert sent_for("websocket", [host], path=path, query=f"token={TOKEN}") == closed
    other = ("origin", "http://evil.example")
    assert sent_for("websocket", [host, cookie, other], path=path) == closed
    own = ("origin", "http://127.0.0.1:80")
    assert sent_for("websocket", [host, cookie, own], path=path) == [{"type": "websocket.accept"}]


def test_without_a_token_sessions_are_told_by_cookies_all_the_same():
    open_to_all = Entrance("", 80)
    status, headers, said = ask(cookie="", entrance=open_to_all)
    assert (status, 'url=/?cookie=set"' in said) == (200, True)
    given = headers[b"set-cookie"].decode().partition(";")[0]
    assert ask(cookie=given, entrance=open_to_all)[2] == "inside"
    for more in ({"path": "/scene/"}, {"query": "cookie=set"}):
        assert ask(cookie="", entrance=open_to_all, **more)[0] == 403, more
    assert not open_to_all.accepts("")


def test_tokens_that_people_choose():
    assert is_token(TOKEN)
    for wrong in (
        "",
        "short",
        "with blanks inside it",
        "x" * 201,
        "a&token=bbbbbbbbbbbb",
        "é" * 20,
    ):
        assert not is_token(wrong)


@pytest.mark.parametrize(
    ("options", "words"),
    [({"token": "short"}, "token: found 5 characters; accepted: 16 to 200"),
     ({"token": "", "host": "*"}, "--no-token: found it with --host *"),
     ({"token": "", "host": "192.0.2.1"}, "--no-token: found it with --host 192.0.2.1")],
)  # fmt: skip
def test_tokens_that_are_refused(tmp_path, options, words):
    with pytest.raises(CdprError) as found:
        serve(StudioOptions(folder=tmp_path, **options))
    assert str(found.value).startswith(words)
