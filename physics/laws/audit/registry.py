"""All laws, in the order in which they are told: every `Law` that a file of this folder defines."""

from collections.abc import Callable, Iterable

from ...registry_members import classes_in
from .. import audit
from .base import Law


def _told(kinds: Iterable[Callable[[], Law]]) -> tuple[Law, ...]:
    return tuple(sorted((kind() for kind in kinds), key=lambda law: law.place))


LAWS: tuple[Law, ...] = _told(classes_in(audit, Law))
