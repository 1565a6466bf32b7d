"""Who gets in: names of this machine, pages of the studio, holders of the token."""

import asyncio

import pytest

from cdpr_drake.studio.guard import Guard

TOKEN = "secret-token"


async def inside(scope, receive, send):
    await send({"type": "http.response.start", "status": 200, "headers": []})


def ask(host="127.0.0.1:80", *, bound="127.0.0.1", token="", query="", path="/", **headers):
    sent = []

    async def send(message):
        sent.append(message)

    named = {"host": host, **headers}
    scope = {
        "type": "http", "path": path, "query_string": query.encode(),
        "headers": [(k.replace("_", "-").encode(), v.encode()) for k, v in named.items()],
    }  # fmt: skip
    asyncio.run(Guard(inside, bound, 80, token)(scope, None, send))
    return sent[0]["status"], dict(sent[0]["headers"])


@pytest.mark.parametrize("host", ["127.0.0.1:80", "localhost:80", "[::1]:80", "LOCALHOST"])
def test_names_of_this_machine(host):
    assert ask(host)[0] == 200


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example:80", "", "192.168.1.7"])
def test_other_names_are_refused_on_loopback(host):
    assert ask(host)[0] == 403


def test_other_pages_are_refused():
    assert ask(origin="http://127.0.0.1:80")[0] == 200
    assert ask(origin="http://evil.example")[0] == 403
    assert ask(origin="http://127.0.0.1:81")[0] == 403
    assert ask(origin="null")[0] == 403


def test_a_token_is_asked_for_once():
    assert ask("192.168.1.7:80", bound="*", token=TOKEN)[0] == 403
    assert ask("192.168.1.7:80", bound="*", token=TOKEN, query="token=wrong")[0] == 403
    status, headers = ask("192.168.1.7:80", bound="*", token=TOKEN, query=f"a=1&token={TOKEN}")
    assert status == 303
    assert headers[b"location"] == b"/?a=1"
    cookie = headers[b"set-cookie"].decode()
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    given = cookie.partition(";")[0]
    assert ask("192.168.1.7:80", bound="*", token=TOKEN, cookie=given)[0] == 200
    assert ask("192.168.1.7:80", bound="*", token=TOKEN, cookie=given + "x")[0] == 403
    assert ask("evil.example", bound="*", token=TOKEN, cookie=given)[0] == 403


def test_the_way_back_stays_on_this_machine():
    _, headers = ask(bound="*", token=TOKEN, query=f"token={TOKEN}", path="//evil.example/x")
    assert headers[b"location"] == b"/evil.example/x"


def test_a_websocket_of_another_page_is_closed():
    sent = []

    async def send(message):
        sent.append(message)

    scope = {
        "type": "websocket", "path": "/scene/", "query_string": b"",
        "headers": [(b"host", b"127.0.0.1:80"), (b"origin", b"http://evil.example")],
    }  # fmt: skip
    asyncio.run(Guard(inside, "127.0.0.1", 80)(scope, None, send))
    assert sent == [{"type": "websocket.close", "code": 1008}]
