"""The registry of verbs: what `undertow` offers on the command line."""

import os
import sys

if __name__ == "__main__" or sys.argv[0].endswith(("undertow", "undertow.exe")):  # not when it is imported
    from .cli.interruption import listen
    from .physics.stage import collect_seldom

    listen()  # before anything else: what follows takes a second, in which Ctrl-C is pressed too
    collect_seldom()
    # NumPy is told before it is loaded: its threads wait for each other at full speed where matrices are small.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from typing import Annotated

import typer

from .cli.adapt_verb import adapt
from .cli.add_verb import add, catalogue
from .cli.app_verb import app as workbench
from .cli.check_verb import check
from .cli.ci_verb import ci
from .cli.cluster_verb import cluster
from .cli.compare_verb import compare
from .cli.console import Verbs, check_here, open_streams, say, sending
from .cli.control_verb import control
from .cli.demo_verb import demo
from .cli.diary_verb import diary
from .cli.discover_verb import discover
from .cli.effects_verb import effects
from .cli.explain_verb import explain
from .cli.export_verb import export, formats
from .cli.fit_verb import fit
from .cli.fleet_verb import fleet
from .cli.init_verb import init
from .cli.inspect_verb import inspect
from .cli.merge_verb import merge
from .cli.options import below, telling
from .cli.plan_verb import plan
from .cli.report_verb import report
from .cli.simulate_verb import amounts, simulate
from .cli.train_verb import train

app = typer.Typer(
    name="undertow",
    cls=Verbs,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["--help", "-h"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        say(f"undertow {version('undertow')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    """Find the physics your boat model is missing."""


FROM_LOGS = (demo, init, inspect, compare, check, ci, discover, fit, add, adapt, train, workbench)
OF_FLEETS = (fleet, diary, merge, cluster)
for verb in (*FROM_LOGS, *OF_FLEETS, plan, explain, effects, simulate, control, report, export):
    more = {add: catalogue, simulate: amounts, control: amounts, export: formats}.get(verb)
    app.command(epilog=below(verb.__name__, *([more()] if more else [])))(telling(verb))


def main() -> None:
    """Run the command line; exit code 0 done, 1 a check found violations, 2 wrong usage or unreadable input.

    130 when interrupted (Ctrl-C), 143 when terminated.
    """
    from .cli.interruption import finish

    open_streams()
    check_here()
    try:
        with sending():
            app()
    except SystemExit as end:
        if end.code is None or isinstance(end.code, int):
            finish(end.code or 0)
        raise


if __name__ == "__main__":
    main()
