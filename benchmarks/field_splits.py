"""What the whole answer is worth on a real BlueBoat: whole logs held out, three splits.

Splits, linear model and judged rows are those of `examples/real_blueboat.py`: each split holds a third of the field
logs out, and errors are those of 10 s rollouts on rows with a command in the last 8 s. `discover --residual best` takes
the other logs, as files, and the linear model that is fitted to them.

    python benchmarks/field_splits.py FOLDER [--splits 3] [--residual best]

Prints a line for each split and model, then all splits together; exits 1 where the whole answer errs more than the
corrected model on any of surge, yaw and position of a split, by over 1 % of the error of the linear one. Minutes a
split.
"""

import argparse
import runpy
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from undertow.measurements.log_options import Reading
from undertow.measurements.preparation.prepare import PAPER, WEAK, prepare
from undertow.physics.motion import Array, Motion
from undertow.physics.vehicle import Vehicle, vehicle_from_dict
from undertow.residuals.models.base import Model, VehicleModel
from undertow.residuals.training.training_settings import TrainingSettings
from undertow.workflows.discover_and_add import discover
from undertow.workflows.inputs import read_inputs
from undertow.workflows.whole_answer import with_network

LAKE: dict[str, Any] = runpy.run_path(str(Path(__file__).parents[1] / "examples" / "real_blueboat.py"))
MOST, HORIZON = 0.01, 10.0
JUDGED = {"surge": 0, "yaw": 2, "position": 3}


def models(paths: Sequence[Path], linear: Vehicle, channels: Path, kind: str) -> dict[str, Model]:
    """The linear model, what names make of it, and the whole answer; the second for the third where nothing is left."""
    run = discover(read_inputs(paths, linear, Reading(channel_map=channels), progress=None), progress=None)
    _, done = with_network(run, kind, settings=TrainingSettings(device="cpu"), progress=None)
    corrected = VehicleModel(run.discovery.corrected, "corrected")
    whole = corrected if done is None else done.model
    names = ", ".join(sorted(LAKE["found_names"](run.discovery))) or "none"
    print(f"  names: {names}; network: {'none' if done is None else done.model.network.name}")
    if done is not None:
        print(
            "  kinds:", ", ".join(f"{kind.name} {kind.ratio:.3f} ({kind.error:.3f})" for kind in done.kinds), flush=True
        )
    return {"linear": VehicleModel(linear, "linear"), "corrected": corrected, "whole": whole}


def squares(model: Model, motions: Sequence[Motion]) -> Array:
    """Squared errors of u, v, r and position along rollouts from every 0.5 s, on driven rows (rows, 4)."""
    found = [np.zeros((0, 4))]
    for motion in motions:
        steps, spacing = (round(seconds / motion.time_step) for seconds in (HORIZON, 0.5))
        starts = np.arange(0, motion.time.size - steps, max(1, spacing))
        if starts.size:
            states = model.rollout(motion, starts, steps).states[:, 1:]
            rows = starts[:, None] + np.arange(1, steps + 1)
            apart = ((states[..., :2] - motion.position[rows]) ** 2).sum(axis=-1, keepdims=True)
            every = np.concatenate([(states[..., 3:] - motion.velocity[rows]) ** 2, apart], axis=-1)
            found.append(every[LAKE["active"](motion)[rows]])
    return np.concatenate(found)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the splits."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--splits", type=int, default=3)
    parser.add_argument("--residual", default="best")
    given = parser.parse_args(arguments)
    logs = {log.name: log for log in LAKE["read"](given.folder)}
    start = vehicle_from_dict(LAKE["START"], "start")
    totals: dict[str, list[Array]] = {}
    with tempfile.TemporaryDirectory() as scratch:
        channels = Path(scratch) / "channels.yaml"
        channels.write_text(LAKE["CHANNELS"], encoding="utf-8")
        for number, out in enumerate(LAKE["divisions"](list(logs), given.splits), start=1):
            print(f"split {number}, held out {', '.join(out)}", flush=True)
            taught = [name for name in logs if name not in out]
            linear = LAKE["fitted"]([m for name in taught for m in prepare(logs[name], start, WEAK).motions], start)
            test = [m for name in out for m in prepare(logs[name], linear, PAPER).motions]
            paths = [given.folder / name for name in taught]
            for name, model in models(paths, linear, channels, given.residual).items():
                totals.setdefault(name, []).append(squares(model, test))
                print(f"  {name:9}: {LAKE['told'](totals[name][-1])}", flush=True)
    print("all splits")
    for name, found in totals.items():
        print(f"  {name:9}: {LAKE['told'](np.concatenate(found))}")
    print("the whole answer beside names, in the linear error: all, and each split")
    worst = -np.inf
    for some in ([np.concatenate(found) for found in totals.values()], *zip(*totals.values(), strict=True)):
        root = dict(zip(totals, (np.sqrt(found.mean(axis=0)) for found in some), strict=True))
        worse = {axis: (root["whole"][k] - root["corrected"][k]) / root["linear"][k] for axis, k in JUDGED.items()}
        print(f"  {', '.join(f'{axis} {share:+.1%}' for axis, share in worse.items())}")
        worst = max(worst, *worse.values())
    return int(worst > MOST)


if __name__ == "__main__":
    sys.exit(main())
