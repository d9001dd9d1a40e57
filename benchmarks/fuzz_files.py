"""Spoil the files that verbs read beside logs, and count what ends in anything but a clear error.

python benchmarks/fuzz_files.py [--files 2000] [--kind NAME]... [--seed 0] [--draw]

YAML and JSON are spoilt in their structure, everything else in its bytes. Each file is used in every way in which a
verb uses it, in a process that has 60 s for each file, and 1.3 GB of memory beyond what the loaded program takes. What
counts as a crash is any exception but undertow's own three, and a message of more than 4,000 characters. Without
--draw, the pictures of a page are laid out but not turned into SVG, which takes seconds a page.
"""

import argparse
import resource
import signal
import sys
import tempfile
import time
from multiprocessing.connection import Connection
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from fuzz import _held, fuzz
from memory import peak_memory
from spoilt_files import KINDS, judged

SECONDS = 60
MEMORY = int(1.3e9)
"""Bytes that using a file may take beyond the 0.2 GB of the loaded program."""


def _work(name: str, seeds: range, draw: bool, channel: Connection) -> None:
    """Use spoilt files, and tell what became of each."""
    from undertow.reports.page.figures import svg
    from undertow.reports.page.markup import Html

    if not draw:
        svg.inline = lambda text, label: Html("")
        svg.FigureCanvasSVG.print_svg = lambda *_, **__: None
    kind = KINDS[name]
    with tempfile.TemporaryDirectory() as folder:
        path = kind.write(Path(folder))
        sound = path.read_bytes()
        kind.use(path)
        limit = _held() + MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        before = peak_memory()
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        for seed in seeds:
            signal.alarm(SECONDS)
            outcome = judged(kind, path, sound, seed)
            signal.alarm(0)
            channel.send((seed, outcome, peak_memory() - before))
    channel.close()


def main() -> None:
    """Print a row for every kind; leave with exit code 1 when a file crashed or hung."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", type=int, default=2000)
    parser.add_argument("--kind", action="append", choices=list(KINDS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--draw", action="store_true")
    chosen = parser.parse_args()
    print("| file | spoilt | read | clear errors | crashes | hangs | memory [MB] | seconds |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    bad = 0
    for name in chosen.kind or KINDS:
        begun = time.perf_counter()
        tally = fuzz(name, range(chosen.seed, chosen.seed + chosen.files), chosen.draw, _work)
        counts = [tally.outcomes[kind] for kind in ("read", "clear error", "crash", "hang")]
        bad += counts[2] + counts[3]
        cells = [name, chosen.files, *counts, f"{tally.memory:.0f}", f"{time.perf_counter() - begun:.0f}"]
        print("| " + " | ".join(map(str, cells)) + " |", flush=True)
        for text in tally.worst[:20]:
            print(f"  {text}", file=sys.stderr, flush=True)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
