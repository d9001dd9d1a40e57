"""A network beside the corrected model: trained in the background, with its error while it learns, and a stop."""

import asyncio
from typing import Any

from nicegui import ui

from ...physics.in_words import number
from ..plots.time_plots import Line, Panel, TimePlots
from ..session import Session
from .words import button, line, watching

_NETWORKS = {
    "mlp": "MLP: what the present state tells",
    "lstm": "LSTM: with memory",
    "tcn": "TCN: with a fixed memory",
    "dissipative": "dissipative: creates no energy, by its form",
}


class Networks:
    """Choice, curve and table."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._epochs: list[tuple[float, float, float]] = []
        self._task: asyncio.Task[Any] | None = None
        host = ui.element("section").classes("card stack").props('aria-label="Networks"')
        with host:
            line("A network for what has no name", tag="h2")
            line(
                "It learns what the model with the added effects still leaves, on the training part of the log.",
                "muted small",
            )
            with ui.element("div").classes("row"):
                self._choice = ui.select(_NETWORKS, value="mlp", label="network").props("outlined dense")
                self._most = ui.number(label="epochs", value=60, min=1, max=1000, precision=0).props("outlined dense")
                self._most.style("width: 100px")
                self._start = button("Train", self._train, lead=True, label="Train a network")
                self._stop = button("Stop", self._stopped, label="Stop training")
            self._told = line("", "muted small").props('role="status"')
            lines = (Line("train", "loss in training", "between"), Line("rmse", "error in validation", "after"))
            self._curve = TimePlots((Panel("Error by epoch", "", lines),))
            self._table = ui.element("div").classes("scroll")
        watching(session, host, self._refresh)

    def _refresh(self) -> None:
        going = self._task is not None and not self._task.done()
        self._start.set_enabled(self._session.opened is not None and not going)
        self._stop.set_enabled(going)
        self._curve.set_visibility(bool(self._epochs))

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

    def _epoch(self, told: str) -> None:
        parts = told.split()
        if len(parts) != 3 or not parts[0].lstrip("-").isdigit():
            return
        self._epochs.append((float(parts[0]), float(parts[1]), float(parts[2])))
        import numpy as np

        epoch, train, rmse = np.array(self._epochs).T
        self._curve.set_visibility(visible=True)
        self._curve.show(epoch, {"train": train, "rmse": rmse})
        self._told.set_text(f"epoch {parts[0]}: error in validation {number(float(parts[2]), 3)}")

    def _stopped(self) -> None:
        self._session.stop_training()
        self._told.set_text("Stopped. Nothing was kept.")

    def _done(self, done: dict[str, Any] | None) -> None:
        self._task = None
        self._refresh()
        if done is None:
            self._told.set_text(self._session.trouble or "Stopped. Nothing was kept.")
            return
        self._told.set_text(" ".join(done["told"]))
        self._table.clear()
        with self._table, ui.element("table").classes("numbers"):
            with ui.element("tr"):
                for head in (
                    "model",
                    "position after 10 s [m]",
                    "surge [m/s^2]",
                    "sway [m/s^2]",
                    "yaw [rad/s^2]",
                    "laws",
                ):
                    line(head, tag="th")
            for model in done["models"]:
                _row(model)


def _row(model: dict[str, Any]) -> None:
    rollout = (model.get("rollout_rmse") or {}).get("10") or {}
    error = model.get("acceleration", {}).get("rmse") or {}
    broken = [law["law"] for law in model.get("laws", ()) if law.get("outcome") == "fail"]
    with ui.element("tr"):
        line(str(model["name"]), tag="td")
        line(number(rollout.get("position"), 3), tag="td")
        for axis in ("surge", "sway", "yaw"):
            line(number(error.get(axis), 3), tag="td")
        line("kept" if not broken else f"breaks {', '.join(broken)}", tag="td")
