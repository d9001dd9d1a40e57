"""Nuisances: the numbers of a nominal model that a log may correct, as candidates that are always in the model.

Mass, inertia and the centre of gravity are not among them. The balance M nu_r_dot + C nu_r + D nu_r = tau holds as
well for a multiple of all its terms, so that a log tells masses and damping only in proportion to the thrust that the
vehicle file gives; and of mass and added mass it shows the sum.
"""

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches

from ...physics.effects import COMMAND_OFFSET, EFFECTS, PARAMETERS, Effect, Parameter
from ...physics.errors import RequestError
from ...physics.momentum_balance import values_of
from ...physics.motion import Motion
from ...physics.sources import assumed
from ...physics.vehicle import Vehicle
from .candidate import Candidate, Kind

RIGID_BODY = ("mass", "inertia_z", "x_g")
"""What a scale and a drawing tell; held unless the user frees x_g."""
_WHY_NOT = {
    COMMAND_OFFSET.symbol: "it is an error of the log, and discovery fits it; a boat that answers late has a delay",
    "mass": "free X_udot and Y_vdot: of mass and added mass a log shows the sum",
    "inertia_z": "free N_rdot: of inertia and added inertia a log shows the sum",
}


CALIBRATED = "calibrated"
"""Label of the step at which the parameters of the nominal model were calibrated."""


def calibratable(vehicle: Vehicle, free: Sequence[str] = (), hold: Sequence[str] = ()) -> tuple[str, ...]:
    """Symbols of the parameters to calibrate: those with a value in the file, and `free`, without `hold`.

    Mass, inertia_z and x_g are held; x_g may be freed.

    Raises
    ------
    RequestError
        for a symbol that the vehicle does not know, one that cannot be freed, or one both freed and held.
    """
    for symbol in (*free, *hold):
        if symbol not in vehicle.values:
            near = get_close_matches(symbol, vehicle.values, n=1, cutoff=0.0)
            raise RequestError(f"unknown parameter {symbol!r} of {vehicle.name}: did you mean {near[0]!r}?")
        if symbol in free and symbol in hold:
            raise RequestError(f"{symbol} is both freed and held; say one of the two")
    for symbol in free:
        if symbol in _WHY_NOT:
            raise RequestError(f"{symbol} cannot be calibrated; {_WHY_NOT[symbol]}")
        if len(values_of(vehicle, symbol)) > 1:
            raise RequestError(
                f"{symbol} differs from thruster to thruster, and is calibrated as one number; give the thrusters of "
                f"{vehicle.name} the same {symbol}, or free the scale of each"
            )
    given = [
        symbol
        for symbol, value in vehicle.values.items()
        if symbol not in RIGID_BODY and value != vehicle.parameter(symbol).null and len(values_of(vehicle, symbol)) == 1
    ]
    wanted = {*given, *free}
    for effect in EFFECTS:  # a shape and its amplitudes are one effect, and stand or fall together
        if effect.shapes and effect.amplitudes:
            amplitudes = {p.symbol for p in effect.amplitudes}
            wanted = wanted | set(effect.symbols) if wanted & amplitudes else wanted - set(effect.symbols)
    return tuple(symbol for symbol in vehicle.values if symbol in wanted and symbol not in hold)


def holds_guesses(vehicle: Vehicle) -> bool:
    """Whether nobody measured a number that may be calibrated, as in a file that `init` wrote."""
    guessed = assumed(vehicle)
    own = calibratable(vehicle)
    return bool(own) and not {"all", *own, *(vehicle.parameter(symbol).section for symbol in own)}.isdisjoint(guessed)


def nuisance_candidates(vehicle: Vehicle, symbols: Sequence[str]) -> tuple[Candidate, ...]:
    """Candidates for parameters to be calibrated: one each, but one for an effect with both shape and amplitude."""
    found: dict[str, Candidate] = {}
    for symbol in symbols:
        parameter = _of(vehicle, symbol)
        effect = _effect_of(symbol)
        if effect is not None and effect.shapes and effect.amplitudes:
            parameters = tuple(p for p in effect.parameters if p.symbol in symbols)
            name = effect.name
        else:
            parameters, name = (parameter,), symbol
        key = f"calibrated {name}"
        entry = Effect(
            name,
            "calibration",
            parameters,
            "",
            f"The value of {name} in the vehicle file is not this boat's.",
            added=False,
            fixed_amplitude=effect is not None and effect.fixed_amplitude,
        )
        found[key] = Candidate(key, entry, parameters, kind=Kind.NUISANCE)
    return tuple(found.values())


def command_timing(motions: Sequence[Motion]) -> Candidate:
    """How much earlier or later than they acted the commands of a log were recorded, as a part of every model.

    A record may be as old as the time to the next one, and what is averaged over steps of the time base is known to one
    of them; by no more may the log be out of step with itself.
    """
    reach = max(max(motion.command_step, motion.time_step) for motion in motions)
    parameter = replace(COMMAND_OFFSET, lower=-reach, upper=reach)
    entry = Effect(parameter.symbol, "record", (parameter,), "", "Commands act earlier or later than the log says.")
    return Candidate(parameter.symbol, entry, (parameter,), Kind.SENSOR, part_of=("input_delay", "calibrated delay"))


def beside(pool: Sequence[Candidate], freed: Sequence[str]) -> tuple[Candidate, ...]:
    """What may still be missing beside freed parameters: each candidate without them, if anything is left of it."""
    left = []
    for candidate in pool:
        parameters = tuple(p for p in candidate.parameters if p.symbol not in freed)
        whole = len(parameters) == len(candidate.parameters)
        if whole or (parameters and not candidate.effect.shapes):
            left.append(candidate if whole else replace(candidate, parameters=parameters))
    return tuple(left)


def _of(vehicle: Vehicle, symbol: str) -> Parameter:
    parameter = vehicle.parameter(symbol)
    if "{" not in parameter.symbol:
        return parameter
    return replace(parameter, symbol=symbol)


def _effect_of(symbol: str) -> Effect | None:
    return next((e for e in EFFECTS if symbol in PARAMETERS and symbol in e.symbols), None)
