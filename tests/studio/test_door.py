"""Who gets in: names of this machine, pages of the studio, holders of a cookie."""

import asyncio
import gc

import httpx
import pytest

from cdpr_drake.errors import CdprError
from cdpr_drake.studio.door import BENCH, MOST_SESSIONS, Door, Sessions
from cdpr_drake.studio.page import SCENE
from cdpr_drake.studio.panel import PANELS
from cdpr_drake.studio.server import LARGEST_MESSAGE, MOST_BEHIND, hand_on
from tests.cli.commands import run
from tests.studio.pages import until
from tests.studio.served import served

TOKEN = "secret-token-of-a-test"
PASS = f"token={TOKEN}"
HOST, NAME = "127.0.0.1:80", "cdpr_studio_80"


async def inside(scope, receive, send):
    await send({"status": 200})
    await send({"body": scope[BENCH].encode()})


async def bench(session):
    return session


def door(token=TOKEN, port=80, host="127.0.0.1", bench=bench):
    return Door(inside, host, token, port, bench)


def ask(
    to=None, *, kind="http", host=HOST, cookie=None, origin=(), query="", path="/", method="GET"
):
    """Status, headers and body of an answer, or the message that closes a WebSocket."""
    told = {"host": host, "cookie": COOKIE if cookie is None else cookie, "origin": origin}
    headers = [
        (name.encode(), value.encode("latin-1"))
        for name, values in told.items()
        for value in ([values] if isinstance(values, str) else values)
    ]
    scope = {"type": kind, "path": path, "query_string": query.encode(), "method": method,
             "headers": headers}  # fmt: skip
    messages = []

    async def send(message):
        messages.append(message)

    asyncio.run((to or door())(scope, None, send))
    start, *rest = messages
    words = b"".join(one["body"] for one in rest).decode()
    return start.get("status", start), dict(start.get("headers", ())), words


def new_cookie(token=TOKEN, port=80):
    """A cookie of such a door, as a browser sends it back."""
    headers = ask(door(token, port), cookie="", query=f"token={token}")[1]
    return headers[b"set-cookie"].decode().partition(";")[0]


COOKIE = new_cookie()


@pytest.mark.parametrize(
    ("bound", "hosts"),
    [("127.0.0.1", ["127.0.0.1:80", "localhost:80", "[::1]:80", "LOCALHOST"]),
     ("*", ["127.0.0.1:80", "192.168.1.7:80", "[fe80::1]:80"]),
     ("Studio.example", ["studio.example:80", "10.0.0.1"])],
)  # fmt: skip
def test_names_of_this_machine(bound, hosts):
    answers = {host: ask(door(host=bound), host=host)[0] for host in [*hosts, "evil.example"]}
    assert answers == dict.fromkeys(hosts, 200) | {"evil.example": 403}


WRONG = {
    "Host: found": [{"host": host} for host in (
        "evil.example", "127.0.0.1.evil.example:80", "", "192.168.1.7", "evil.com\\@127.0.0.1",
        "evil.com@127.0.0.1", "127.0.0.1:80@evil.com", "127.0.0.1/evil.com", "127.0.0.1#evil.com",
        "127.0.0.1?evil.com", " 127.0.0.1", "127.0.0.1 evil.com", "127.0.0.1:", "127.0.0.1:x",
        "127.0.0.1\tevil.com", "[::1", "::1", "[::1]evil.com", "[::1%25evil.com]", "127.1",
        "127.0.0.1:80:80", "127.0.0.1,evil.com", "\u00b9\u00b27.0.0.1", "2130706433", "0x7f.1",
        "localhost.", [], [HOST, "evil.example"], ["evil.example", HOST],
    )],
    "Origin: found": [{"origin": origin} for origin in (
        "http://evil.example", "http://127.0.0.1:81", "null", "", "http://localhost:80",
        "http://evil.com\\@127.0.0.1:80", "http://x@127.0.0.1:80", "ftp://127.0.0.1:80",
        "127.0.0.1:80", "http://127.0.0.1:80/", "http://127.0.0.1:80 evil",
    )],
    "A cookie is missing": [{"cookie": cookie} for cookie in (
        "", COOKIE + "x", COOKIE[:-1], COOKIE.replace(".", ""), f"{NAME}=.", TOKEN,
        f"{NAME}={TOKEN}", COOKIE.replace("_80", "_81"), COOKIE + "\u00e9",
        new_cookie(port=81).replace("_81", "_80"), new_cookie(TOKEN + "2"),
    )] + [{"cookie": "", "query": PASS} | other for other in (
        {"query": f"TOKEN={TOKEN}"}, {"method": "POST"}, {"path": "/scene/"},
        {"path": "//evil.example/x"},
    )],
    "The token is wrong": [{"query": query, "cookie": cookie} for query in (
        "token=", f"{PASS}x", PASS[:-1], f"{PASS}&token=wrong", "token=%ff%00",
    ) for cookie in ("", COOKIE)],
}  # fmt: skip


@pytest.mark.parametrize("words", WRONG)
def test_what_is_wrong_is_refused_in_a_line(words):
    for asked in WRONG[words]:
        status, headers, said = ask(**asked)
        assert (status, said.count("\n"), words in said) == (403, 1, True), asked
        assert (headers[b"cache-control"], b"set-cookie" in headers) == (b"no-store", False)
        assert TOKEN not in said


