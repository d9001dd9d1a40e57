"""What a law costs a fit, and where: the binding corner, the multiplier, and both in words."""

from dataclasses import dataclass

from ..physics.laws import State, state_in_words

NOTHING = 1e-6
"""A relative price below this is none."""


@dataclass(frozen=True, slots=True)
class Binding:
    """Where the law of dissipation holds the fit most.

    Attributes
    ----------
    state : corner of the envelope (u, v, r) [m/s, m/s, rad/s]
    multiplier : share of the misfit that 1 W more at this corner would save [1/W]
    symbol : the parameter that the law moves most, weighed by what that costs
    wanted, allowed : its value without and with the law
    unit : of the parameter
    """

    state: State
    multiplier: float
    symbol: str
    wanted: float
    allowed: float
    unit: str

    def to_dict(self) -> dict[str, object]:
        """As `findings.json` writes it."""
        return {
            "at": dict(zip("uvr", self.state, strict=True)),
            "multiplier": self.multiplier,
            "multiplier_unit": "share of the misfit for 1 W",
            "symbol": self.symbol,
            "wanted": self.wanted,
            "allowed": self.allowed,
            "unit": self.unit,
        }


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
