"""Values of parameters as a vehicle states them: one for all thrusters, or each with its own."""

from .vehicle import SHARED_THRUSTER_KEYS, Vehicle


def values_of(vehicle: Vehicle, symbol: str) -> tuple[float, ...]:
    """The value of a parameter, or those of all thrusters where each has its own and they differ.

    Raises
    ------
    VehicleError
        for a symbol that no parameter or term of this vehicle bears.
    """
    if symbol not in SHARED_THRUSTER_KEYS:
        return (vehicle.value(symbol),)
    own = tuple(getattr(thruster, symbol) for thruster in vehicle.thrusters)
    return own if len(set(own)) > 1 else own[:1]


def amount(vehicle: Vehicle, symbol: str, digits: int, unit: str = "") -> str:
    """The value of a parameter in words, with the names of thrusters where they differ in it."""
    behind = "" if unit in ("1", "-") else unit
    own = [f"{value:.{digits}g} {behind}".rstrip() for value in values_of(vehicle, symbol)]
    if len(own) == 1:
        return own[0]
    return ", ".join(f"{x} ({t.name})" for x, t in zip(own, vehicle.thrusters, strict=True))


def stated(vehicle: Vehicle, symbol: str, digits: int, unit: str = "") -> str:
    """A parameter and its value in words, see `amount`."""
    return f"{symbol} = {amount(vehicle, symbol, digits, unit)}"
