"""Token, cookies and sessions before the page itself: nothing is made for who has no cookie."""

import http.client
from contextlib import asynccontextmanager
from urllib.parse import urlsplit

import httpx
import pytest
from nicegui import core
from nicegui.testing.user_simulation import user_simulation

from cdpr_drake.cli.app import main
from cdpr_drake.studio.calculator import Calculator
from cdpr_drake.studio.entrance import Entrance
from cdpr_drake.studio.page import make_page
from cdpr_drake.studio.scene_relay import SCENE
from cdpr_drake.studio.server import _put_before_all
from cdpr_drake.studio.session import Workbench
from cdpr_drake.studio.sessions import Sessions
from cdpr_drake.studio.workbench.working_folder import WorkingFolder
from tests.messages import printed
from tests.studio.served import served

TOKEN = "secret-token-of-a-test"
REQUESTS = 10


@asynccontextmanager
async def guarded(folder):
    """What asks the application behind the guard, and its sessions."""
    calculator = Calculator()
    sessions = Sessions(lambda: Workbench(WorkingFolder(folder), calculator=calculator))
    try:
        async with user_simulation(make_page(sessions)):
            _put_before_all("127.0.0.1", Entrance(TOKEN, 80), sessions)
            transport = httpx.ASGITransport(core.app)
            async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as web:
                yield web, sessions
    finally:
        # The application is one for all tests of a process; theirs have no guard.
        vars(core.app).pop("build_middleware_stack", None)
        core.app.middleware_stack = None
        calculator.close()


async def test_no_workbench_without_a_cookie_and_one_for_each(tmp_path):
    async with guarded(tmp_path) as (web, sessions):
        known = len(core.app.storage._users)
        for _ in range(REQUESTS):
            web.cookies.clear()
            assert (await web.get("/")).status_code == 403
            web.cookies.clear()
            assert (await web.get("/", params={"token": "wrong"})).status_code == 403
            web.cookies.clear()
            opened = await web.get("/", params={"token": TOKEN})
            assert opened.status_code == 200
        assert sessions.benches() == []
        assert len(core.app.storage._users) == known
        for _ in range(3):
            answer = await web.get("/")
            assert "cdpr studio" in answer.text
        assert len(sessions.benches()) == 1
        del web.cookies["cdpr_studio_80"]  # NiceGUI's own cookie is not enough
        assert (await web.get("/")).status_code == 403
        web.cookies.clear()
        await web.get("/", params={"token": TOKEN})
        await web.get("/")
        assert len(sessions.benches()) == 2


def answer(address, path, headers=(), method="GET"):
    """Status and body of a plain request, without any cookie."""
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
            status, body, _ = answer(address, path, method=method)
            assert status == 403, (path, method)
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
        assert answer(address, "/")[0] == 403
        assert answer(address, f"/?token={TOKEN}")[0] == 200
        assert answer(address, f"/?token={TOKEN}x")[0] == 403
        process.terminate()
        said = process.stdout.read()
    assert TOKEN not in said
