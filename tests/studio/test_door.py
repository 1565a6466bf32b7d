"""Who gets in: names of this machine, pages of the studio, holders of a cookie."""

import asyncio
import gc
import http.client
from urllib.parse import urlsplit

import pytest

from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError
from cdpr_drake.studio.door import BENCH, MOST_SESSIONS, Door, Sessions
from cdpr_drake.studio.page import SCENE
from cdpr_drake.studio.server import IS_TOKEN, serve
from tests.messages import printed
from tests.studio.pages import until
from tests.studio.served import served

TOKEN = "secret-token-of-a-test"
HOST, COOKIE_NAME = "127.0.0.1:80", "cdpr_studio_80"
CLOSED = [{"type": "websocket.close", "code": 1008}]


async def inside(scope, receive, send):
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
        return
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": scope[BENCH].encode()})


async def bench(session):
    return session


def door(token=TOKEN, port=80, host="127.0.0.1", bench=bench):
    return Door(inside, host, token, port, bench)


def sent(kind, headers, *, to=None, query="", path="/", method="GET"):
    """What a door sends to who asks with headers."""
    found = []

    async def send(message):
        found.append(message)

    scope = {
        "type": kind, "path": path, "query_string": query.encode(), "method": method,
        "headers": [(k.encode(), v.encode("latin-1")) for k, v in headers],
    }  # fmt: skip
    asyncio.run((to or door())(scope, None, send))
    return found


def ask(host=HOST, *, cookie=None, origin=None, **options):
    """Status, headers and body of an answer."""
    headers = [("host", host), ("cookie", COOKIE if cookie is None else cookie)]
    headers += [] if origin is None else [("origin", origin)]
    start, body = sent("http", headers, **options)
    return start["status"], dict(start["headers"]), body["body"].decode()


def new_cookie(token=TOKEN, port=80):
    """A cookie of such a door, as a browser sends it back."""
    headers = ask(cookie="", query=f"token={token}", to=door(token, port))[1]
    return headers[b"set-cookie"].decode().partition(";")[0]


COOKIE = new_cookie()


@pytest.mark.parametrize(
    ("bound", "hosts"),
    [("127.0.0.1", ["127.0.0.1:80", "localhost:80", "[::1]:80", "LOCALHOST"]),
     ("*", ["127.0.0.1:80", "192.168.1.7:80", "[fe80::1]:80"]),
     ("Studio.example", ["studio.example:80", "10.0.0.1"])],
)  # fmt: skip
def test_names_of_this_machine(bound, hosts):
    answers = {host: ask(host, to=door(host=bound))[0] for host in [*hosts, "evil.example"]}
    assert answers == dict.fromkeys(hosts, 200) | {"evil.example": 403}


def test_other_names_are_refused_on_loopback():
    for host in (
        "evil.example", "127.0.0.1.evil.example:80", "", "192.168.1.7", "evil.com\\@127.0.0.1",
        "evil.com@127.0.0.1", "127.0.0.1:80@evil.com", "127.0.0.1/evil.com", "127.0.0.1#evil.com",
        "127.0.0.1?evil.com", " 127.0.0.1", "127.0.0.1 evil.com", "127.0.0.1:", "127.0.0.1:x",
        "127.0.0.1\tevil.com", "[::1", "::1", "[::1]evil.com", "[::1%25evil.com]", "127.1",
        "127.0.0.1:80:80", "127.0.0.1,evil.com", "\u00b9\u00b27.0.0.1", "2130706433", "0x7f.1",
        "localhost.",
    ):  # fmt: skip
        status, _, said = ask(host)
        assert (status, said[:12]) == (403, "Host: found "), host
    both = [("host", HOST), ("host", "evil.example"), ("cookie", COOKIE)]
    for headers in (both, both[1::-1] + both[2:], both[2:]):
        assert sent("http", headers)[0]["status"] == 403


def test_other_pages_are_refused():
    assert ask(origin="http://127.0.0.1:80")[0] == 200
    for other in ("http://evil.example", "http://127.0.0.1:81", "null", "", "http://localhost:80",
                  "http://evil.com\\@127.0.0.1:80", "http://x@127.0.0.1:80", "ftp://127.0.0.1:80",
                  "127.0.0.1:80", "http://127.0.0.1:80/", "http://127.0.0.1:80 evil"):  # fmt: skip
        assert ask(origin=other)[0] == 403, other


