"""Ridge regression on hydrodynamic monomials (Hoerl and Kennard 1970), with filters of the past where it has any."""

from typing import ClassVar, final

import torch
from torch import Tensor, nn

from .base import Grown, Memory, Network, Scaling, fixed

TIMES = (0.5, 1.0, 2.0, 4.0, 8.0, 0.25)
"""Times of the filters [s], in the order in which they are taken."""
_EVERYWHERE, _TIME_STEP = 1e9, 0.1
"""Ends of the inputs, and the time step [s], before training knows them."""


@final
class Ridge(Network):
    """A sum of products of velocities, thrusts and the heading, linear in its coefficients.

    The products are those of which manoeuvring models consist (Fossen 2021, sections 6.3 to 6.5: linear and quadratic
    damping, couplings of two velocities, cubes, thrust that speed or drift takes away), each for itself. With
    `filters` the differences of each input from its first-order filters stand beside them, akin to Laguerre models
    (Wahlberg 1991, doi:10.1109/9.76361). The coefficients are found by `training.tabular_fit`, not by steps
    along a gradient; before, it says nothing. Inputs are held within `lower` and `upper`: a polynomial knows no end.
    """

    factors: Tensor
    name: ClassVar[str] = "ridge"
    starts_settled = True
    grown: ClassVar[Grown | None] = Grown("coefficients", "fitted")

    def __init__(self, scaling: Scaling, *, filters: int = 0) -> None:
        super().__init__(scaling, {"filters": filters})
        self.states = 3 + scaling.drives
        everywhere = torch.full((self.states,), _EVERYWHERE)
        self.lower, self.upper, self.share = (fixed(x) for x in (-everywhere, everywhere, self.shares(_TIME_STEP)))
        every = [product for group in products(scaling.drives, self.width - self.states) for product in group]
        self.register_buffer("factors", torch.tensor(every))
        # What the correction is proportional to, as in the other networks.
        self.head = nn.ParameterDict({"weight": fixed(torch.zeros(3, sum(self.groups)))})

    def shares(self, time_step: float) -> Tensor:
        """Share of the way to its input that each filter goes in a step [s], (filters,)."""
        return 1.0 - torch.exp(-time_step / torch.tensor(TIMES[: int(self.options["filters"])]))

    @property
    def unit(self) -> Tensor:
        """Root mean square of the velocities and thrusts of the training (states,), in their units."""
        return torch.hypot(self.input_mean, self.input_scale)[: self.states]

    def correct(self, standardised: Tensor, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """See `Network.correct`."""
        seen, memory = self.regressors(inputs, memory)
        return seen @ self.head["weight"].mT, memory

    def regressors(self, inputs: Tensor, memory: Memory | None) -> tuple[Tensor, Memory]:
        """The products (batch, rows, products) at inputs (batch, rows, inputs) in SI units, and the filters then."""
        unit, lower, upper, share = (x.to(inputs) for x in (self.unit, self.lower, self.upper, self.share))
        held = inputs[..., : self.states].clamp(lower, upper) / unit
        factors = torch.cat([torch.ones_like(held[..., :1]), held, held.abs(), inputs[..., self.states :]], dim=-1)
        first, second, third = self.factors.to(inputs.device).unbind(dim=1)
        seen = factors[..., first] * factors[..., second] * factors[..., third]
        if not share.numel():
            return seen, ()
        share, lags = share[:, None], []
        state = memory[0].unflatten(1, (len(share), -1)) if memory else held[:, :1].expand(-1, len(share), -1)
        for now in held.unbind(dim=1):
            state = state + share * (now[:, None] - state)
            lags.append((now[:, None] - state).flatten(1))
        return torch.cat([seen, torch.stack(lags, dim=1)], dim=-1), (state.flatten(1),)

    @property
    def groups(self) -> list[int]:
        """Number of products in each group that is shrunk alike: of `products`, then of each filter."""
        found = [len(group) for group in products(self.scaling.drives, self.width - self.states)]
        return [*found, *[self.states] * int(self.options["filters"])]


def products(drives: int, angles: int) -> list[list[tuple[int, ...]]]:
    """Products by groups, each of three of the factors 1, u, v, r, thrusts, their absolute values, cos psi, sin psi.

    Parameters
    ----------
    drives : number of thrusts
    angles : 2 where the network sees the heading, else 0
    """
    states = 3 + drives
    (one, u, v, r), thrusts = range(4), range(4, states + 1)
    au, av, ar = (x + states for x in (u, v, r))
    squares = [(u, au), (v, av), (r, ar), (u, v), (u, r), (v, r), (au, v), (au, r), (av, r), (ar, v), (av, u), (ar, u)]
    groups: list[list[tuple[int, ...]]] = [
        [(x,) for x in (one, u, v, r, *thrusts)],
        squares,
        [(au,), (av,), (ar,), (u, u), (v, v), (r, r)],
        [(t, x) for t in thrusts for x in (t + states, t, u)] + [(t + states, u) for t in thrusts],
        [(t, *x) for t in thrusts for x in ((v,), (r,), (av,), (ar,), (v, v), (r, r))],
        [(u, u, u), (v, v, v), (r, r, r), (u, v, r), *((x, x, y) for x in (u, v, r) for y in (u, v, r) if x != y)],
    ]
    if angles:
        cos, sin = 2 * states + 1, 2 * states + 2
        turned = [(x, angle) for angle in (cos, sin) for x in (one, u, v, r, au, av, ar)]
        groups.append([*turned, (cos, cos), (cos, sin)])
    return [[(*product, one, one)[:3] for product in group] for group in groups]
