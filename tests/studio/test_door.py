"""Who gets in: names of this machine, pages of the studio, holders of a cookie."""

import asyncio
import http.client
from contextlib import asynccontextmanager
from urllib.parse import urlsplit

import httpx
import pytest
from nicegui import core
from nicegui.testing.user_simulation import user_simulation

from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError
from cdpr_drake.studio.calculator import Calculator
from cdpr_drake.studio.door import IS_TOKEN, SESSION, Door
from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.page import make_page
from cdpr_drake.studio.scene_relay import SCENE
from cdpr_drake.studio.server import put_before_all, serve
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.sessions import MOST_SESSIONS, Sessions
from tests.messages import printed
from tests.studio.served import served

TOKEN = "secret-token-of-a-test"


async def inside(scope, receive, send):
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
        return
    session = scope[SESSION].encode()
    await send({"type": "http.response.start", "status": 200, "headers": [(b"in", session)]})
    await send({"type": "http.response.body", "body": b"inside"})


async def nothing(session):
    pass


def door(token=TOKEN, port=80, host="127.0.0.1"):
    return Door(inside, host, token, port, nothing)


def sent_for(kind, headers, *, to=None, query="", path="/", **more):
    sent = []

    async def send(message):
        sent.append(message)

    scope = {
        "type": kind, "path": path, "query_string": query.encode(), "method": "GET",
        "headers": [(k.encode(), v.encode("latin-1")) for k, v in headers], **more,
    }  # fmt: skip
    asyncio.run((to or door())(scope, None, send))
    return sent


def new_cookie(token=TOKEN, port=80):
    """A cookie of such a door, as a browser sends it back."""
    start, _ = sent_for(
        "http", [("host", "localhost")], query=f"token={token}", to=door(token, port)
    )
    return dict(start["headers"])[b"set-cookie"].decode().partition(";")[0]


COOKIE = new_cookie()


def ask(host="127.0.0.1:80", *, cookie=COOKIE, origin=None, **options):
    """Status, headers and body of the answer."""
    named = [("host", host)]
    named += [("cookie", cookie)] if cookie else []
    named += [("origin", origin)] if origin is not None else []
    start, body = sent_for("http", named, **options)
    return start["status"], dict(start["headers"]), body["body"].decode()


@pytest.mark.parametrize(
    ("bound", "hosts"),
    [("127.0.0.1", ["127.0.0.1:80", "localhost:80", "[::1]:80", "LOCALHOST"]),
     ("*", ["127.0.0.1:80", "192.168.1.7:80", "[fe80::1]:80"]),
     ("Studio.example", ["studio.example:80", "10.0.0.1"])],
)  # fmt: skip
def test_names_of_this_machine(bound, hosts):
    for host in hosts:
        assert ask(host, to=door(host=bound))[0] == 200, host
    assert ask("evil.example", to=door(host=bound))[0] == 403


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
    for headers in (hosts, hosts[::-1], hosts[2:]):
        assert sent_for("http", headers)[0]["status"] == 403


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
    assert (status, said.count("\n")) == (403, 1)
    assert words in said
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
    given, *others = headers[b"set-cookie"].decode().split("; ")
    assert TOKEN not in given
    assert {word.lower() for word in others} == {"path=/", "httponly", "samesite=strict"}
    first, second = ask(cookie=given), ask(cookie=COOKIE)
    assert first[2] == second[2] == "inside"
    assert first[1][b"in"] != second[1][b"in"]
    for wrong in (given + "x", given[:-1], given.replace(".", ""), "cdpr_studio_80=.", TOKEN,
                  f"cdpr_studio_80={TOKEN}", given.replace("_80", "_81"), given + "\u00e9",
                  new_cookie(port=81).replace("_81", "_80"), new_cookie(TOKEN + "2")):  # fmt: skip
        assert ask(cookie=wrong)[0] == 403, wrong
    assert ask("evil.example", cookie=given)[0] == 403
    # Cookies of other servers of this machine are passed over.
    assert ask(cookie='a={"x": [1, 2]}; cdpr_studio_80=toss.ed; b; =c; ' + given)[0] == 200


def test_a_cookie_is_kept_and_handed_out_for_a_page_only():
    status, headers, said = ask(query=f"token={TOKEN}")
    assert (status, "refresh" in said) == (200, True)
    assert b"set-cookie" not in headers
    assert ask(cookie="", query=f"token={TOKEN}", method="POST")[0] == 403


