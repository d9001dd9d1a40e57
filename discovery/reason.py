"""The doubts that a name may meet: one word of a closed list each, which carries its sentence."""

from ..physics.file_records import DescribedEnum

_IN = "Not certain: "
_FORMER = {
    "doubtful_value": "file_value",
    "worse_unseen": "weak",
    "not_in_most_folds": "weak",
    "folds": "weak",
    "elsewhere": "weak",
    "untold": "weak",
    "rollouts_object": "weak",
    "mostly_doubted": "lasting_rest",
    "unjudged_rival": "look_alikes",
    "chance": "weak",
    "crowd": "lasting_rest",
    "uneven": "lasting_rest",
    "other_form": "substitute",
    "record": "sensors",
}
"""Words of earlier versions, and what stands in their place."""


class Reason(DescribedEnum):
    """The largest doubt about an effect; the value is the word that `findings.json` writes.

    Those from `FILE_VALUE` to `WEAK` are tests of a claim: each has a size, relative to the claim, that lowers its
    odds (`judgement`); none of them takes an answer back. The others say why an effect is no claim.
    """

    sentence: str
    """What is told of it: {meaning} is the catalogue's sentence, {lowered} the same with a small letter at its start,
    and {told} what the evidence adds."""
    cannot_tell: bool
    """Whether the log holds nothing that could settle it, so that no number about the effect means anything."""

    def __init__(self, word: str, sentence: str, cannot_tell: bool = False) -> None:
        super().__init__(word, sentence)
        self.cannot_tell = cannot_tell

    @classmethod
    def _missing_(cls, value: object) -> "Reason | None":
        """The member for a word of an earlier version."""
        return cls(_FORMER[value]) if isinstance(value, str) and value in _FORMER else None

    FAINT = ("faint", "{told}, but that is too near the sensor noise to name anything from. ({meaning})")
    FILE_VALUE = ("file_value", f"{_IN}{{told}}. ({{meaning}})")
    LOOK_ALIKES = ("look_alikes", "This log cannot tell it from {told}: {lowered}")
    SUBSTITUTE = ("substitute", "Perhaps only the nearest name for something else: {told}. ({meaning})")
    AT_LIMIT = ("at_limit", "Doubtful: {told}. ({meaning})")
    SENSORS = ("sensors", f"{_IN}{{told}}. ({{meaning}})")
    OUT_OF_STEP = (
        "out_of_step",
        "Doubtful: the log's channels are out of step by about {told} s, or may be, and that alone could look like it. "
        "({meaning})",
    )
    LASTING_REST = ("lasting_rest", f"{_IN}on its axis, {{told}}. ({{meaning}})")
    WEAK = ("weak", "Perhaps: {lowered} The evidence is below what undertow demands.")
    NEEDS_CHANNELS = ("needs_channels", "This log cannot tell: it needs the channels {told}. ({meaning})", True)
    UNFOUND = ("unfound", "In the model because it was asked for, but not certain: {told}. ({meaning})")
    NOT_EXCITED = (
        "not_excited",
        "This log cannot tell: it holds no manoeuvre in which it would show. ({meaning})",
        True,
    )
    UNJUDGED = (
        "unjudged",
        "This log cannot tell: rollouts, which judge a log of such noise or compass, do not show it. ({meaning})",
        True,
    )
    ABSORBED = (
        "absorbed",
        "This log cannot tell: the calibrated parameters take up what it would do. ({meaning})",
        True,
    )
    NOISE = ("noise", "This log cannot tell: what would show it is hardly more than sensor noise. ({meaning})", True)
    NOT_FOUND = ("not_found", "Looked for and not found. ({meaning})")

    def tell(self, meaning: str, told: str = "") -> str:
        """The sentence.

        Parameters
        ----------
        meaning : what the catalogue says of the effect, a sentence
        told : what the evidence adds
        """
        return self.sentence.format(meaning=meaning, lowered=f"{meaning[0].lower()}{meaning[1:]}", told=told)
