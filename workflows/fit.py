"""The verb `fit`: from logs and a vehicle to calibrated parameters, scored before and after on held-out data."""

from collections.abc import Sequence
from dataclasses import dataclass

from ..comparison.comparison import score_step
from ..discovery.basis import DiscoverySettings
from ..discovery.calibration.calibrate import Calibration, calibrate
from ..discovery.findings import NotCalibrated, Step
from ..measurements.prepared_logs import INPUTS_CURE, Inputs
from ..physics.errors import expect
from ..physics.motion import AXES, FORCE_UNITS
from ..physics.presentation import Card, each, listing, number
from ..physics.reading import Plain
from ..physics.sources import with_sources
from ..physics.stage import Say, Stage
from ..physics.vehicle import Vehicle
from ..reports.page.outcome import gets_worse, hero
from ..reports.terminal.progress import SHOWN, showing
from ..residuals.models.base import VehicleModel
from ..residuals.scores import ROLLOUT_UNITS, evaluate

FIT_SCHEMA = "undertow.fit/1"
_UNEXPLAINED = (2.0, 0.05)
"""Multiple of sensor noise, and share of the force scale, above which the force that is left is worth a sentence: four
times the power of noise, and more than twice the share from which an effect matters."""


@dataclass(frozen=True, slots=True, repr=False)
class FitRun(Card):
    """A finished calibration, scored.

    Attributes
    ----------
    inputs : logs and nominal vehicle
    calibration : what was fitted
    steps : errors of the nominal and of the calibrated vehicle on held-out data, as in `findings.json`
    """

    inputs: Inputs
    calibration: Calibration
    steps: tuple[Step, ...]

    def card(self) -> list[tuple[str, str]]:
        """See `Card`."""
        fitted = [f"{p.symbol} {number(p.before)} -> {number(p.after)}" for p in self.calibration.parameters]
        warned = each("warnings", self.inputs.warnings)
        return [*warned, *each("done", self.sentences), ("fitted", ", ".join(fitted)), ("logs", self.inputs.log_names)]

    @property
    def vehicle(self) -> Vehicle:
        """The calibrated vehicle; its `sources` say which numbers were fitted, and from which logs."""
        found = self.calibration
        how = f"fitted by undertow to {self.inputs.log_names} ({found.method})"
        return with_sources(found.nominal, found.vehicle, how)

    @property
    def sentences(self) -> list[str]:
        """Sentences on the fit, and what to think of it."""
        found, count = self.calibration, len(self.calibration.parameters)
        texts = [f"Calibrated {count} parameter{'s' * (count > 1)} of {found.nominal.name} ({found.method})."]
        deciding = f"{found.horizon:g}"
        led = hero(self.steps, deciding)
        here = gets_worse(self.steps, deciding)
        if found.worse or here:
            errors = f" ({led.in_words} {number(led.before, 2)} {led.unit} before, {number(led.after, 2)} after)" * here
            texts.append(
                f"It predicts rows that it did not see worse than the file does{errors}: the model lacks something "
                "else. Keep the file's numbers, and see what is missing with discover."
            )
        texts += [f"{note[0].upper()}{note[1:]}." for note in found.notes]
        left = [
            f"{axis} ({f:.2g} {unit}, of it {n:.2g} {unit} sensor noise)"
            for axis, f, n, s, unit in zip(
                AXES, found.force_error, found.noise_error, found.force_scale, FORCE_UNITS, strict=True
            )
            if f > max(_UNEXPLAINED[0] * n, _UNEXPLAINED[1] * s)
        ]
        if left:
            texts.append(
                f"Force stays unexplained in {listing(left)}: no values of these parameters explain it, and they may "
                "have absorbed a part of it. See what is missing with discover --refit."
            )
        return texts

    @property
    def left(self) -> tuple[NotCalibrated, ...]:
        """Parameters that stay as they were, and why."""
        return tuple(NotCalibrated(symbol=symbol, why=why) for symbol, why in self.calibration.reasons.items())

    def to_dict(self) -> Plain:
        """As `fit --json` prints it (schema `undertow.fit/1`)."""
        found, weak = self.calibration, self.inputs.weak
        nominal = found.nominal
        parts = (weak.train, weak.validation, weak.test)
        return {
            "schema": FIT_SCHEMA,
            "warnings": list(self.inputs.warnings),
            "sentences": self.sentences,
            "method": found.method,
            "parameters": [p.to_dict() for p in found.parameters],
            "left": [
                {"symbol": s, "value": nominal.value(s), "unit": nominal.parameter(s).unit, "why": why}
                for s, why in found.reasons.items()
            ],
            "steps": [step.to_dict() for step in self.steps],
            "chosen_by": {
                "horizon": found.horizon,
                "rollout_rmse": {
                    name: dict(zip(AXES, map(float, error), strict=True)) for name, error in found.held_out.items()
                },
                "units": {axis: ROLLOUT_UNITS[axis] for axis in AXES},
            },
            "passivity": found.lawful.passivity.to_dict(),
            "data": {
                "rows": sum(part.rows for part in parts),
                "seconds": sum(part.seconds for part in parts),
                "split": f"chronological {'/'.join(f'{100 * s:.0f}' for s in weak.train.recipe.shares)}",
                "notes": [*self.inputs.notes, *found.notes],
            },
        }


@showing
def fit(
    inputs: Inputs,
    free: Sequence[str] = (),
    hold: Sequence[str] = (),
    settings: DiscoverySettings | None = None,
    *,
    progress: Say | None = SHOWN,
) -> FitRun:
    """Calibrate the parameters that the vehicle model has, and score before and after on held-out data.

    Parameters
    ----------
    inputs : logs and nominal vehicle, see `read_inputs`
    free, hold : symbols to calibrate beside those that have a value in the file, and symbols to leave
    settings : its seed is used
    progress : called with lines about the work, shown where nothing is said; None for silence

    Raises
    ------
    RequestError
        for an unknown symbol, a log that identifies nothing or is too short, or a vehicle that cannot be made lawful.
    """
    expect("fit: inputs", inputs, Inputs, INPUTS_CURE)
    inputs = inputs.parted("fit")
    found = calibrate(inputs.fitting, inputs.vehicle, free, hold, settings, progress)
    if progress is not None:
        progress(Stage("scoring before and after on held-out data"))
    models = (
        VehicleModel(inputs.vehicle, "nominal", "physics"),
        VehicleModel(found.vehicle, "calibrated", "physics", parameters=len(found.parameters)),
    )
    steps = tuple(
        score_step(evaluate(model, inputs.parts.judged), label)
        for label, model in zip((None, "calibrated"), models, strict=True)
    )
    return FitRun(inputs, found, steps)
