"""The server of the workbench: a socket on this machine, a door before it, and a session for every tab.

Only pages that it served itself, from the address that it was bound to, may come in.
"""

import asyncio
import contextlib
import gc
import secrets
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from typing import Any
from urllib.parse import urlsplit

from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ..physics.errors import RequestError
from ..workflows.workbench_facts import Source
from .session import Session
from .steps import MOST_UPLOADED, SESSION, fleet_in

COOKIE = "undertow"
_ENTRY = "token"
"""Name of the token in the address that the command line prints."""


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

    def __init__(self, app: ASGIApp, hosts: Sequence[str], token: str = "", most: int = MOST_UPLOADED) -> None:
        self._app, self._token, self._most = app, token, most
        self._hosts = {host.lower() for host in hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See the class."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        asked = HTTPConnection(scope)
        origin, said = asked.headers.get("origin"), asked.headers.get("content-length", "0")
        status, why = 0, ""
        if [host.lower() in self._hosts for host in asked.headers.getlist("host")] != [True]:
            status, why = 400, "this is not the address under which undertow serves"
        elif origin is not None and urlsplit(origin).netloc.lower() not in self._hosts:
            status, why = 400, "another page may not ask for this"
        elif self._token and not self._is_token(asked.cookies.get(COOKIE, "")):
            status, why = 403, "open the whole address that 'undertow app' printed, with its token"
            first = scope["type"] == "http" and scope["method"] == "GET" and scope["path"] == "/"
            if first and self._is_token(asked.query_params.get(_ENTRY, "")):
                answer = RedirectResponse("/", 303, {"referrer-policy": "no-referrer"})
                answer.set_cookie(COOKIE, self._token, httponly=True, samesite="strict")
                await answer(scope, receive, send)
                return
        elif not said.isdigit() or int(said) > self._most:
            status, why = 413, _too_large(self._most)
        if status:
            await _refuse(scope, receive, send, status, why)
        else:
            await self._within(scope, receive, send)

    def _is_token(self, given: str) -> bool:
        return secrets.compare_digest(given.encode(), self._token.encode())

    async def _within(self, scope: Scope, receive: Receive, send: Send) -> None:
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
            if message["type"] == "http.response.start":
                begun = True
                message = {**message, "headers": [*message.get("headers", []), *_GUARDED]}
            await send(message)

        try:
            await self._app(scope, counted, told)
        except TooLargeError:
            if not begun:
                await _refuse(scope, receive, send, 413, _too_large(self._most))


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


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, why: str) -> None:
    """An answer of one line; a socket gets it in the place of the handshake where the server can say it."""
    if scope["type"] == "websocket" and "websocket.http.response" not in (scope.get("extensions") or {}):
        await send({"type": "websocket.close", "code": 1008})
        return
    await PlainTextResponse(f"{why}\n", status)(scope, receive, send)


PORT, _TRIED = 8423, 20
"""The first port that is tried where none is asked for, and how many after it."""
RECONNECT = 60.0
"""Seconds for which a page that lost its connection, or is loaded again, finds its work as it was."""
_TIDY = 1.0
"""Seconds after the end of a session when what it held is given back."""
_OF_CLIENTS = ("aiohttp", "requests", "tornado")
"""Packages that engineio loads, where they are, for what a server like this never is; they take a third of a second."""
HERE = ("127.0.0.1", "localhost", "::1")
"""Addresses that only this machine reaches."""


