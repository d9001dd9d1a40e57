"""The door of the workbench: only pages that it served itself, from the address that it was bound to, may come in."""

import secrets
from collections.abc import Awaitable, Callable, MutableMapping, Sequence
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]

COOKIE = "undertow"
_ENTRY = "token"
"""Name of the token in the address that the command line prints."""
MOST_UPLOADED = 2 * 1024**3
"""Bytes of an upload at most: an hour of a dense bag; what is larger is opened by its path."""


class TooLargeError(Exception):
    """A body grew beyond what may be uploaded."""


class ClosedToStrangers:
    """An ASGI application behind its door.

    A foreign `Host` (a name that a stranger let point here) and a foreign `Origin` (another page in the same browser)
    get 400, on pages and on sockets. With a token, who comes without it gets 403; the address with the token is
    exchanged for a cookie, so that the token stands in no other address.

    Parameters
    ----------
    app : what is behind it
    hosts : names with ports under which it may be asked for
    token : asked of everybody; empty for an address that only this machine reaches
    most : bytes of an upload
    """

    def __init__(self, app: App, hosts: Sequence[str], token: str = "", most: int = MOST_UPLOADED) -> None:
        self._app, self._token, self._most = app, token, most
        self._hosts = {host.lower() for host in hosts}

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """See the class."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        alone = sum(name.lower() == b"host" for name, _ in scope["headers"]) == 1
        if not alone or headers["host"].lower() not in self._hosts:
            await _refuse(scope, send, 400, "this is not the address under which undertow serves")
            return
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc.lower() not in self._hosts:
            await _refuse(scope, send, 400, "another page may not ask for this")
            return
        if self._token and not self._knows(headers.get("cookie", "")):
            await self._exchange(scope, send)
            return
        said = headers.get("content-length", "0")
        if not said.isdigit() or int(said) > self._most:
            await _refuse(scope, send, 413, _too_large(self._most))
            return
        await self._within(scope, receive, send)

    def _knows(self, cookies: str) -> bool:
        """True when the cookie is that of the token."""
        jar = SimpleCookie()
        try:
            jar.load(cookies)
        except CookieError:
            return False
        return COOKIE in jar and secrets.compare_digest(jar[COOKIE].value.encode(), self._token.encode())

    async def _exchange(self, scope: Message, send: Send) -> None:
        """A cookie for who brings the token in the address; nothing for anybody else."""
        given = parse_qs(scope.get("query_string", b"").decode("latin-1")).get(_ENTRY, [""])[0]
        right = secrets.compare_digest(given.encode(), self._token.encode())
        if scope["type"] == "http" and scope["method"] == "GET" and scope["path"] == "/" and right:
            cookie = f"{COOKIE}={self._token}; Path=/; HttpOnly; SameSite=Strict"
            headers = [(b"location", b"/"), (b"set-cookie", cookie.encode()), (b"referrer-policy", b"no-referrer")]
            await send({"type": "http.response.start", "status": 303, "headers": headers})
            await send({"type": "http.response.body", "body": b""})
            return
        await _refuse(scope, send, 403, "open the whole address that 'undertow app' printed, with its token")

    async def _within(self, scope: Message, receive: Receive, send: Send) -> None:
        """Let it in, and count what it brings, for not every body says how large it is."""
        came, begun = 0, False

        async def counted() -> Message:
            nonlocal came
            message = await receive()
            if message["type"] == "http.request":
                came += len(message.get("body", b""))
                if came > self._most:
                    raise TooLargeError
            return message

        async def told(message: Message) -> None:
            nonlocal begun
            begun = begun or message["type"] == "http.response.start"
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", []), *_GUARDED]}
            await send(message)

        try:
            await self._app(scope, counted, told)
        except TooLargeError:
            if not begun:
                await _refuse(scope, send, 413, _too_large(self._most))


_GUARDED = (
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
)
"""What every answer says: no other page may frame it, read it, or learn where it was."""


def _too_large(most: int) -> str:
    return f"more than {most // 1024**2} MB cannot be uploaded; open the file by its path instead"


async def _refuse(scope: Message, send: Send, status: int, why: str) -> None:
    """An answer of one line; a socket gets it in the place of the handshake where the server can say it."""
    kind, body = "http.response", f"{why}\n".encode()
    if scope["type"] == "websocket":
        if "websocket.http.response" not in (scope.get("extensions") or {}):
            await send({"type": "websocket.close", "code": 1008})
            return
        kind = "websocket.http.response"
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(body)).encode())]
    await send({"type": f"{kind}.start", "status": status, "headers": headers})
    await send({"type": f"{kind}.body", "body": body})
