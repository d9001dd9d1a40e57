"""A network in training, in a process of its own that can be stopped."""

import asyncio
from collections.abc import Callable
from pathlib import Path

from ..workflows.workbench_facts import Searched, Trained
from .undo import Step
from .worker import Worker, WorkerLostError


class Training:
    """One training at a time."""

    def __init__(self) -> None:
        self._worker: Worker | None = None

    async def run(
        self,
        network: tuple[str, int],
        step: Step,
        searched: Searched | None,
        folder: Path,
        told: Callable[[object], None],
    ) -> Trained | None:
        """Train a network beside the model of a step; None where it was stopped.

        Parameters
        ----------
        network : its name, and how many epochs at most
        searched : what was found, where something was
        told : called with every epoch

        Raises
        ------
        LogError, RequestError, VehicleError, RuntimeError
            as reading the log and training do.
        """
        self._worker = Worker()
        try:
            own = folder / "training"  # two processes may not write one file
            own.mkdir(exist_ok=True)
            await self._worker.ask("turn_to", step.source, str(own), searched)
            name, epochs = network
            return await self._worker.ask("train", name, step.stand, epochs, say=told)
        except (asyncio.CancelledError, WorkerLostError):
            return None
        finally:
            self.stop()

    def stop(self) -> None:
        """End a training that goes on."""
        if self._worker is not None:
            self._worker.close()
            self._worker = None
