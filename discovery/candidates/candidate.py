"""Candidates: effects that may be missing, nuisance parameters that every model has, and numbers held by a limit.

Mass, inertia and the centre of gravity are no nuisances: M nu_r_dot + C nu_r + D nu_r = tau holds for a multiple of all
its terms too, so a log shows masses and damping only in proportion to the thrust that the vehicle file gives, and of
mass and added mass only the sum.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from enum import Enum
from math import isfinite

from ...physics.effects import COMMAND_OFFSET, EFFECTS, PARAMETERS, Effect, Parameter
from ...physics.errors import RequestError
from ...physics.momentum_balance import values_of
from ...physics.motion import Motion
from ...physics.sources import assumed
from ...physics.vehicle import Vehicle, lacking

_LIGHTEST = 0.2
"""Share of a vehicle's mass from which masses are tried: who is five times wrong has taken another unit."""


class Kind(Enum):
    """Kind of a candidate: it decides the price, and the place in the findings."""

    EFFECT = "effect"
    """of the catalogue"""
    TERM = "term"
    """of the equation, which nobody has named"""
    NUISANCE = "nuisance"
    """a parameter of the nominal model that is calibrated while effects are judged: always in the model, free of price,
    never a finding"""
    SENSOR = "sensor"
    """an error of the log: in every model, free of price, and no property of the vehicle"""


@dataclass(frozen=True, slots=True)
class Candidate:
    """An effect, for one thruster where it concerns one, that may be missing from a vehicle.

    Attributes
    ----------
    key : unique name, `effect` or `effect[thruster]`
    effect : the catalogue's entry, or a made-up one for an unnamed term
    parameters : its parameters with the thruster's name filled in
    kind : see `Kind`
    part_of : keys of effects of which this is a special case: beside one of them it is left out
    """

    key: str
    effect: Effect
    parameters: tuple[Parameter, ...]
    kind: Kind = Kind.EFFECT
    part_of: tuple[str, ...] = ()

    @property
    def nuisance(self) -> bool:
        """True when it is fitted in every model."""
        return self.kind in (Kind.NUISANCE, Kind.SENSOR)

    @property
    def symbols(self) -> tuple[str, ...]:
        """Symbols of the parameters."""
        return tuple(p.symbol for p in self.parameters)

    def fitted(self, kept: Collection[str]) -> bool:
        """True when it is in a model with the keys `kept`: as one of them, or as what is in every model."""
        return self.key in kept or (self.nuisance and not any(key in kept for key in self.part_of))


def measurable(motions: Sequence[Motion]) -> tuple[Effect, ...]:
    """The effects whose channels are in all motions: without an anemometer, no apparent wind."""
    windless = any(motion.air is None for motion in motions)
    return tuple(effect for effect in EFFECTS if not (windless and effect.channels))


def candidates(vehicle: Vehicle, effects: Sequence[Effect] = EFFECTS) -> tuple[Candidate, ...]:
    """All candidates for a vehicle: one for each effect, one for each thruster where the effect concerns one.

    An effect that needs more than the vehicle file states is none: cross-flow drag without the size of the hull.
    """
    found = []
    for effect in effects:
        if lacking(vehicle, effect):
            continue
        if effect.per_thruster:
            for thruster in vehicle.thrusters:
                named = tuple(replace(p, symbol=p.symbol.format(thruster=thruster.name)) for p in effect.parameters)
                found.append(Candidate(f"{effect.name}[{thruster.name}]", effect, named))
        elif effect.name != "thrust_scale" or len(vehicle.thrusters) > 1:
            found.append(Candidate(effect.name, effect, tuple(_limited(p, vehicle) for p in effect.parameters)))
    return tuple(found)


def _limited(parameter: Parameter, vehicle: Vehicle) -> Parameter:
    """A parameter with limits that the vehicle sets."""
    lower = _LIGHTEST * vehicle.mass if parameter.symbol == "mass" else vehicle.parameter(parameter.symbol).lower
    return replace(parameter, lower=lower, upper=max(parameter.upper, vehicle.value(parameter.symbol)))


_BY_SWAY = ("X_udot", "Y_vdot", "x_g", "y_g", "mass", "memory_sway", "cross_flow")
"""What acts in sway, or is told from a scale of thrust and drag by forces there alone."""


