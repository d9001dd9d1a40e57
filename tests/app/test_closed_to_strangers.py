"""The door of the workbench: who may come in, and how much may be brought."""

import asyncio
from typing import Any

import pytest

from undertow.app.server import COOKIE, ClosedToStrangers

HOST = "127.0.0.1:8423"


async def behind(scope: Any, receive: Any, send: Any) -> None:
    """What is behind the door: reads all that comes, and says that it was reached."""
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
        return
    while (await receive()).get("more_body"):
        pass
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"reached"})


def asked(
    door: ClosedToStrangers,
    headers: dict[str, str] | None = None,
    *,
    kind: str = "http",
    query: str = "",
    body: tuple[bytes, ...] = (b"",),
    told: bool = True,
) -> list[dict[str, Any]]:
    """The answers to one request."""
    pairs = [(name.encode(), value.encode()) for name, value in ({"host": HOST} | (headers or {})).items()]
    scope = {"type": kind, "method": "GET", "path": "/", "query_string": query.encode(), "headers": pairs}
    scope |= {"extensions": {"websocket.http.response": {}} if told else {}}
    parts, answers = list(body), []

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": parts.pop(0), "more_body": bool(parts)}

    async def send(message: Any) -> None:
        answers.append(dict(message))

    asyncio.run(door(scope, receive, send))
    return answers


def status(answers: list[dict[str, Any]]) -> int:
    """The status of an answer; 101 for a socket that was opened."""
    return 101 if answers[0]["type"] == "websocket.accept" else answers[0]["status"]


OPEN = ClosedToStrangers(behind, [HOST, "localhost:8423"])


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    ("headers", "let_in"),
    [
        ({}, True),
        ({"host": "localhost:8423"}, True),
        ({"host": "LOCALHOST:8423"}, True),
        ({"origin": f"http://{HOST}"}, True),
        ({"host": "evil.example:8423"}, False),
        ({"host": "127.0.0.1:9999"}, False),
        ({"host": ""}, False),
        ({"origin": "http://evil.example"}, False),
        ({"origin": "null"}, False),
        ({"origin": "http://127.0.0.1:9999"}, False),
        ({"origin": "http://localhost:8423.evil.example"}, False),
    ],
)
def test_only_its_own_pages_come_in(kind, headers, let_in):
    reached = 200 if kind == "http" else 101
    assert status(asked(OPEN, headers, kind=kind)) == (reached if let_in else 400)


def test_a_socket_is_closed_where_the_server_cannot_answer_it():
    answers = asked(OPEN, {"host": "evil.example"}, kind="websocket", told=False)
    assert answers == [{"type": "websocket.close", "code": 1008}]


def test_the_token_is_exchanged_for_a_cookie():
    door = ClosedToStrangers(behind, [HOST], token="secret-token")
    assert status(asked(door)) == 403
    assert status(asked(door, kind="websocket")) == 403
    assert status(asked(door, query="token=guess")) == 403
    first = asked(door, query="token=secret-token")
    headers = dict(first[0]["headers"])
    assert first[0]["status"] == 303
    assert headers[b"location"] == b"/"
    cookie = headers[b"set-cookie"].decode()
    assert "HttpOnly" in cookie
    assert "samesite=strict" in cookie.lower()
    brought = {"cookie": cookie.split(";")[0]}
    assert status(asked(door, brought)) == 200
    assert status(asked(door, brought, kind="websocket")) == 101
    assert status(asked(door, {"cookie": f"{COOKIE}=guess"})) == 403
    assert status(asked(door, brought | {"host": "evil.example"})) == 400


def test_an_upload_is_bounded_whether_it_says_its_size_or_not():
    door = ClosedToStrangers(behind, [HOST], most=100)
    assert status(asked(door, {"content-length": "101"})) == 413
    assert status(asked(door, body=(b"x" * 60, b"x" * 60))) == 413
    assert status(asked(door, body=(b"x" * 60, b"x" * 40))) == 200


def test_every_answer_forbids_other_pages_to_frame_it():
    headers = dict(asked(OPEN)[0]["headers"])
    assert headers[b"x-frame-options"] == b"DENY"
    assert headers[b"x-content-type-options"] == b"nosniff"
