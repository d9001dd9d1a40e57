"""What every controller is: a belief and a track in, forces of the thrusters out."""

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

from ..physics.frames import Array
from .known_model import KnownModel
from .observer import Observer
from .tracks import Track


class Asked(NamedTuple):
    """What a controller asks for, to be reached at the end of the period.

    Attributes
    ----------
    force : (thrusters,) [N]
    advance : surge speed through the water at which the forces are meant [m/s]; 0 for forces at rest
    solved : whether what it solves was solved; where not, it asks for what it had planned before
    """

    force: Array
    advance: float = 0.0
    solved: bool = True


class Controller(ABC):
    """A controller that knows one model.

    Parameters
    ----------
    known : its model
    track : that it is to follow

    Attributes
    ----------
    name : how the command line calls it
    """

    name: ClassVar[str]

    def __init__(self, known: KnownModel, track: Track) -> None:
        self.known, self.track = known, track

    @abstractmethod
    def ask(self, observer: Observer) -> Asked:
        """Forces for what is believed now."""