def test_the_token_is_exchanged_for_a_cookie_of_a_new_session():
    status, headers, said = ask(cookie="", query=PASS)
    assert status == 200
    assert 'content="0;url=/"' in said  # the browser goes on, without the token
    assert headers[b"referrer-policy"] == b"no-referrer"
    new, *others = headers[b"set-cookie"].decode().split("; ")
    assert TOKEN not in said + new
    assert {word.lower() for word in others} == {"path=/", "httponly", "samesite=strict"}
    assert ask(cookie=new)[2] == new.partition("=")[2].split(".")[0] != ask()[2]
    assert b"set-cookie" not in ask(query=PASS)[1]  # who has one keeps it
    # Cookies of other servers of this machine are passed over.
    assert ask(cookie=f'a={{"x": [1, 2]}}; {NAME}=toss.ed; b; =c; {new}')[0] == 200


def test_pages_of_the_studio_are_let_in_and_their_websockets():
    page, closed = f"http://{HOST}", {"type": "websocket.close", "code": 1008}
    assert ask(origin=page)[0] == ask(kind="websocket", origin=page)[0] == 200
    for wrong in {"cookie": ""}, {"origin": "http://evil.example"}:
        assert ask(kind="websocket", query=PASS, **wrong)[0] == closed


def test_without_a_token_sessions_are_told_by_cookies_all_the_same():
    to = door("")
    status, headers, said = ask(to, cookie="")
    assert (status, 'url=/?cookie=set"' in said) == (200, True)
    new = headers[b"set-cookie"].decode().partition(";")[0]
    assert ask(to, cookie=new)[0] == ask(to, cookie="", query="token=")[0] == 200
    assert ask(to, cookie="", query="cookie=set")[0] == 403
    for wrong in ("", f"{NAME}=x.y", COOKIE):
        assert ask(to, cookie=wrong, path="/scene/")[0] == 403


def test_a_workbench_that_cannot_be_made_is_said_and_none_is_made_without_a_cookie():
    async def gone(session):
        raise CdprError(f"robot.yaml: gone for {session}")

    status, _, said = ask(door(bench=gone))
    assert (status, said[:21]) == (500, "robot.yaml: gone for ")
    for wrong in {"cookie": ""}, {"host": "evil.com"}, {"query": "token=wrong"}:
        assert ask(door(bench=gone), **wrong)[0] == 403
    assert ask(door(bench=gone), cookie="", query=PASS)[0] == 200


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


UPGRADE = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
           "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA=="}  # fmt: skip


def test_a_server_gives_the_page_with_a_panel_and_nothing_to_who_has_no_cookie(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("CDPR_STUDIO_TOKEN", TOKEN)
    socket = "_nicegui_ws/socket.io/?EIO=4&transport="
    with served(tmp_path) as (home, process), httpx.Client(timeout=600.0) as client:
        for query, status in (f"?{PASS}x", 403), (f"?{PASS}", 200):
            assert client.get(home + query).status_code == status
        page = client.get(home).text
        static = page[page.index("/_nicegui/") + 1 :].partition('"')[0]
        assert [client.get(home + path).status_code for path in (static, SCENE[1:])] == [200, 200]
        client.cookies.clear()
        for path in ("", static, SCENE[1:], f"{SCENE[1:]}meshcat.js", "favicon.ico", "nothing",
                     "docs", f"{socket}polling", "_nicegui/x"):  # fmt: skip
            for method in ("GET", "POST", "HEAD"):
                answer = client.request(method, home + path)
                assert (answer.status_code, answer.headers["cache-control"]) == (403, "no-store")
                assert answer.text.count("\n") == (method != "HEAD"), path
        for path in (f"{socket}websocket", SCENE[1:]):
            answer = httpx.get(home + path, headers=UPGRADE, timeout=600.0)
            assert answer.status_code == 403, path
    assert '<html lang="en' in page  # programs that read pages aloud choose a voice by it
    assert "exit point" in page
    waiting = [panel.title for panel in PANELS.values() if f"{panel.title}: loading" in page]
    assert waiting == ["Pose", "Workspace", "Run", "Logs", "Studies", "Commands"]
    assert TOKEN not in "".join(process.said)  # it was set


@pytest.mark.parametrize(
    ("options", "variable", "words"),
    [("--no-token", TOKEN, "--no-token: found it with CDPR_STUDIO_TOKEN set"),
     ("", "", "CDPR_STUDIO_TOKEN: found an empty text"),
     ("", "short", "token: found 5 characters; accepted: 16 to 200"),
     ("", "x" * 201, "token: found 201 characters"),
     ("", "a&token=bbbbbbbbbbbb", "token: found 20 characters"),
     ("", "é" * 20, "token: found 20 characters"),
     ("--no-token --host *", None, "--no-token: found it with --host *"),
     ("--no-token --host 192.0.2.1", None, "--no-token: found it with --host 192.0.2.1")],
)  # fmt: skip
def test_what_is_refused_at_the_start(tmp_path, monkeypatch, capsys, options, variable, words):
    if variable is not None:
        monkeypatch.setenv("CDPR_STUDIO_TOKEN", variable)
    code, out, err = run(capsys, "studio", "no_such", "--folder", tmp_path, *options.split())
    assert (code, f"\ncdpr: {words}" in f"\n{err}", TOKEN in out + err) == (2, True, False)


PIECE = 1_000_000


@pytest.mark.parametrize(
    ("stops", "behind"), [(0, LARGEST_MESSAGE // PIECE), (3, MOST_BEHIND // PIECE), (200, -1)]
)
async def test_a_browser_gets_a_scene_in_order_until_it_takes_no_more_of_it(stops, behind):
    taken, got = [], []

    async def scene():
        for number in range(200):
            taken.append(number)
            yield bytes([number]) * PIECE
            await asyncio.sleep(0)
        await until(lambda: got == taken)

    async def send(piece):
        if len(got) == stops:
            await asyncio.Event().wait()
        got.append(piece[0])

    await hand_on(scene(), send)
    assert got == taken[:stops]
    assert behind < len(taken) - stops < behind + 5