def test_without_the_token_nobody_gets_in():
    for query, words in {
        "": "A cookie is missing", "token=": "The token is wrong", f"token={TOKEN}x": "is wrong",
        f"token={TOKEN[:-1]}": "is wrong", f"token={TOKEN}&token=wrong": "is wrong",
        "token=%ff%00": "is wrong", f"TOKEN={TOKEN}": "is missing",
    }.items():  # fmt: skip
        status, headers, said = ask(cookie="", query=query)
        assert (status, said.count("\n"), words in said) == (403, 1, True), query
        assert headers[b"cache-control"] == b"no-store"
        assert TOKEN not in said
        assert b"set-cookie" not in headers
        assert "wrong" not in words or ask(query=query)[0] == 403  # not even with a cookie


def test_the_token_is_exchanged_for_a_cookie_of_a_new_session():
    status, headers, said = ask(cookie="", query=f"a=1&token={TOKEN}")
    assert status == 200
    assert 'content="0;url=/?a=1"' in said  # the browser goes on, without the token
    assert headers[b"referrer-policy"] == b"no-referrer"
    new, *others = headers[b"set-cookie"].decode().split("; ")
    assert TOKEN not in said + new
    assert {word.lower() for word in others} == {"path=/", "httponly", "samesite=strict"}
    assert (ask(cookie=new)[0], ask(cookie=new)[2]) == (200, new.partition("=")[2].split(".")[0])
    assert ask(cookie=new)[2] != ask()[2]
    for wrong in (new + "x", new[:-1], new.replace(".", ""), f"{COOKIE_NAME}=.", TOKEN,
                  f"{COOKIE_NAME}={TOKEN}", new.replace("_80", "_81"), new + "\u00e9",
                  new_cookie(port=81).replace("_81", "_80"), new_cookie(TOKEN + "2")):  # fmt: skip
        assert ask(cookie=wrong)[0] == 403, wrong
    # Cookies of other servers of this machine are passed over.
    assert ask(cookie=f'a={{"x": [1, 2]}}; {COOKIE_NAME}=toss.ed; b; =c; {new}')[0] == 200
    # A cookie is kept, and handed out for a page only.
    assert b"set-cookie" not in ask(query=f"token={TOKEN}")[1]
    assert ask(cookie="", query=f"token={TOKEN}", method="POST")[0] == 403
    for path in ("//evil.example/x", "/\\evil.example/x", '/"><script>', "/\ud800"):
        said = ask(cookie="", query=f"token={TOKEN}", path=path)[2]
        assert ("evil" in path) == ('content="0;url=/evil.example/x"' in said)
        assert "<script>" not in said


def test_websockets_need_the_cookie_and_a_page_of_the_studio():
    host, cookie, own = ("host", HOST), ("cookie", COOKIE), ("origin", f"http://{HOST}")
    for headers in ([host], [host, cookie, ("origin", "http://evil.example")]):
        assert sent("websocket", headers, query=f"token={TOKEN}") == CLOSED
    assert sent("websocket", [host, cookie, own]) == [{"type": "websocket.accept"}]


def test_without_a_token_sessions_are_told_by_cookies_all_the_same():
    to = door("")
    status, headers, said = ask(cookie="", to=to)
    assert (status, 'url=/?cookie=set"' in said) == (200, True)
    new = headers[b"set-cookie"].decode().partition(";")[0]
    assert ask(cookie=new, to=to)[0] == ask(cookie="", to=to, query="token=")[0] == 200
    assert ask(cookie="", to=to, query="cookie=set")[0] == 403
    for wrong in ("", f"{COOKIE_NAME}=x.y", COOKIE):
        assert ask(cookie=wrong, to=to, path="/scene/")[0] == 403


async def test_each_session_has_a_workbench_and_those_that_nobody_looks_at_make_room():
    problems = [CdprError("gone")]

    def make():
        if problems:
            raise problems.pop()
        return type("Bench", (), {})()

    sessions = Sessions(make)
    with pytest.raises(CdprError, match="gone"):
        await sessions.bench("0")
    first, _ = await asyncio.gather(sessions.bench("0"), sessions.bench("0"))
    for number in range(1, MOST_SESSIONS + 5):
        assert await sessions.bench(str(number)) is await sessions.bench(str(number))
        assert await sessions.bench("1") is not first
    # A page shows the first; a thread that is slow may still have another one in its hand.
    await until(lambda: gc.collect() >= 0 and len(sessions) == MOST_SESSIONS + 1, 30.0)
    assert await sessions.bench("0") is first


