"""The verb `explain`: what of a model's correction is a named effect, what has no name, and what is memory."""

import os

from ..comparison.models_by_name import MODEL_CURE, check_commands, load_model
from ..discovery.distillation.distil import distil_model
from ..discovery.distillation.distilled import Distilled
from ..discovery.settings import DiscoverySettings
from ..measurements.prepared_logs import INPUTS_CURE, Inputs, PathLike
from ..physics.errors import expect
from ..physics.stage import Say
from ..reports.terminal.progress import SHOWN, showing
from ..residuals.models.base import Model


@showing
def distil(
    model: Model | PathLike,
    inputs: Inputs,
    settings: DiscoverySettings | None = None,
    *,
    progress: Say | None = SHOWN,
) -> Distilled:
    """Say what of a model's correction is a named effect, and what remains.

    The correction is what the model adds to the inputs' vehicle along the training and validation parts at 10 Hz, the
    rate that networks know.

    Parameters
    ----------
    model : a network, or any model of accelerations that takes the commands of the vehicle; or its folder or file
    inputs : logs and nominal vehicle, see `read_inputs`
    settings : of the search, its seed among them
    progress : called with lines about the work, shown where nothing is said; None for silence

    Raises
    ------
    RequestError
        when the model cannot be read or takes other commands, the logs are too short, or the model gives accelerations
        that are not finite.
    """
    expect("distil: inputs", inputs, Inputs, INPUTS_CURE)
    expect("distil: model", model, (Model, str, os.PathLike), MODEL_CURE)
    if not isinstance(model, Model):
        model = load_model(model)
    check_commands(model, inputs)
    parts = inputs.parted("explain").parts.split
    return distil_model(model, (*parts.train.motions, *parts.validation.motions), inputs.vehicle, settings, progress)
