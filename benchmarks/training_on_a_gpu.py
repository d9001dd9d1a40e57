"""What a GPU, batched ensembles and compilation would gain: seconds of an epoch of the product's own training.

    python benchmarks/training_on_a_gpu.py [--out FILE.jsonl] [--minutes 5] [--seconds 2]

The log is five minutes of a boat with hidden effects; 70 % of it teach. Every figure is the median of as many epochs as
`--seconds` hold, at least one, after one that does not count. Each piece runs in a process of its own with a limit of
time, and what it finds is printed, and written to `--out`, at once: a piece that fails or comes too late costs itself.

    epoch      a pass over all windows and the verdict on it, on one thread, on all cores, and on the GPU
    ensemble   a pass of five seeds: one after the other, and as one call (`torch.func.vmap` over stacked weights)
    rollouts   a pass with rollouts of 2 s in the loss: as it is, and with the force equation compiled
    replayed   a step as a recorded graph of kernels (CUDA graphs), its draws held: what a GPU could do at most
    whole      `train` from end to end, its probes included, with 40 epochs
    rounding   how far three epochs part two trainings whose weights at the start differ by one rounding
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any
from unittest import mock

HIDDEN = {"surge_quadratic_damping": -8.0, "sway_lift": 15.0}
TRAINED = ("mlp", "symmetric", "dissipative", "lstm", "port_hamiltonian", "tcn", "transformer")
SEEDS, ROLLED = 5, 20
"""Members of an ensemble; rows of a rollout, 0.1 s each."""
LIMIT = 120.0
"""Seconds of a piece."""
CORES = str(os.cpu_count())
FIRST = (("epoch", "cpu", CORES, "mlp lstm tcn transformer"),)
"""Alone: pieces that take every core."""
BESIDE = (
    ("epoch", "cpu", "1", " ".join(TRAINED)),
    ("ensemble", "cpu", "1", "mlp symmetric tcn transformer lstm"),
    ("rollouts", "cpu", "1", "mlp lstm"),
    ("compiled", "cpu", "1", "mlp"),
    ("compiled", "cpu", "1", "lstm"),
    ("whole", "cpu", "1", "mlp"),
    ("whole", "cpu", "1", "lstm"),
    ("rounding", "cpu", "1", "mlp lstm tcn transformer"),
)
"""On one thread each, beside those of the GPU, where there are cores for them."""
ON_GPU = (
    ("epoch", "cuda", "1", " ".join(TRAINED)),
    ("ensemble", "cuda", "1", "mlp symmetric tcn transformer lstm"),
    ("replayed", "cuda", "1", "mlp symmetric dissipative lstm tcn transformer"),
    ("rollouts", "cuda", "1", "mlp"),
    ("whole", "cuda", "1", "mlp"),
    ("whole", "cuda", "1", "lstm"),
    ("compiled", "cuda", "1", "mlp"),
    ("compiled", "cuda", "1", "lstm"),
)
"""One after the other."""


class Training:
    """A training of one kind on a device, ready for its passes."""

    def __init__(self, kind: str, device: str, seconds: float, rolled: int = 0, noise: float = 1.0) -> None:
        import torch

        from undertow.measurements.preparation.prepare import PAPER, DataSet
        from undertow.measurements.preparation.resampling import smooth
        from undertow.measurements.preparation.split import split
        from undertow.physics.vehicle import load_vehicle
        from undertow.physics.worlds.world import simulate_world
        from undertow.residuals.training.epochs import adam
        from undertow.residuals.training.preparation import prepare_training
        from undertow.residuals.training.training_settings import Choice, TrainingSettings

        self.vehicle, self.choice = load_vehicle("blueboat"), Choice(kind)
        raw = simulate_world(self.vehicle, HIDDEN, duration=seconds, seed=0).motion(0.1)
        self.split = split(DataSet((smooth(raw, 1.2),), (), PAPER, (raw,)))
        self.settings = TrainingSettings(device=device, rollout_rows=rolled, sensor_noise=noise)  # type: ignore[arg-type]
        torch.manual_seed(0)
        self.made = prepare_training(self.split, self.vehicle, self.choice, self.settings)
        self.draw = torch.Generator().manual_seed(0)
        self.optimiser = adam(self.made.network, self.settings)

    def one_pass(self) -> None:
        from undertow.residuals.training.epochs import one_pass

        one_pass(self.made.network, self.made.objective, self.optimiser, self.settings, self.draw)

    def judge(self) -> None:
        self.made.judge.error(self.made.network)
        self.made.judge.violating(self.made.network)


def timed(act: Callable[[], object], device: str, budget: float) -> dict[str, float]:
    """Seconds of the first call, and the median of those after it."""
    import torch

    found: list[float] = []
    while len(found) < 2 or sum(found[1:]) < budget:
        begun = time.perf_counter()
        act()
        if device == "cuda":
            torch.cuda.synchronize()
        found.append(time.perf_counter() - begun)
    return {"first": found[0], "seconds": median(found[1:]), "calls": len(found) - 1}


Found = Iterator[tuple[str, dict[str, Any]]]


def epoch(kind: str, device: str, seconds: float, budget: float) -> Found:
    training = Training(kind, device, seconds)
    yield "pass", timed(training.one_pass, device, budget) | {"windows": training.made.objective.count}
    yield "verdict", timed(training.judge, device, 0.2 * budget)


def ensemble(kind: str, device: str, seconds: float, budget: float) -> Found:
    """Five seeds; what both say of the first batch must agree."""
    import torch

    members = [Training(kind, device, seconds, noise=0.0) for _ in range(SEEDS)]
    for seed, one in enumerate(members):
        torch.manual_seed(seed)
        with torch.no_grad():
            for weights in one.made.network.parameters():
                weights.add_(0.05 * torch.randn(weights.shape).to(weights))
    step, losses = stacked(members)
    count = members[0].made.objective.count
    size = batch_of(count, members[0].settings)
    batch = torch.arange(size, device=device)
    with torch.no_grad():
        said = [one.made.objective(one.made.network, batch, torch.Generator().manual_seed(1)) for one in members]
    alone = torch.stack(said)
    yield "in turn", timed(lambda: [one.one_pass() for one in members], device, budget)
    with torch.no_grad():
        together = losses(batch.expand(SEEDS, size), torch.Generator().manual_seed(1))
    apart = float((together / alone - 1.0).abs().max())
    draw = torch.Generator().manual_seed(0)

    def one_pass() -> None:
        order = torch.stack([torch.randperm(count, generator=draw) for _ in range(SEEDS)]).to(device)
        for index in order.split(size, dim=1):
            step(index, draw)

    yield "stacked", timed(one_pass, device, budget) | {"apart": apart}
    if device == "cuda":
        fixed = torch.stack([torch.randperm(count)[:size] for _ in range(SEEDS)]).to(device)
        yield "stacked, replayed", replay(lambda: step(fixed, draw), -(-count // size), budget)


def batch_of(windows: int, settings: Any) -> int:
    from undertow.residuals.training.epochs import _batch

    return _batch(windows, settings)


def stacked(members: list[Training]) -> tuple[Callable[..., None], Callable[..., Any]]:
    """A step of all members at once, and their losses (members,) on a batch of windows each."""
    import torch
    from torch.func import functional_call, stack_module_state, vmap

    networks = [deepcopy(one.made.network) for one in members]
    parameters, buffers = stack_module_state(networks)  # type: ignore[arg-type]
    base, first = deepcopy(networks[0]).to("meta"), members[0]
    graphed = first.settings.device == "cuda"
    optimiser = torch.optim.AdamW(
        parameters.values(), first.settings.learning_rate, weight_decay=1e-4, fused=True, capturable=graphed
    )

    def losses(index: Any, draw: Any) -> Any:
        def one(own: Any, constants: Any, rows: Any) -> Any:
            def network(*given: Any) -> Any:
                return functional_call(base, (own, constants), given)

            return first.made.objective(network, rows, draw)  # type: ignore[arg-type]

        return vmap(one, randomness="same")(parameters, buffers, index)

    def step(index: Any, draw: Any) -> None:
        optimiser.zero_grad()
        losses(index, draw).sum().backward()
        slopes = [weights.grad for weights in parameters.values() if weights.grad is not None]
        norm = torch.stack([slope.flatten(1).square().sum(1) for slope in slopes]).sum(0).sqrt()
        share = (first.settings.clip / (norm + 1e-6)).clamp(max=1.0)
        for slope in slopes:
            slope.mul_(share.view(-1, *[1] * (slope.dim() - 1)))
        optimiser.step()

    return step, losses


def rollouts(kind: str, device: str, seconds: float, budget: float) -> Found:
    yield "as it is", timed(Training(kind, device, seconds, ROLLED).one_pass, device, budget)


def compiled(kind: str, device: str, seconds: float, budget: float) -> Found:
    import torch

    training = Training(kind, device, seconds, ROLLED)
    shooter = training.made.objective.shooter
    shooter._slope = torch.compile(shooter._slope, dynamic=False)  # type: ignore[method-assign]
    yield "slope compiled", timed(training.one_pass, device, budget)
    if device == "cuda":
        plain = Training(kind, device, seconds)
        plain.made.network.forward = torch.compile(plain.made.network.forward)  # type: ignore[method-assign]
        yield "network compiled, no rollouts", timed(plain.one_pass, device, budget)


def replayed(kind: str, device: str, seconds: float, budget: float) -> Found:
    import torch

    for rolled in (0, ROLLED):
        training = Training(kind, device, seconds, rolled, noise=0.0)
        network, settings, made = training.made.network, training.settings, training.made.objective
        weights = list(network.parameters())
        optimiser = torch.optim.AdamW(weights, settings.learning_rate, fused=True, capturable=True)
        size = batch_of(made.count, settings)
        batch = torch.arange(size, device=device)

        def step(made: Any, network: Any, optimiser: Any, batch: Any, weights: Any, training: Any) -> None:
            optimiser.zero_grad()
            made(network, batch, training.draw).backward()
            torch.nn.utils.clip_grad_norm_(weights, 1.0, foreach=True)
            optimiser.step()

        act = partial(step, made, network, optimiser, batch, weights, training)
        yield f"rollouts of {rolled} rows", replay(act, -(-made.count // size), budget)


def replay(step: Callable[[], None], steps: int, budget: float) -> dict[str, Any]:
    """Seconds of a pass of `steps` steps, launched one by one and replayed, with the same draws in each."""
    import torch

    with held_draws():
        aside = torch.cuda.Stream()
        aside.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(aside):
            for _ in range(3):
                step()
        torch.cuda.current_stream().wait_stream(aside)
        launched = timed(step, "cuda", 0.5 * budget)["seconds"] * steps
        graph = torch.cuda.CUDAGraph()
        begun = time.perf_counter()
        with torch.cuda.graph(graph):
            step()
        recorded = time.perf_counter() - begun
    found = timed(lambda: [graph.replay() for _ in range(steps)], "cuda", budget)
    return found | {"launched": launched, "recorded": recorded}


@contextmanager
def held_draws() -> Iterator[None]:
    """Draws as constants, for a recorded step cannot copy from the processor."""
    import torch

    drawn: dict[tuple[Any, ...], Any] = {}
    own = torch.randint

    def randint(*given: Any, generator: Any = None) -> Any:
        if given not in drawn:
            found = own(*given, generator=generator)
            drawn[given] = found.cuda() if found.dim() else found
        return drawn[given]

    with mock.patch.object(torch, "randint", randint):
        yield


def whole(kind: str, device: str, seconds: float, budget: float) -> Found:
    from dataclasses import replace

    from undertow.residuals.training.epochs import train

    training = Training(kind, device, seconds)
    settings = replace(training.settings, epochs=40 if budget > 0.5 else 2)
    begun = time.perf_counter()
    found = train(training.split, training.vehicle, training.choice, settings=settings)
    last = found.epochs[-1]
    yield "train", {"seconds": time.perf_counter() - begun, "epochs": last.number, "error": last.rmse}


def rounding(kind: str, device: str, seconds: float, budget: float) -> Found:
    """What three epochs make of one rounding of the weights at the start, as a share of the largest correction."""
    from dataclasses import replace

    import numpy as np
    import torch

    from undertow.residuals.networks.registry import build
    from undertow.residuals.training import preparation
    from undertow.residuals.training.epochs import train

    def rounded(*given: Any) -> Any:
        network = build(*given)
        with torch.no_grad():
            for weights in network.parameters():
                weights.mul_(1.0 + 2.0**-23 * torch.randint(-1, 2, weights.shape).to(weights))
        return network

    training, said = Training(kind, device, seconds), []
    for made in (build, rounded):
        with mock.patch.object(preparation, "build", made):
            settings = replace(training.settings, epochs=3, trust=False)
            model = train(training.split, training.vehicle, training.choice, settings=settings).model
        said.append(np.concatenate([model.correction(motion) for motion in training.split.test.motions]))
    yield "single precision", {"apart": float((abs(said[1] - said[0]).max(axis=0) / abs(said[0]).max(axis=0)).max())}


PIECES = {f.__name__: f for f in (epoch, ensemble, rollouts, compiled, replayed, whole, rounding)}


def child(piece: str, device: str, threads: str, kinds: str, out: str, seconds: float, budget: float) -> None:
    """One piece in this process; a line for each figure."""
    import torch

    torch.set_num_threads(int(threads))
    torch.backends.cudnn.deterministic, torch.backends.cudnn.allow_tf32 = True, False  # as `train` has it
    for kind in kinds.split():
        about = {"piece": piece, "kind": kind, "device": device, "threads": int(threads)}
        try:
            for what, found in PIECES[piece](kind, device, seconds, budget):
                say(about | {"what": what} | found, out)
        except Exception as error:  # what fails is a figure, too
            say(about | {"failed": f"{type(error).__name__}: {error}"[:600]}, out)


def say(found: dict[str, Any], out: str) -> None:
    line = json.dumps({k: float(f"{v:.4g}") if isinstance(v, float) else v for k, v in found.items()})
    print(line, flush=True)
    if out:
        with Path(out).open("a", encoding="utf-8") as file:
            file.write(line + "\n")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default="", help="file of lines of JSON that grows")
    parser.add_argument("--minutes", type=float, default=5.0, help="of log")
    parser.add_argument("--seconds", type=float, default=2.0, help="to time each piece for")
    parser.add_argument("--until", type=float, default=1e9, help="seconds after which no piece begins or goes on")
    parser.add_argument("--piece", nargs=4, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.piece:
        piece, device, threads, kinds = given.piece
        child(piece, device, threads, kinds, given.out, 60.0 * given.minutes, given.seconds)
        return 0
    import torch

    begun, gpu = time.perf_counter(), torch.cuda.is_available()
    card = torch.cuda.get_device_name(0) if gpu else "none"
    say({"torch": torch.__version__, "gpu": card, "cores": os.cpu_count()}, given.out)
    run = partial(begin, given)
    for piece in FIRST:
        ended(given, piece, run(piece), begun)
    beside = [(piece, run(piece)) for piece in BESIDE] if gpu else []
    for piece in ON_GPU if gpu else BESIDE:
        if time.perf_counter() - begun < given.until:
            ended(given, piece, run(piece), begun)
        else:
            say({"piece": piece, "failed": "no time left"}, given.out)
    for piece, process in beside:
        ended(given, piece, process, begun)
    return 0


def begin(given: argparse.Namespace, piece: tuple[str, ...]) -> "subprocess.Popen[bytes]":
    """A process of a piece; threads of the numerical libraries are as many as it says."""
    options = ["--out", given.out, "--minutes", str(given.minutes), "--seconds", str(given.seconds)]
    threads = {"OMP_NUM_THREADS": piece[2], "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.Popen([sys.executable, __file__, *options, "--piece", *piece], env=os.environ | threads)


def ended(given: argparse.Namespace, piece: tuple[str, ...], process: "subprocess.Popen[bytes]", begun: float) -> None:
    """Wait for a piece, and end it where it is late."""
    left = min(LIMIT, max(given.until - (time.perf_counter() - begun), 0.1))
    try:
        code = process.wait(left)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        say({"piece": piece, "failed": f"ended after {left:.0f} s"}, given.out)
        return
    if code:
        say({"piece": piece, "failed": f"exit code {code}"}, given.out)


if __name__ == "__main__":
    sys.exit(main())