def needs_sway(candidate: Candidate) -> bool:
    """True for a candidate that acts in sway, multiplies the sway velocity, or is told apart by such a force only."""
    return any(p.symbol in _BY_SWAY or p.axis == 1 or "v" in p.form for p in candidate.parameters)


_NEAR = 1e-3
"""Share of the room between a start and a limit within which an estimate is at the limit, by the precision of fits."""
_ROUNDING = 1e-5
"""Rounding of a solver's number that lies on a limit, as a share of one and the limit."""


def limit_at(parameter: Parameter, value: float, start: float | None = None) -> float | None:
    """The physical limit at which a value lies, if it does.

    Parameters
    ----------
    value : total, in the parameter's unit
    start : nominal value that the value has left; a limit at which it stood before holds nothing. None for a number
        that a solver under limits gave, which lies on one to rounding
    """
    for limit in (parameter.lower, parameter.upper):
        if not isfinite(limit):
            continue
        away = abs(value - limit)
        if away <= _ROUNDING * (1.0 + abs(limit)) if start is None else away < _NEAR * abs(limit - start):
            return limit
    return None


def limit_reached(parameter: Parameter, value: float, start: float) -> float | None:
    """The physical limit that an estimate has left its nominal value `start` for, where that is nothing usual.

    Nominal damping that vanishes is not at a limit: the file has a number for what is not there.
    """
    vanishes = parameter.upper == parameter.null == 0.0 and parameter.section == "damping"
    return None if parameter.attainable or vanishes else limit_at(parameter, value, start)


def at_limit(candidate: Candidate, nominal: Vehicle, vehicle: Vehicle) -> bool:
    """True when any parameter of an effect has reached a limit, see `limit_reached`."""
    values = ((p, vehicle.value(p.symbol), nominal.value(p.symbol)) for p in candidate.parameters)
    return any(limit_reached(*one) is not None for one in values)


def beyond_any_hull(candidate: Candidate, nominal: Vehicle, vehicle: Vehicle) -> bool:
    """True when any parameter of an effect has reached a limit that no boat is at.

    Zero is none: a thruster may give nothing, and a file may have a drag or a lag that is not there. Of masses it is.
    """
    values = ((p, limit_reached(p, vehicle.value(p.symbol), nominal.value(p.symbol))) for p in candidate.parameters)
    return any(limit is not None and (limit != 0.0 or p.section in ("added_mass", "top")) for p, limit in values)


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

    Parameters
    ----------
    vehicle : whose parameters they are
    free : symbols to calibrate without a value in the file
    hold : symbols to leave as they are

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
    """True when nobody measured a number that may be calibrated, as in a file that `init` wrote."""
    guessed = assumed(vehicle)
    own = calibratable(vehicle)
    return bool(own) and not {"all", *own, *(vehicle.parameter(symbol).section for symbol in own)}.isdisjoint(guessed)


def nuisance_candidates(vehicle: Vehicle, symbols: Sequence[str]) -> tuple[Candidate, ...]:
    """Candidates for parameters to be calibrated: one each, but one for an effect with both shape and amplitude."""
    found: dict[str, Candidate] = {}
    for symbol in symbols:
        parameter = replace(vehicle.parameter(symbol), symbol=symbol)  # with the thruster's name in it
        effect = next((e for e in EFFECTS if symbol in PARAMETERS and symbol in e.symbols), None)
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
    """The offset of the record of the commands in time, as a candidate that is part of every model.

    A record may be as old as the time to the next one, and what is averaged over steps of the time base is known to one
    of them; by no more may the log be out of step with itself.
    """
    reach = max(max(motion.command_step, motion.time_step) for motion in motions)
    parameter = replace(COMMAND_OFFSET, lower=-reach, upper=reach)
    entry = Effect(parameter.symbol, "record", (parameter,), "", "Commands act earlier or later than the log says.")
    return Candidate(parameter.symbol, entry, (parameter,), Kind.SENSOR, part_of=("input_delay", "calibrated delay"))


def remaining_candidates(pool: Sequence[Candidate], freed: Sequence[str]) -> tuple[Candidate, ...]:
    """Candidates beside freed parameters: each without them, if anything is left of it."""
    left = []
    for candidate in pool:
        parameters = tuple(p for p in candidate.parameters if p.symbol not in freed)
        whole = len(parameters) == len(candidate.parameters)
        if whole or (parameters and not candidate.effect.shapes):
            left.append(candidate if whole else replace(candidate, parameters=parameters))
    return tuple(left)
