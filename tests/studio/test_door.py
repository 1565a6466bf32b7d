"""Who gets in: names of this machine, pages of the studio, holders of a cookie."""

import asyncio
import gc

import httpx
import pytest
from starlette.responses import PlainTextResponse

from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError
from cdpr_drake.studio.door import BENCH, MOST_SESSIONS, Door, Sessions
from cdpr_drake.studio.page import SCENE
from cdpr_drake.studio.server import LARGEST_MESSAGE, MOST_BEHIND, hand_on
from tests.messages import printed
from tests.studio.pages import until
from tests.studio.served import served

TOKEN = "secret-token-of-a-test"
HOST, COOKIE_NAME = "127.0.0.1:80", "cdpr_studio_80"
REFUSED = [{"type": "websocket.close", "code": 1008}]


async def inside(scope, receive, send):
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
    else:
        await PlainTextResponse(scope[BENCH])(scope, receive, send)


async def bench(session):
    return session


def door(token=TOKEN, port=80, host="127.0.0.1", bench=bench):
    return Door(inside, host, token, port, bench)


def sent(*headers, kind="http", to=None, query="", path="/", method="GET"):
    """What a door sends to who asks with headers."""
    messages = []

    async def send(message):
        messages.append(message)

    scope = {
        "type": kind, "path": path, "query_string": query.encode(), "method": method,
        "headers": [(k.encode(), v.encode("latin-1")) for k, v in headers],
    }  # fmt: skip
    asyncio.run((to or door())(scope, None, send))
    return messages


def ask(*, host=HOST, cookie=None, origin=None, **options):
    """Status, headers and body of an answer."""
    headers = [("host", host), ("cookie", COOKIE if cookie is None else cookie)]
    headers += [] if origin is None else [("origin", origin)]
    start, body = sent(*headers, **options)
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
    answers = {host: ask(host=host, to=door(host=bound))[0] for host in [*hosts, "evil.example"]}
    assert answers == dict.fromkeys(hosts, 200) | {"evil.example": 403}


@pytest.mark.parametrize(
    ("header", "wrong"),
    [("host", [
        "evil.example", "127.0.0.1.evil.example:80", "", "192.168.1.7", "evil.com\\@127.0.0.1",
        "evil.com@127.0.0.1", "127.0.0.1:80@evil.com", "127.0.0.1/evil.com", "127.0.0.1#evil.com",
        "127.0.0.1?evil.com", " 127.0.0.1", "127.0.0.1 evil.com", "127.0.0.1:", "127.0.0.1:x",
        "127.0.0.1\tevil.com", "[::1", "::1", "[::1]evil.com", "[::1%25evil.com]", "127.1",
        "127.0.0.1:80:80", "127.0.0.1,evil.com", "\u00b9\u00b27.0.0.1", "2130706433", "0x7f.1",
        "localhost.",
    ]),
     ("origin", [
        "http://evil.example", "http://127.0.0.1:81", "null", "", "http://localhost:80",
        "http://evil.com\\@127.0.0.1:80", "http://x@127.0.0.1:80", "ftp://127.0.0.1:80",
        "127.0.0.1:80", "http://127.0.0.1:80/", "http://127.0.0.1:80 evil",
    ])],
)  # fmt: skip
def test_other_names_and_other_pages_are_refused(header, wrong):
    for words in wrong:
        status, _, said = ask(**{header: words})
        assert (status, said.partition(":")[0]) == (403, header.title()), words


def test_a_page_of_the_studio_is_let_in_and_a_second_name_or_none_is_refused():
    assert ask(origin=f"http://{HOST}")[0] == 200
    own, evil, cookie = ("host", HOST), ("host", "evil.example"), ("cookie", COOKIE)
    for headers in ([own, evil, cookie], [evil, own, cookie], [cookie]):
        assert sent(*headers)[0]["status"] == 403


@pytest.mark.parametrize(
    ("query", "words"),
    [("", "A cookie is missing"), ("token=", "The token is wrong"), (f"token={TOKEN}x", "is wrong"),
     (f"token={TOKEN[:-1]}", "is wrong"), (f"token={TOKEN}&token=wrong", "is wrong"),
     ("token=%ff%00", "is wrong"), (f"TOKEN={TOKEN}", "is missing")],
)  # fmt: skip
def test_without_the_token_nobody_gets_in(query, words):
    status, headers, said = ask(cookie="", query=query)
    assert (status, said.count("\n"), words in said) == (403, 1, True)
    assert headers[b"cache-control"] == b"no-store"
    assert TOKEN not in said
    assert b"set-cookie" not in headers
    assert ask(query=query)[0] == (403 if "wrong" in words else 200)  # who has a cookie


def test_the_token_is_exchanged_for_a_cookie_of_a_new_session():
    status, headers, said = ask(cookie="", query=f"token={TOKEN}")
    assert status == 200
    assert 'content="0;url=/"' in said  # the browser goes on, without the token
    assert headers[b"referrer-policy"] == b"no-referrer"
    new, *others = headers[b"set-cookie"].decode().split("; ")
    assert TOKEN not in said + new
    assert {word.lower() for word in others} == {"path=/", "httponly", "samesite=strict"}
    assert ask(cookie=new)[2] == new.partition("=")[2].split(".")[0] != ask()[2]
    for wrong in (new + "x", new[:-1], new.replace(".", ""), f"{COOKIE_NAME}=.", TOKEN,
                  f"{COOKIE_NAME}={TOKEN}", new.replace("_80", "_81"), new + "\u00e9",
                  new_cookie(port=81).replace("_81", "_80"), new_cookie(TOKEN + "2")):  # fmt: skip
        assert ask(cookie=wrong)[0] == 403, wrong
    # Cookies of other servers of this machine are passed over.
    assert ask(cookie=f'a={{"x": [1, 2]}}; {COOKIE_NAME}=toss.ed; b; =c; {new}')[0] == 200


