"""Models side by side on the same rows: errors, laws, and a network trained in the background."""

import asyncio
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from nicegui import ui

from ...physics.presentation import listing, number, words
from ...residuals.training.history import Epoch
from ...workflows.workbench_facts import ModelChoice, Rival, Trained
from ..plots.time_plots import Line, Panel, TimePlots
from ..session import Session
from ..shown import Shown
from .words import button, folded, line, redrawn, stair_name, watching

_ERRORS = ("position [m]", "surge [m/s]", "sway [m/s]", "yaw [rad/s]")
_ACCELERATIONS = tuple(
    f"{axis} [{unit}/s\N{SUPERSCRIPT TWO}]" for axis, unit in (("surge", "m"), ("sway", "m"), ("yaw", "rad"))
)


def side_by_side(session: Session) -> None:
    """The models that the search compared; on another log, the shown model after every step."""
    place = ui.element("section").classes("card stack").props('aria-label="Models side by side"')

    def draw(facts: tuple[str, Sequence[Rival]]) -> None:
        told, rivals = facts
        place.set_visibility(bool(rivals))
        if rivals:
            line("Models side by side", tag="h2").style("margin: 0")
            line(told, "muted small")
            rivals_table(rivals)

    redrawn(session, place, lambda: _side_by_side(session.shown), draw)


def _side_by_side(shown: Shown) -> tuple[str, Sequence[Rival]]:
    """On which rows models stand side by side, and the models."""
    opened = shown.opened
    if shown.on_other and opened is not None:
        return opened.judged, [
            Rival(stair_name(fit), opened.horizon, fit.error, fit.acceleration, (), asked=False) for fit in shown.stairs
        ]
    text = "On all rows, each predicted by models that were made without it. Corrected: all that was found."
    return text, () if shown.searched is None else shown.searched.rivals


def rivals_table(rivals: Sequence[Rival]) -> None:
    """A row for each model: the errors of the headline and the laws, and folded those of accelerations."""
    line(f"Errors of {rivals[0].horizon:g} s predictions", "small")
    laws = any(r.asked for r in rivals)
    rows = [(r.name, *_numbers(r.error), *[_kept(r)] * laws) for r in rivals]
    _table(("model", *_ERRORS, *["laws"] * laws), rows)
    with folded("Errors of accelerations, from row to row"):
        _table(("model", *_ACCELERATIONS), [(r.name, *_numbers(r.acceleration)) for r in rivals])


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    with ui.element("div").classes("scroll"), ui.element("table").classes("numbers"):
        for tag, row in (("th", heads), *(("td", row) for row in rows)):
            with ui.element("tr"):
                for text in row:
                    line(text, tag=tag)


def _numbers(errors: Mapping[str, float | None]) -> list[str]:
    return [number(value, 3) for value in errors.values()]


def _kept(rival: Rival) -> str:
    """What the laws say of a model."""
    if rival.broken:
        return f"breaks {listing(rival.broken)}"
    return "kept" if rival.asked else "not asked"


_NETWORKS = {
    "best": "the one that predicts best over parts of the log that it does not know",
    "mlp": "MLP: what the present state tells",
    "lstm": "LSTM: with memory",
    "tcn": "TCN: with a fixed memory",
    "dissipative": "dissipative: creates no energy, by its form",
    "port_hamiltonian": "port-Hamiltonian: with memory, creates no energy",
    "symmetric": "symmetric: the same to port and to starboard",
    "gp": "Gaussian process: what the present state tells, smoothly",
    "symmetric_gp": "symmetric Gaussian process: the same to port and to starboard",
    "ridge": "ridge regression: products of velocities and thrusts, fitted in seconds",
    "trees": "boosted trees: what the present state tells, in steps",
}


class Networks:
    """Choice, curve and table."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._epochs: list[tuple[float, float, float]] = []
        self._trained: Trained | None = None
        self._source = session.shown.source
        self._task: asyncio.Task[Any] | None = None
        host = ui.element("section").classes("card stack").props('aria-label="Networks"')
        with host:
            line("A network for what has no name", tag="h2")
            line(
                "It learns what the model of the present step still leaves, numbers moved by hand included, on the "
                "training part of the fitted log.",
                "muted small",
            )
            with ui.element("div").classes("flow"):
                self._choice = ui.select(_NETWORKS, value="mlp", label="network").props("outlined dense")
                self._most = ui.number(label="epochs", value=60, min=1, max=1000, precision=0).props("outlined dense")
                self._most.style("width: 100px")
                self._start = button("Train", self._train, lead=True, label="Train a network")
                self._stop = button("Stop", self._stopped, label="Stop training")
            self._told = line("", "muted small").props('role="status"')
            lines = (Line("loss", "loss in training", "between"), Line("rmse", "error in validation", "after"))
            self._curve = TimePlots((Panel("Error by epoch", "", lines),))
            self._beside = line("", "small")
            self._table = ui.element("div").classes("scroll")
        watching(session, host, self._refresh)

    def _refresh(self) -> None:
        source = self._session.shown.source
        if source != self._source:  # another log, or another reading of it: nothing was trained on that
            self._source, self._trained, self._epochs = source, None, []
            self._table.clear()
            self._told.set_text("")
        going = self._task is not None and not self._task.done()
        self._start.set_enabled(self._session.shown.opened is not None and not going)
        self._stop.set_enabled(going)
        self._curve.set_visibility(bool(self._epochs))
        self._beside.set_text("" if self._trained is None else _beside(self._trained.stand, self._session.shown.stand))

    def _train(self) -> None:
        self._epochs, client = [], ui.context.client
        self._told.set_text("Reading the log, loading torch ...")

        async def act() -> None:
            done = await self._session.train(str(self._choice.value), int(self._most.value or 60), self._epoch)
            if client.is_deleted:
                return
            with client:
                self._done(done)

        self._task = asyncio.create_task(act())
        self._refresh()

    def _epoch(self, told: object) -> None:
        if not isinstance(told, Epoch):
            return
        self._epochs.append((told.number, np.nan if told.loss is None else told.loss, told.rmse))
        epoch, loss, rmse = np.array(self._epochs, float).T
        self._curve.set_visibility(visible=True)
        self._curve.show(epoch, {"loss": loss, "rmse": rmse})
        self._told.set_text(f"epoch {told.number}: error in validation {number(told.rmse, 3)}")

    def _stopped(self) -> None:
        self._session.training.stop()
        self._told.set_text("Stopped. Nothing was kept.")

    def _done(self, done: Trained | None) -> None:
        self._task = None
        self._refresh()
        if done is None:
            self._told.set_text(self._session.errands.trouble or "Stopped. Nothing was kept.")
            return
        self._trained = done
        self._refresh()
        self._told.set_text(done.told)
        self._table.clear()
        with self._table:
            line("On the last part of the log, which it was not trained on:", "muted small")
            rivals_table(done.rivals)


def _beside(learnt: ModelChoice, now: ModelChoice) -> str:
    """Beside which model a network was trained, and whether that is still the present one."""
    parts = [words(name) for name in learnt.names] + [
        f"{symbol} = {value:.4g} by hand" for symbol, value in learnt.moved
    ]
    left = f", read without the correction of {listing([words(name) for name in learnt.left])}" if learnt.left else ""
    text = f"Trained beside the model {f'with {listing(parts)}' if parts else 'as its file has it'}{left}."
    return text if now == learnt else f"{text} The model has changed since: train again to see a network beside it."
