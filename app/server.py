"""The server of the workbench: a socket on this machine, a door before it, and a session for every tab."""

import asyncio
import contextlib
import gc
import secrets
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator
from typing import Any

from ..physics.errors import RequestError
from ..workflows.workbench_facts import Source
from .closed_to_strangers import ClosedToStrangers
from .file_names import SESSION, fleet_in
from .worker import PrewarmedWorker

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
    spare = PrewarmedWorker(None if saved or fleet_in(first) else first)  # computes while the pages are loaded
    told(f"The workbench is at {address} (Ctrl-C ends it)")
    if browser:  # it is answered as soon as there is a page, and its window is there by then
        threading.Thread(target=_open, args=(address,), daemon=True).start()
    application = ClosedToStrangers(_application(first, spare, hosts, paths=not token), hosts, token)
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


def _application(first: Source | None, spare: PrewarmedWorker, hosts: list[str], *, paths: bool) -> Any:
    """The pages and their sockets."""
    with _as_if_absent(*_OF_CLIENTS):
        from nicegui import Client, core, ui
        from nicegui import app as nicegui_app
    from fastapi import FastAPI

    from ..physics.vehicle import load_vehicle, shipped_vehicles
    from .bench_page import Page
    from .session import Session
    from .views.words import in_a_line

    vehicles = {name: in_a_line(load_vehicle(name)) for name in shipped_vehicles()}
    sessions: dict[str, Session] = {}

    def made() -> Session:
        """A session with its page."""
        session = Session(spare, paths=paths)
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
        if fresh is not None and tab not in sessions:
            sessions[tab] = fresh
        elif tab not in sessions:
            sessions[tab] = made()
        else:
            Page(sessions[tab], vehicles, first, paths=paths)
        session = sessions[tab]

        def left() -> None:
            """End the session when no page of its tab is open any more."""
            others = [one for one in Client.instances.values() if one is not client and one.tab_id == tab]
            if not others and sessions.pop(tab, None) is session:
                session.close()
                # A page is a cycle of objects, with the arrays that it shows.
                asyncio.get_running_loop().call_later(_TIDY, gc.collect)

        client.on_delete(left)

    def end() -> None:
        spare.close()
        for session in sessions.values():
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
