"""How fast networks train: seconds to the early stop, and samples a second beside a plain PyTorch loop.

    python benchmarks/training_speed.py [--passes 20]

The first figure is `train` with its defaults, windows and judging included: an LSTM on 4 simulated logs of 4 minutes.
The others are rows of windows a second through a pass of our loop over that training part, and through the loop that
one would write down without undertow: shuffled batches from a TensorDataset and a DataLoader, the same network, AdamW,
batch size and gradient clipping, and the data term of the same windows (output through the same filter, errors in the
same units). Ours has laws and smoothness switched off for the ratio; a line with them on follows. The loops take turns,
and the best pass of each counts: seconds of the processor, of which other work on the machine takes none. Exits 1 when
a limit is broken. `training_on_a_gpu.py` has what a GPU is worth.
"""

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import replace

import torch
from torch.utils.data import DataLoader, TensorDataset

from undertow.measurements.preparation.prepare import PAPER, DataSet
from undertow.measurements.preparation.resampling import smooth
from undertow.measurements.preparation.split import Split, split
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world
from undertow.residuals.training.epochs import adam, one_pass, train
from undertow.residuals.training.preparation import Prepared, prepare_training
from undertow.residuals.training.training_settings import Choice, TrainingSettings

HULL = load_vehicle("blueboat")
HIDDEN = {"surge_quadratic_damping": -8.0, "sway_lift": 15.0}
LIMIT, RATIO = 60.0, 0.9
"""Most seconds of a training, and most of the plain loop's time that a pass of ours may take."""
BARE = TrainingSettings(lambda_phys=0.0, lambda_smooth=0.0, sensor_noise=0.0, trust=False, device="cpu")


def logs() -> Split:
    """Four logs of 4 minutes of a boat with hidden effects, at 10 Hz, divided in the order of time."""
    worlds = [simulate_world(HULL, HIDDEN, duration=240.0, seed=k).motion(0.1) for k in range(4)]
    raw = tuple(replace(motion, source=str(k)) for k, motion in enumerate(worlds))
    return split(DataSet(tuple(smooth(motion, 1.2) for motion in raw), (), PAPER, raw))


def ours(parts: Split, settings: TrainingSettings) -> tuple[Callable[[], object], Prepared]:
    """One pass of our loop."""
    prepared = prepare_training(parts, HULL, Choice("lstm"), settings)
    optimiser, draw = adam(prepared.network, settings), torch.Generator().manual_seed(0)
    return lambda: one_pass(prepared.network, prepared.objective, optimiser, settings, draw), prepared


def plain(parts: Split, settings: TrainingSettings) -> Callable[[], object]:
    """One pass of a plain loop over the same windows."""
    prepared = prepare_training(parts, HULL, Choice("lstm"), settings)
    network, made = prepared.network, prepared.objective
    optimiser = torch.optim.AdamW(network.parameters(), settings.learning_rate, weight_decay=settings.weight_decay)
    loader = DataLoader(TensorDataset(made.inputs, made.target), settings.batch, shuffle=True)

    def go() -> None:
        for inputs, target in loader:
            optimiser.zero_grad()
            said, _ = network(inputs)
            loss = ((made.filter @ said[:, made.warm_rows :] - target) / made.unit).square().mean()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), settings.clip)
            optimiser.step()

    return go


def fastest(loops: list[Callable[[], object]], passes: int) -> list[float]:
    """Shortest time of a pass of each loop [s]."""
    best = [float("inf")] * len(loops)
    for k in range(passes + 2):
        for which, loop in enumerate(loops):
            begun = time.process_time()
            loop()
            if k >= 2:
                best[which] = min(best[which], time.process_time() - begun)
    return best


def compared(parts: Split, passes: int) -> float:
    """Print samples a second; the ratio of ours to the plain loop."""
    loop, prepared = ours(parts, BARE)
    whole, _ = ours(parts, TrainingSettings(device="cpu"))
    rows = prepared.objective.count * prepared.objective.inputs.shape[1]
    seconds = fastest([loop, plain(parts, BARE), whole], passes)
    names = ("ours, data term only", "plain PyTorch loop", "ours, laws and smoothness on")
    for name, taken in zip(names, seconds, strict=True):
        print(f"{name:30s} {rows / taken:10.0f} samples a second")
    ratio = seconds[0] / seconds[1]
    print(f"ours takes {ratio:.2f} of the plain loop's time  (limit {RATIO:g}) ", end="")
    print("ok" if ratio <= RATIO else "BROKEN")
    return ratio


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--passes", type=int, default=20)
    passes = parser.parse_args().passes
    parts = logs()
    begun = time.perf_counter()
    found = train(parts, HULL, Choice("lstm"), settings=TrainingSettings(device="cpu"))
    seconds = time.perf_counter() - begun
    verdict = "ok" if seconds < LIMIT else "BROKEN"
    print(f"LSTM, 4 logs of 4 min: {seconds:.1f} s to epoch {found.epochs[-1].number}, kept {found.best_epoch}", end="")
    print(f" ({found.stopped}; lawful: {found.lawful})  (limit {LIMIT:g} s) {verdict}")
    torch.set_num_threads(1)  # as `train` has it
    ratio = compared(parts, passes)
    return int(seconds >= LIMIT or ratio > RATIO)


if __name__ == "__main__":
    sys.exit(main())
