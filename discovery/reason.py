"""Why an effect is not called missing: one word of a closed list, which carries its sentence."""

from ..physics.worded import Worded


class Reason(Worded):
    """Why an effect is not called missing; the value is the word that `findings.json` writes.

    Where several hold, the one that stands first here is told.
    """

    sentence: str
    """What is told of it: {meaning} is the catalogue's sentence, {lowered} the same with a small letter at its start,
    and {told} what the evidence adds."""
    cannot_tell: bool
    """Whether the log holds nothing that could settle it, so that no number about the effect means anything."""

    def __init__(self, word: str, sentence: str, cannot_tell: bool = False) -> None:
        super().__init__(word, sentence)
        self.cannot_tell = cannot_tell

    NEEDS_CHANNELS = ("needs_channels", "This log cannot tell: it needs the channels {told}. ({meaning})", True)
    DOUBTFUL_VALUE = ("doubtful_value", "In the corrected model, but not certain: {told}. ({meaning})")
    OTHER_FORM = (
        "other_form",
        "In the corrected model, but perhaps only the nearest name for something else: {told}. ({meaning})",
    )
    LASTING_REST = ("lasting_rest", "In the corrected model, but not certain: on its axis, {told}. ({meaning})")
    UNJUDGED_RIVAL = (
        "unjudged_rival",
        "In the corrected model, but not certain: {told}, which needs a velocity that may be wrong and was not judged, "
        "would do as well. ({meaning})",
    )
    WORSE_UNSEEN = (
        "worse_unseen",
        "Not added: where it saw nothing of this log, the model with it {told}. ({meaning})",
    )
    NOT_IN_MOST_FOLDS = ("not_in_most_folds", "In the corrected model, but not certain: {told}. ({meaning})")
    MOSTLY_DOUBTED = (
        "mostly_doubted",
        "In the corrected model, but not certain: beside it {told} were found, and so half of it or more is doubtful. "
        "({meaning})",
    )
    UNTOLD = (
        "untold",
        "In the corrected model, but not certain: parts of the log that it did not see gain by it, but less than tells "
        "an effect from nothing. ({meaning})",
    )
    UNFOUND = ("unfound", "In the model because it was asked for, but not certain: {told}. ({meaning})")
    FAINT = ("faint", "{told}, but that is too near the sensor noise to name anything from. ({meaning})")
    LOOK_ALIKES = ("look_alikes", "This log cannot tell it from {told}: {lowered}")
    OUT_OF_STEP = (
        "out_of_step",
        "This log cannot tell: its channels are out of step by about {told} s, or may be, and that alone could look "
        "like it. ({meaning})",
        True,
    )
    AT_LIMIT = (
        "at_limit",
        "Doubtful: the log asks for more of it than physics allows, so it is something else. ({meaning})",
    )
    ROLLOUTS_OBJECT = (
        "rollouts_object",
        "Doubtful: the force balance asks for it, but open-loop rollouts get worse with it. ({meaning})",
    )
    NOT_EXCITED = (
        "not_excited",
        "This log cannot tell: it holds no manoeuvre in which it would show. ({meaning})",
        True,
    )
    ABSORBED = (
        "absorbed",
        "This log cannot tell: the calibrated parameters take up what it would do. ({meaning})",
        True,
    )
    NOISE = ("noise", "This log cannot tell: what would show it is hardly more than sensor noise. ({meaning})", True)
    CHANCE = (
        "chance",
        "Perhaps: in {told} rehearsals of nothing, with this log's own noise, some effect looked as good. ({meaning})",
    )
    WEAK = ("weak", "Perhaps: {lowered} The evidence is below what undertow demands.")
    NOT_FOUND = ("not_found", "Looked for and not found. ({meaning})")

    def tell(self, meaning: str, told: str = "") -> str:
        """The sentence.

        Parameters
        ----------
        meaning : what the catalogue says of the effect, a sentence
        told : what the evidence adds
        """
        return self.sentence.format(meaning=meaning, lowered=f"{meaning[0].lower()}{meaning[1:]}", told=told)