def test_a_cookie_is_kept_and_handed_out_for_the_page_only():
    query = f"token={TOKEN}"
    assert b"set-cookie" not in ask(query=query)[1]
    for other in {"method": "POST"}, {"path": "/scene/"}, {"path": "//evil.example/x"}:
        assert ask(cookie="", query=query, **other)[0] == 403


def test_websockets_need_the_cookie_and_a_page_of_the_studio():
    own, cookie, evil = ("host", HOST), ("cookie", COOKIE), ("origin", "http://evil.example")
    for headers in ([own], [own, cookie, evil]):
        assert sent(*headers, kind="websocket", query=f"token={TOKEN}") == REFUSED
    page = ("origin", f"http://{HOST}")
    assert sent(own, cookie, page, kind="websocket") == [{"type": "websocket.accept"}]


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
    await until(lambda: gc.collect() >= 0 and len(sessions._benches) == MOST_SESSIONS + 1, 30.0)
    assert await sessions.bench("0") is first


def test_a_workbench_that_cannot_be_made_is_said_and_none_is_made_without_a_cookie():
    async def gone(session):
        raise CdprError(f"robot.yaml: gone for {session}")

    to = door(bench=gone)
    status, _, said = ask(to=to)
    assert (status, said[:21]) == (500, "robot.yaml: gone for ")
    for refused in ({"cookie": ""}, {"host": "evil.com"}, {"query": "token=wrong"}):
        assert ask(to=to, **refused)[0] == 403
    assert ask(cookie="", query=f"token={TOKEN}", to=to)[0] == 200


UPGRADE = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
           "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA=="}  # fmt: skip


def test_nothing_of_a_server_is_open_to_who_has_no_cookie(studio):
    home, _, query = studio[1].partition("/?")
    socket = "/_nicegui_ws/socket.io/?EIO=4&transport="
    with httpx.Client(base_url=home, timeout=600.0) as client:
        client.get(f"/?{query}")
        page = client.get("/").text
        static = page[page.index("/_nicegui/") :].partition('"')[0]
        assert [client.get(path).status_code for path in (static, SCENE)] == [200, 200]
    assert '<html lang="en' in page  # programs that read pages aloud choose a voice by it
    for path in ("/", static, SCENE, f"{SCENE}meshcat.js", "/favicon.ico", "/nothing", "/docs",
                 f"{socket}polling", "/_nicegui/x"):  # fmt: skip
        for method in ("GET", "POST", "HEAD"):
            answer = httpx.request(method, home + path, timeout=600.0)
            assert (answer.status_code, answer.headers["cache-control"]) == (403, "no-store")
            assert answer.text.count("\n") == (method != "HEAD"), path
    for path in (f"{socket}websocket", SCENE):
        assert httpx.get(home + path, headers=UPGRADE, timeout=600.0).status_code == 403, path


@pytest.mark.parametrize(
    ("options", "variable", "words"),
    [("--no-token", TOKEN, "--no-token: found it with CDPR_STUDIO_TOKEN set"),
     ("", "", "CDPR_STUDIO_TOKEN: found an empty text"),
     ("", "short", "token: found 5 characters; accepted: 16 to 200"),
     ("", "with blanks inside it", "token: found 21 characters"),
     ("", "x" * 201, "token: found 201 characters"),
     ("", "a&token=bbbbbbbbbbbb", "token: found 20 characters"),
     ("", "é" * 20, "token: found 20 characters"),
     ("--no-token --host *", None, "--no-token: found it with --host *"),
     ("--no-token --host 192.0.2.1", None, "--no-token: found it with --host 192.0.2.1")],
)  # fmt: skip
def test_what_is_refused_at_the_start(tmp_path, monkeypatch, capsys, options, variable, words):
    if variable is not None:
        monkeypatch.setenv("CDPR_STUDIO_TOKEN", variable)
    with pytest.raises(SystemExit) as ended:
        main(["studio", "no_such", "--folder", str(tmp_path), *options.split()])
    assert ended.value.code == 2
    said = printed(capsys)
    assert f"\ncdpr: {words}" in f"\n{said.err}"
    assert TOKEN not in said.out + said.err


def test_a_token_that_is_set_is_not_printed(tmp_path, monkeypatch):
    monkeypatch.setenv("CDPR_STUDIO_TOKEN", TOKEN)
    with served(tmp_path) as (address, process):
        assert "token" not in address
        for query, status in ("", 403), (f"?token={TOKEN}", 200), (f"?token={TOKEN}x", 403):
            assert httpx.get(address + query, timeout=600.0).status_code == status
    assert TOKEN not in "".join(process.said)


@pytest.mark.parametrize("had_scene", [False, True])
async def test_a_browser_that_takes_no_more_of_a_scene_is_let_go(had_scene):
    piece, taken = bytes(1_000_000), []

    async def scene():
        for _ in range(200):
            taken.append(piece)
            yield piece
            await asyncio.sleep(0)

    async def send(_):
        if not had_scene or len(taken) > 3:
            await asyncio.Event().wait()

    await hand_on(scene(), send)
    most = MOST_BEHIND if had_scene else LARGEST_MESSAGE
    assert most < len(taken) * len(piece) < most + 5 * len(piece)


async def test_a_browser_gets_all_of_a_scene_in_order():
    got, pieces = [], [bytes([k]) for k in range(100)]

    async def scene():
        for piece in pieces:
            yield piece
            await asyncio.sleep(0)
        await until(lambda: len(got) == len(pieces))

    async def send(piece):
        got.append(piece)

    await hand_on(scene(), send)
    assert got == pieces
