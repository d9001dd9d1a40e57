"""The verb `app`: the workbench in the browser."""

from pathlib import Path

from .console import say
from .options import AS_IS, CHANNEL_MAP, FRAME, argument, option


def app(
    logs: list[Path] | None = argument(
        "[LOG...]", "Logs to open at once, a saved session, or the folder of a fleet.", None
    ),
    vehicle: str | None = option("--vehicle -v", "Vehicle file, or a shipped one; default: made of the log."),
    port: int | None = option("--port", "Port; default: the first free.", min=1, max=65535),
    host: str = option("--host", "Address; any that other machines reach asks for a token.", "127.0.0.1"),
    no_browser: bool = option("--no-browser", "Do not open a browser.", False),
    frame: str | None = FRAME,
    channels: Path | None = CHANNEL_MAP,
    as_is: bool = AS_IS,
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
