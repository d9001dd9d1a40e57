"""Settings of the training recipe, checked where they are made."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from math import isfinite
from numbers import Integral
from typing import TYPE_CHECKING, Literal

from ...physics.errors import RequestError

if TYPE_CHECKING:
    from ..models.network_model import NetworkModel
    from .probes import Probed

MOVED = ("learning_rate", "weight_decay", "rollout_rows")
"""Settings that a search within `minutes` may move, see `best_kind`."""
Schedule = Literal["fixed", "cosine"]
Device = Literal["auto", "cpu", "cuda"]


@dataclass(frozen=True, slots=True)
class Choice:
    """Choice of the network that is trained.

    Attributes
    ----------
    network, options : a name and options of `networks.registry`
    pure : it stands in the place of the physics, not beside it
    heading : it sees the heading
    start : a network that it goes on from, see `preparation`; None for fresh weights
    probes : those of this choice, where they were trained before, see `probes`; None to train them
    """

    network: str
    options: Mapping[str, int | float] | None = None
    pure: bool = False
    heading: bool = False
    start: "NetworkModel | None" = None
    probes: "Probed | None" = None


@dataclass(frozen=True, slots=True)
class Augmentation:
    """Random changes of the training data, anew in every epoch; all off by default.

    Attributes
    ----------
    speed_noise : white noise on the u and v that the network sees [m/s]
    yaw_rate_noise : white noise on the r that it sees [rad/s]
    thrust_spread : each thrust that it sees times 1 +- this, drawn for each window
    hull_spread : the physics beside the network is that of a sister hull, each parameter within this share of the
        vehicle's, drawn for each window from eight sisters; the target moves with it
    """

    speed_noise: float = 0.0
    yaw_rate_noise: float = 0.0
    thrust_spread: float = 0.0
    hull_spread: float = 0.0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not 0.0 <= value < (1.0 if name.endswith("spread") else 100.0):
                raise RequestError(f"augmentation: expected {name} of 0 or more, a spread below 1, got {value}")


@dataclass(frozen=True, slots=True)
class TrainingSettings:
    """The recipe.

    Attributes
    ----------
    epochs : at most
    patience : epochs without a better validation error after which training stops
    batch : windows a step at most; of few windows fewer, so that an epoch has 16 steps
    window : length of a window [s]
    overlap : share of a window that the next one repeats
    huber : error beyond which the loss grows by its size, not by its square, in the units of the error; 0 for squares.
        At 2, rare jumps of a force count for little, and on one of Gazebo's tuning runs they are half of the error
    averaging : share of the average of the weights that each step leaves; judged and kept is that average; 0 for none
    learning_rate : of Adam, at the start
    schedule : "fixed", or "cosine" from the learning rate down to a hundredth of it over `epochs`
    weight_decay : decoupled (Loshchilov and Hutter 2019)
    clip : largest norm of a gradient
    lambda_data : weight of |acceleration error|^2, each axis in units of what the vehicle leaves unexplained
    lambda_phys : weight of |power beyond the laws|^2 in units of the boat's typical power, see `physics.laws.energy`
    lambda_smooth : weight of |change of the correction from row to row|^2, in the units of the error
    lambda_rollout : weight of |velocity error of short rollouts|^2; used where `rollout_rows` is above 0
    rollout_rows : steps of those rollouts; 0 for none
    sensor_noise : multiple of the log's own sensor noise that is drawn anew onto the velocities that a network with
        memory sees in training. Without it the network learns to differentiate them, noise and all: it then "predicts"
        the noise of the measured acceleration better than the true model could, and rolls out worse
    minutes : in which other sizes and settings are tried, too, and other networks where the best is asked for, see
        `best_kind`: about so long this and the training take; 0 for none
    trust : multiply the correction of a hybrid by the gain that parts of the log tell which it does not know, see
        `networks.trust`; else it is said whole everywhere
    decline : do not train a kind that was named beside a vehicle whose error is no more than the noise of the sensors,
        nor the best of all where none holds on other parts of the log (`undertow.train`)
    augmentation : of the training data
    seed : decides the weights at the start, the order of windows and all else that is random
    device : "auto" is the processor, which is the faster one for most networks: `benchmarks/training_on_a_gpu.py`

    Raises
    ------
    RequestError
        when a setting cannot be used.
    """

    epochs: int = 150
    patience: int = 150
    batch: int = 16
    window: float = 10.0
    overlap: float = 0.75
    huber: float = 0.0
    averaging: float = 0.99
    learning_rate: float = 1e-2
    schedule: Schedule = "cosine"
    weight_decay: float = 1e-4
    clip: float = 1.0
    lambda_data: float = 1.0
    lambda_phys: float = 100.0
    lambda_smooth: float = 0.01
    lambda_rollout: float = 10.0
    rollout_rows: int = 0
    sensor_noise: float = 1.0
    minutes: float = 0.0
    trust: bool = True
    decline: bool = True
    augmentation: Augmentation = field(default_factory=Augmentation)
    seed: int = 0
    device: Device = "auto"

    def __post_init__(self) -> None:
        for name, least in (("epochs", 1), ("patience", 1), ("batch", 1), ("rollout_rows", 0), ("seed", 0)):
            value = getattr(self, name)
            if not isinstance(value, Integral) or isinstance(value, bool) or value < least:
                raise RequestError(f"training: expected a whole number of at least {least} for {name}, got {value!r}")
        for name in ("trust", "decline"):
            if getattr(self, name) not in (False, True):
                raise RequestError(f"training: expected {name} 0 or 1, got {getattr(self, name)!r}")
        for name in ("window", "learning_rate", "clip"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise RequestError(f"training: expected a positive {name}, got {getattr(self, name)!r}")
        weights = ("weight_decay", "lambda_data", "lambda_phys", "lambda_smooth", "lambda_rollout")
        for name in (*weights, "sensor_noise", "huber", "minutes"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise RequestError(f"training: expected {name} of 0 or more, got {getattr(self, name)!r}")
        for name in ("overlap", "averaging"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise RequestError(f"training: expected {name} of 0 or more and below 1, got {getattr(self, name)!r}")
        for name, known in (("schedule", ("fixed", "cosine")), ("device", ("auto", "cpu", "cuda"))):
            if getattr(self, name) not in known:
                raise RequestError(f"training: expected {name} {' or '.join(known)}, got {getattr(self, name)!r}")

    def to_dict(self) -> dict[str, object]:
        """As plain data."""
        return asdict(self)
