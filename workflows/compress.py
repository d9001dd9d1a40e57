"""Logs in a few kilobytes: what a vehicle leaves unexplained, as factors that add to those of other logs."""

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import reduce
from itertools import pairwise
from operator import add

import numpy as np

from ..discovery.balance.base import WeakSettings
from ..discovery.balance.weak_form import LEAST_TESTS, WeakForm
from ..discovery.basis import DiscoverySettings
from ..discovery.candidates.unnamed_terms import term_factors
from ..discovery.factors import Factors
from ..measurements.formats.registry import log_digests
from ..measurements.log_options import AS_GUESSED, Reading
from ..measurements.statistics.processors import single_threaded
from ..physics.errors import RequestError
from ..physics.motion import Motion
from ..physics.vehicle import Vehicle
from .inputs import read_inputs

_BLOCK = 30.0
"""Seconds of a block: some manoeuvres, so that what errs alike is in one."""
_PIECE = 1500.0
"""Seconds that are worked on at a time: their rows take some 10 MB."""


@single_threaded
def compress(
    logs: Iterable[str | os.PathLike[str]] | str | os.PathLike[str],
    vehicle: Vehicle | str | os.PathLike[str],
    reading: Reading = AS_GUESSED,
    *,
    degree: int = 3,
) -> Factors:
    """Logs as factors: monomials of the velocity through the water against the force that a vehicle leaves unexplained.

    The test part of each log is left out, as nothing may be fitted to it.

    Parameters
    ----------
    logs, vehicle, reading : as `read_inputs` takes them
    degree : of the monomials of u, v, r and their moduli, 1 to 3

    Raises
    ------
    LogError, VehicleError, RequestError
        as `read_inputs` does; when a log is too short; when two logs are one.
    """
    inputs = read_inputs(logs, vehicle, reading)
    found = []
    for source in dict.fromkeys(motion.source for motion in inputs.fitting):
        own = [motion for motion in inputs.fitting if motion.source == source]
        digest = log_digests([source])[0]["sha256"]
        if digest is None:
            raise RequestError(
                f"{source}: expected a file that can be read again for its digest, got none; keep it in place"
            )
        found.append(_of_one(own, inputs.vehicle, degree, digest))
    return reduce(add, found)


def _of_one(motions: Sequence[Motion], vehicle: Vehicle, degree: int, digest: str) -> Factors:
    weak, parts = DiscoverySettings().weak, []
    for piece in in_pieces(motions, weak):
        blocks = max(4, round(sum(motion.duration for motion in piece) / _BLOCK))  # of one length in time
        settings = replace(weak, blocks=blocks, copies=0)  # what sensor noise adds is asked by nobody here
        parts.append(term_factors(WeakForm(piece, settings), vehicle, degree, (digest,)))
    r, rows = np.concatenate([part.r for part in parts]), np.concatenate([part.rows for part in parts])
    return replace(parts[0], r=r, rows=rows, log=np.zeros(rows.size, dtype=int))


def in_pieces(motions: Sequence[Motion], weak: WeakSettings) -> Iterator[list[Motion]]:
    """Motions in their order, in groups of about `_PIECE` seconds; a short rest belongs to the group before it."""
    cut = [part for motion in motions for part in _cut(motion)]
    group: list[Motion] = []
    left = sum(motion.duration for motion in cut)
    for motion in cut:
        group.append(motion)
        left -= motion.duration
        if sum(one.duration for one in group) >= _PIECE and left > 4 * LEAST_TESTS * weak.stride + _PIECE / 4:
            yield group
            group = []
    yield group


def _cut(motion: Motion) -> list[Motion]:
    """A motion in pieces of about `_PIECE` seconds."""
    count = max(1, round(motion.duration / _PIECE))
    edges = np.linspace(0, motion.time.size, count + 1).round().astype(int).tolist()
    return [motion.slice(start, stop) for start, stop in pairwise(edges)]
