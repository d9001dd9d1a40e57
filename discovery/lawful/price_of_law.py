"""Price of a law: what it costs a fit, in which state it binds, its multiplier, and the sentence for it."""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import AliasChoices, BeforeValidator, Field, PlainSerializer

from ...physics.file_records import Number, Record
from ...physics.laws.damping_power import Envelope, State, state_in_words

NOTHING = 1e-6
"""A relative price below this is none."""


def _by_name(state: State) -> dict[str, float]:
    return dict(zip("uvr", state, strict=True))


def _state(content: object) -> object:
    """(u, v, r) from a file, which has them by name."""
    if not isinstance(content, Mapping):
        return content
    if set(content) != set("uvr"):
        raise ValueError("numbers named u, v and r")
    return tuple(content[name] for name in "uvr")


def _envelope(content: object) -> object:
    """An envelope from a file, which has [lower, upper] by velocity."""
    if not isinstance(content, Mapping):
        return content
    try:
        (u0, u1), (v0, v1), (r0, r1) = (map(float, content[name]) for name in "uvr")
        return Envelope((u0, v0, r0), (u1, v1, r1))
    except (KeyError, TypeError, ValueError):
        raise ValueError("[lower, upper] about rest for each of u, v and r") from None


Velocities = Annotated[State, BeforeValidator(_state), PlainSerializer(_by_name)]
"""A state (u, v, r) [m/s, m/s, rad/s], which files have by name."""
Box = Annotated[Envelope, BeforeValidator(_envelope), PlainSerializer(Envelope.to_dict)]
"""An envelope, which files have as [lower, upper] by velocity."""


class Binding(Record):
    """The state in which the law of dissipation holds the fit most.

    Attributes
    ----------
    state : corner of the envelope (u, v, r) [m/s, m/s, rad/s]; `at` in the file
    multiplier : share of the misfit that 1 W more at this corner would save [1/W]
    symbol : the parameter that the law moves most, weighed by what that costs
    wanted, allowed : its value without and with the law
    unit : of the parameter
    """

    state: Velocities = Field(validation_alias=AliasChoices("state", "at"), serialization_alias="at")
    multiplier: Number
    multiplier_unit: str = "share of the misfit for 1 W"
    symbol: str
    wanted: Number
    allowed: Number
    unit: str


class MostPower(Record):
    """The largest power that damping puts into the hull [`unit`], as a random search found it, and in which state."""

    value: Number
    unit: str = "W"
    at: Velocities


class Passivity(Record):
    """Passivity of a model's damping over an envelope, and what that cost the fit.

    Attributes
    ----------
    proof : "vertex LMI" where matrix inequalities prove it; "search" where the verdict rests on 1e5 random states
    envelope : velocities relative to the water for which it holds
    price : relative rise of the misfit against the fit without the law
    binding : where the law binds; None where it costs nothing
    worst : the largest power that a random search found
    sentence : the same in words
    """

    verdict: Literal["pass", "fail"]
    proof: Literal["vertex LMI", "search"]
    envelope: Box
    price: Number
    binding: Binding | None = None
    worst: MostPower
    sentence: str


def price_in_words(price: float, binding: Binding | None, kept: bool, nominal: str) -> str:
    """The price of passivity as a sentence.

    >>> price_in_words(0.0, None, True, 'Otter')
    'Passivity costs nothing: the best fit takes energy out of the hull everywhere in the envelope.'
    """
    where = "everywhere in the envelope"
    if kept and (binding is None or price <= NOTHING):
        return f"Passivity costs nothing: the best fit takes energy out of the hull {where}."
    short = (
        ""
        if kept
        else (
            f"The damping of {nominal} creates energy in a part of the envelope, and the added effects cannot mend "
            "that; the corrected model is held to be no worse. "
        )
    )
    if binding is None or price <= NOTHING:
        return short + "That costs nothing."
    law = "Passivity" if kept else "That"
    cost = f"costs {percent(price)} of fit" if price < 10.0 else f"makes the misfit {1.0 + price:.0f} times as large"
    watts = next((w for w in (1.0, 0.1, 0.01, 1e-3) if binding.multiplier * w <= 0.5), 1e-4)
    at = "at rest" if not any(binding.state) else f"at {state_in_words(binding.state)}"
    return (
        f"{short}{law} {cost}. It binds {at}: {binding.symbol} wants {binding.wanted:.4g} "
        f"{binding.unit} and is held at {binding.allowed:.4g}; {watts:g} W more there would save "
        f"{percent(binding.multiplier * watts)} of the misfit."
    )


def percent(share: float) -> str:
    """A share in per cent with two digits that matter; a multiple from ten on.

    >>> percent(0.00312), percent(0.25), percent(41.0)
    ('0.31 %', '25 %', '41 times')
    """
    return (
        f"{share:.0f} times" if share >= 10.0 else f"{100.0 * share:.2g} %" if share < 1.0 else f"{100 * share:.0f} %"
    )
