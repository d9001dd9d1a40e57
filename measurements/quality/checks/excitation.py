"""Check of the excitation: what the boat did, and what the log can therefore identify."""

from collections.abc import Sequence
from functools import partial

from ..finding import Check, Finding
from ..record import Record, excitation_of

_LITTLE = 60.0
"""Usable motion below which little can be learned [s]: a few manoeuvres, of which 15 % are held out."""


def _examine(records: Sequence[Record]) -> list[Finding]:
    """Say what the log cannot identify, see `record.excitation_of`.

    One finding for each thing that cannot be told, or one that says that the log has it all.
    """
    stretches = [stretch for record in records for stretch in record.stretches]
    motions = tuple(stretch.motion for stretch in stretches)
    if not motions:
        why = next((record.why_not for record in records if record.why_not), "there is no motion in it")
        text = f"no motion can be made of the log: {why}"
        return [Finding(check="excitation", verdict="cannot tell", sentence=text, value=0.0, unit="s")]
    seen = excitation_of(motions, [stretch.portion.weight for stretch in stretches])
    parts = {name: getattr(seen, name) for name in ("astern", "turning_to_starboard", "turning_to_port")}
    finding = partial(Finding, check="excitation", value=seen.seconds, unit="s", parts=parts)
    found = [
        finding(
            verdict="note",
            sentence=sentence.rstrip("."),
            channels=("u",) if "astern" in sentence else ("r",),
            consequence="what a model fitted to this log says of it is not sure",
            remedy="record it, or give a log in which the boat does it",
        )
        for sentence in seen.sentences
    ]
    if seen.seconds < _LITTLE:
        found.append(
            finding(
                verdict="note",
                sentence=f"only {seen.seconds:.0f} s of usable motion",
                consequence="few effects can be told apart",
                remedy="give several logs together, or record five minutes",
            )
        )
    text = f"{seen.seconds:.0f} s ahead and astern, turning to both sides"
    return found or [finding(verdict="ok", sentence=text)]


EXCITATION = Check("excitation", _examine)