def listen(host: str, port: int | None) -> socket.socket:
    """A socket that listens, on a free port where none is asked for.

    Raises
    ------
    RequestError
        when the port is taken, or the address is none of this machine.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    asked = range(PORT, PORT + _TRIED) if port is None else (port,)
    why = ""
    for one in asked:
        try:
            return socket.create_server((host, one), family=family)
        except OSError as error:
            why = error.strerror or str(error)
    place = f"{host}:{port}" if port is not None else f"{host}, ports {PORT} to {PORT + _TRIED - 1}"
    raise RequestError(f"app: cannot listen on {place}: {why}; give another with --port or --host")


def serve(
    first: Source | None,
    *,
    host: str = HERE[0],
    port: int | None = None,
    browser: bool = True,
    told: Callable[[str], None] = print,
) -> None:
    """Serve until the process is interrupted.

    Parameters
    ----------
    first : opened in every new tab; None for the page that asks
    host : an address; any but those of this machine asks for a token
    browser : open a browser
    told : called with the address
    """
    listening = listen(host, port)
    bound: int = listening.getsockname()[1]
    token = "" if host in HERE else secrets.token_urlsafe(24)
    hosts = _names(host, bound)
    address = f"http://{f'[{host}]' if ':' in host else host}:{bound}/" + (f"?token={token}" if token else "")
    saved = first is not None and any(path.lower().endswith(SESSION) for path in first.logs)
    ahead = None if saved or fleet_in(first) else first
    session = Session(paths=not token)
    session.errands.read_ahead(ahead or Source(), session.folder)  # while the pages are loaded
    told(f"The workbench is at {address} (Ctrl-C ends it)")
    if browser:  # it is answered as soon as there is a page, and its window is there by then
        threading.Thread(target=_open, args=(address,), daemon=True).start()
    application = ClosedToStrangers(_application(first, session, hosts, paths=not token), hosts, token)
    import uvicorn

    config = uvicorn.Config(application, log_level="warning", ws_max_size=64 * 1024**2, timeout_graceful_shutdown=2)
    uvicorn.Server(config).run(sockets=[listening])


def _open(address: str) -> None:
    with contextlib.suppress(webbrowser.Error):
        webbrowser.open(address)


def _names(host: str, port: int) -> list[str]:
    """What may stand as the host of a request."""
    names = ["127.0.0.1", "localhost", "[::1]"]
    if host in ("0.0.0.0", "::"):
        names += [socket.gethostname(), *_own_addresses()]
    elif host not in HERE:
        names.append(f"[{host}]" if ":" in host else host)
    return [f"{name}:{port}" for name in names]


def _own_addresses() -> list[str]:
    with contextlib.suppress(OSError):
        return sorted({str(found[4][0]) for found in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)})
    return []


@contextlib.contextmanager
def _as_if_absent(*names: str) -> Iterator[None]:
    """Packages that are not found by what is imported meanwhile, unless they are loaded already."""
    hidden = dict.fromkeys(set(names) - sys.modules.keys())
    sys.modules.update(hidden)  # type: ignore[arg-type]  # None: an import raises ImportError (importlib's reference)
    try:
        yield
    finally:
        for name in hidden:
            del sys.modules[name]


def _application(first: Source | None, begun: Session | None, hosts: list[str], *, paths: bool) -> Any:
    """The pages and their sockets; the first tab works on a session that is begun already."""
    with _as_if_absent(*_OF_CLIENTS):
        from nicegui import Client, core, ui
        from nicegui import app as nicegui_app
    from fastapi import FastAPI

    from ..physics.vehicle import load_vehicle, shipped_vehicles
    from .bench_page import Page
    from .views.words import in_a_line

    vehicles = {name: in_a_line(load_vehicle(name)) for name in shipped_vehicles()}
    sessions: dict[str, Session] = {}
    unused = [] if begun is None else [begun]

    def made() -> Session:
        """A session with its page."""
        session = unused.pop() if unused else Session(paths=paths)
        Page(session, vehicles, first, paths=paths)
        return session

    @ui.page("/", title="undertow")
    async def bench(client: Client) -> None:
        fresh = None if sessions else made()  # the first page of all needs not wait for its socket
        await client.connected()
        tab = str(client.tab_id)
        if client.is_deleted:
            if fresh is not None:
                fresh.close()
            return
        if tab not in sessions:
            sessions[tab] = fresh or made()
        else:
            Page(sessions[tab], vehicles, first, paths=paths)
        session = sessions[tab]

        def left() -> None:
            """End the session when no page of its tab is open any more."""
            others = any(one is not client and one.tab_id == tab for one in Client.instances.values())
            if not others and sessions.pop(tab, None) is session:
                session.close()
                # A page is a cycle of objects, with the arrays that it shows.
                asyncio.get_running_loop().call_later(_TIDY, gc.collect)

        client.on_delete(left)

    def end() -> None:
        for session in (*unused, *sessions.values()):
            session.close()
        sessions.clear()

    nicegui_app.on_shutdown(end)
    application = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    ui.run_with(
        application,
        title="undertow",
        tailwind=False,
        reconnect_timeout=RECONNECT,
        show_welcome_message=False,
        gzip_middleware_factory=None,
    )
    core.sio.eio.cors_allowed_origins = [f"http://{name}" for name in hosts]  # by default any page may connect
    return application