def test_the_way_back_stays_on_this_machine():
    for path in ("//evil.example/x", "/\\evil.example/x"):
        _, _, said = ask(cookie="", query=f"token={TOKEN}", path=path)
        assert 'content="0;url=/evil.example/x"' in said
    for path in ('/"><script>', "/\ud800"):
        assert "<script>" not in ask(cookie="", query=f"token={TOKEN}", path=path)[2]


@pytest.mark.parametrize("path", [SCENE, "/_nicegui_ws/socket.io/"])
def test_websockets_need_the_cookie_and_a_page_of_the_studio(path):
    host, cookie = ("host", "127.0.0.1:80"), ("cookie", COOKIE)
    closed = [{"type": "websocket.close", "code": 1008}]
    assert sent_for("websocket", [host], path=path) == closed
    assert sent_for("websocket", [host], path=path, query=f"token={TOKEN}") == closed
    other, own = ("origin", "http://evil.example"), ("origin", "http://127.0.0.1:80")
    assert sent_for("websocket", [host, cookie, other], path=path) == closed
    assert sent_for("websocket", [host, cookie, own], path=path) == [{"type": "websocket.accept"}]


def test_without_a_token_sessions_are_told_by_cookies_all_the_same():
    to = door("")
    status, headers, said = ask(cookie="", to=to)
    assert (status, 'url=/?cookie=set"' in said) == (200, True)
    given = headers[b"set-cookie"].decode().partition(";")[0]
    assert ask(cookie=given, to=to)[2] == "inside"
    for more in ({"path": "/scene/"}, {"query": "cookie=set"}, {"query": "token="}):
        assert (ask(cookie="", to=to, **more)[0] == 200) == ("token" in str(more)), more
    assert ask(cookie="cdpr_studio_80=x.y", to=to, path="/scene/")[0] == 403
    assert ask(cookie=new_cookie(), to=to, path="/scene/")[0] == 403


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


@asynccontextmanager
async def guarded(folder):
    """What asks the application behind the door, and its sessions."""
    calculator = Calculator()
    sessions = Sessions(lambda: Workbench(WorkingFolder(folder), calculator=calculator))
    try:
        async with user_simulation(make_page(sessions)):
            put_before_all("127.0.0.1", TOKEN, 80, sessions)
            transport = httpx.ASGITransport(core.app)
            async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as web:
                yield web, sessions
    finally:
        # The application is one for all tests of a process; theirs have no door.
        vars(core.app).pop("build_middleware_stack", None)
        core.app.middleware_stack = None
        calculator.close()


async def test_no_workbench_without_a_cookie_and_one_for_each(tmp_path):
    async with guarded(tmp_path) as (web, sessions):
        known = len(core.app.storage._users)
        for query, status in ({}, 403), ({"token": "wrong"}, 403), ({"token": TOKEN}, 200):
            web.cookies.clear()
            assert (await web.get("/", params=query)).status_code == status
        assert sessions.benches() == []
        assert len(core.app.storage._users) == known
        for _ in range(3):
            assert "cdpr studio" in (await web.get("/")).text
        assert len(sessions.benches()) == 1
        del web.cookies["cdpr_studio_80"]  # NiceGUI's own cookie is not enough
        assert (await web.get("/")).status_code == 403
        await web.get("/", params={"token": TOKEN})
        await web.get("/")
        assert len(sessions.benches()) == 2


async def test_sessions_that_nobody_looks_at_make_room_and_what_is_refused_is_tried_again():
    sessions = Sessions(object)
    first = sessions.open_page("0")
    for number in range(1, MOST_SESSIONS + 5):
        sessions.open_page(str(number))
        sessions.close_page(str(number))
    assert sessions.open_page("0") is first
    assert len(sessions.benches()) == MOST_SESSIONS
    problems = [CdprError("gone")]
    sessions = Sessions(lambda: object() if not problems else (_ for _ in ()).throw(problems.pop()))
    await sessions.prepare("0")
    with pytest.raises(CdprError, match="gone"):
        sessions.open_page("0")
    await sessions.prepare("0")
    assert sessions.open_page("0") is sessions.bench_of("0")


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
    assert "?token=" in address
    _, body, headers = answer(address, f"/?{urlsplit(address).query}")
    cookie = {"Cookie": headers["Set-Cookie"].partition(";")[0]}
    page = answer(address, "/", cookie)[1].decode()
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
    assert answer(address, static, cookie)[0] == 200
    assert answer(address, SCENE, cookie)[0] == 200
    other = {**cookie, "Host": "evil.com\\@127.0.0.1"}
    assert answer(address, "/", other)[0] == 403


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
        process.terminate()
        said = process.stdout.read()
    assert TOKEN not in said