def test_a_workbench_that_cannot_be_made_is_said_and_none_is_made_without_a_cookie():
    async def gone(session):
        raise CdprError(f"robot.yaml: gone for {session}")

    status, _, said = ask(to=door(bench=gone))
    assert (status, said[:21]) == (500, "robot.yaml: gone for ")
    for refused in ({"cookie": ""}, {"host": "evil.com"}, {"query": "token=wrong"}):
        assert ask(to=door(bench=gone), **refused)[0] == 403
    assert ask(cookie="", query=f"token={TOKEN}", to=door(bench=gone))[0] == 200


@pytest.mark.parametrize(
    ("options", "words"),
    [({"token": "short"}, "token: found 5 characters; accepted: 16 to 200"),
     ({"token": "", "host": "*"}, "--no-token: found it with --host *"),
     ({"token": "", "host": "192.0.2.1"}, "--no-token: found it with --host 192.0.2.1")],
)  # fmt: skip
def test_tokens_that_are_refused(tmp_path, options, words):
    assert IS_TOKEN.fullmatch(TOKEN)
    for wrong in ("with blanks inside it", "x" * 201, "a&token=bbbbbbbbbbbb", "é" * 20):
        assert not IS_TOKEN.fullmatch(wrong)
    with pytest.raises(CdprError) as found:
        serve(folder=tmp_path, **options)
    assert str(found.value).startswith(words)


def answer(address, path, headers=(), method="GET"):
    """Status, body and headers of a plain request, without any cookie."""
    parts = urlsplit(address)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=600)
    connection.request(method, path, headers=dict(headers))
    found = connection.getresponse()
    body = found.read()
    connection.close()
    return found.status, body, found.headers


UPGRADE = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
           "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA=="}  # fmt: skip


def test_nothing_of_a_server_is_open_to_who_has_no_cookie(studio):
    address = studio[1]
    headers = answer(address, f"/?{urlsplit(address).query}")[2]
    cookie = {"Cookie": headers["Set-Cookie"].partition(";")[0]}
    page = answer(address, "/", cookie)[1].decode()
    assert '<html lang="en' in page  # programs that read pages aloud choose a voice by it
    static = page[page.index("/_nicegui/") :].partition('"')[0]
    paths = ["/", static, SCENE, f"{SCENE}meshcat.js", "/favicon.ico", "/nothing", "/docs",
             "/_nicegui_ws/socket.io/?EIO=4&transport=polling", "/_nicegui/x"]  # fmt: skip
    for path in paths:
        for method in ("GET", "POST", "HEAD"):
            status, body, found = answer(address, path, method=method)
            assert (status, found["Cache-Control"]) == (403, "no-store"), (path, method)
            assert body.count(b"\n") == (method != "HEAD")
    for path in ("/_nicegui_ws/socket.io/?EIO=4&transport=websocket", SCENE):
        assert answer(address, path, UPGRADE)[0] == 403, path
    assert [answer(address, path, cookie)[0] for path in (static, SCENE)] == [200, 200]
    assert answer(address, "/", {**cookie, "Host": "evil.com\\@127.0.0.1"})[0] == 403


@pytest.mark.parametrize(
    ("options", "variable", "words"),
    [(["--no-token"], TOKEN, "--no-token: found it with CDPR_STUDIO_TOKEN set"),
     ([], "", "CDPR_STUDIO_TOKEN: found an empty text")],
)  # fmt: skip
def test_what_is_refused_at_the_start(tmp_path, monkeypatch, capsys, options, variable, words):
    monkeypatch.setenv("CDPR_STUDIO_TOKEN", variable)
    with pytest.raises(SystemExit) as ended:
        main(["studio", "--folder", str(tmp_path), "--port", "0", "--no-browser", *options])
    assert ended.value.code == 2
    said = printed(capsys)
    assert said.err.startswith(f"cdpr: {words}")
    assert TOKEN not in said.out + said.err


def test_a_token_that_is_set_is_not_printed(tmp_path, monkeypatch):
    monkeypatch.setenv("CDPR_STUDIO_TOKEN", TOKEN)
    with served(tmp_path) as (address, process):
        assert "token" not in address
        for query, status in ("", 403), (f"?token={TOKEN}", 200), (f"?token={TOKEN}x", 403):
            assert answer(address, f"/{query}")[0] == status
    assert TOKEN not in "".join(process.said)
