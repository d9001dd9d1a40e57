"""The verb `app`: the workbench in the browser."""

from pathlib import Path
from typing import Annotated

import typer

from .console import say
from .options import AsIsOption, FrameOption, MapOption


def app(
    logs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[LOG...]", help="Logs to open at once, a saved session, or the folder of a fleet."),
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option("--vehicle", "-v", help="Vehicle file, or a shipped one; default: made of the log.")
    ] = None,
    port: Annotated[int | None, typer.Option("--port", min=1, max=65535, help="Port; default: the first free.")] = None,
    host: Annotated[
        str, typer.Option("--host", help="Address; any that other machines reach asks for a token.")
    ] = "127.0.0.1",
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open a browser.")] = False,
    frame: FrameOption = None,
    channels: MapOption = None,
    as_is: AsIsOption = False,
) -> None:
    """Do the whole job with the mouse: see where the model fails, add what is missing, watch the error fall."""
    from importlib.util import find_spec

    from ..physics.errors import RequestError
    from ..physics.registry_members import how_to_install

    if find_spec("nicegui") is None:
        raise RequestError(f"app: the workbench needs NiceGUI: {how_to_install('app')}")
    from ..app import worker

    worker.prepare()  # what computes is loaded while the page is
    from ..app.server import serve
    from ..workflows.workbench_facts import Source

    if vehicle is not None and not logs:
        raise RequestError("app: a vehicle is given and no log; give the log, too, or open both on the page")
    first = None
    if logs:
        paths = tuple(str(path.absolute()) for path in logs)
        there = str(Path(vehicle).absolute()) if vehicle and Path(vehicle).exists() else (vehicle or "")
        mapped = "" if channels is None else str(channels.absolute())
        first = Source(paths, there, channel_map=mapped, frame=frame or "", as_is=as_is)
    serve(first, host=host, port=port, browser=not no_browser, told=say)
