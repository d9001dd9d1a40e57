"""All laws, in the order in which they are told: every `Law` that a file of this folder defines."""

from collections.abc import Callable

from ...members import classes_in
from .. import audit
from .base import Law

_KINDS: tuple[Callable[[], Law], ...] = classes_in(audit, Law)
LAWS: tuple[Law, ...] = tuple(sorted((kind() for kind in _KINDS), key=lambda law: law.place))
