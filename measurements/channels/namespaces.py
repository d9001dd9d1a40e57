"""Namespaces: the vehicles that share one log, told by their topics."""

from collections import defaultdict
from collections.abc import Sequence
from itertools import takewhile

from ...physics.errors import LogError
from ..canonical import command_kind
from ..formats.base import Name
from .recognition import recognise

_PLACES = (frozenset({"x", "y"}), frozenset({"lat", "lon"}), frozenset({"u", "v"}), frozenset({"x_dot", "y_dot"}))
_HEADINGS = (frozenset({"psi"}), frozenset({"qx", "qy", "qz", "qw"}))


def is_under(topic: str, namespace: str) -> bool:
    """Whether a topic lies in a namespace; slashes at its ends do not matter.

    >>> is_under("/alpha/odometry", "alpha"), is_under("/alphabet/odometry", "alpha")
    (True, False)
    """
    return f"{topic.strip('/')}/".startswith(f"{namespace.strip('/')}/")


def vehicles(names: Sequence[Name]) -> tuple[str, ...]:
    """Name the namespaces of several vehicles, sorted; empty when one vehicle may have written everything.

    Two namespaces are two vehicles when they differ in one part only, hold a topic of the same name and type below it,
    and each tells a heading and a position or velocity of its own. Commands outside of both say that there is one
    vehicle, with two estimators.
    """
    roles: dict[tuple[str, ...], set[str]] = defaultdict(set)
    families: dict[tuple[str, ...], dict[tuple[tuple[str, ...], str], set[str]]] = defaultdict(lambda: defaultdict(set))
    for name in names:
        guess = recognise(name) if name.topic else None
        if guess is None:
            continue
        parts = tuple(name.topic.strip("/").split("/"))
        for depth in range(1, len(parts)):
            roles[parts[:depth]].add(guess.role)
            if command_kind(guess.role) is None:
                families[parts[: depth - 1]][parts[depth:], name.kind].add(parts[depth - 1])
        roles[parts].add(guess.role)
    for parent in sorted(families, key=lambda parts: (len(parts), parts)):
        alike = set().union(*(members for members in families[parent].values() if len(members) > 1))
        found = sorted(member for member in alike if _moves(roles[(*parent, member)]))
        if len(found) < 2:
            continue
        inside = [(*parent, member) for member in found]
        commanded = [parts for parts, known in roles.items() if any(command_kind(role) for role in known)]
        # A topic with commands that is no start of a longer one stands for itself.
        leaves = [parts for parts in commanded if not any(other[: len(parts)] == parts != other for other in commanded)]
        if all(any(parts[: len(own)] == own for own in inside) for parts in leaves):
            return tuple("/" + "/".join(parts) for parts in inside)
    return ()


def check_namespace(names: Sequence[Name], namespace: str | None, where: str) -> tuple[str, ...]:
    """Refuse a log of several vehicles of which none is chosen, or a namespace that is not there; give a note on it.

    Raises
    ------
    LogError
        with the namespaces that can be chosen.
    """
    found = vehicles(names)
    if namespace is None:
        if found:
            raise LogError(
                f"{where}: expected the log of one vehicle, got {len(found)}: {', '.join(found)}. Choose one with "
                f"--namespace {found[0]}."
            )
        return ()
    if not any(is_under(name.topic, namespace) for name in names if name.topic):
        there = ", ".join(found or _starts(names)[:12]) or "none: its topics have no parts"
        raise LogError(f"{where}: no topic lies in the namespace '{namespace}'; namespaces in the log: {there}.")
    others = [other for other in found if not is_under(other, namespace)]
    return (f"namespace {namespace} chosen, not {', '.join(others)}",) if others else ()


def _starts(names: Sequence[Name]) -> list[str]:
    """What the topics that may become channels begin with, as far as those of one first part agree; else all topics."""
    deep = [name for name in names if "/" in name.topic.strip("/")]
    agreed: dict[str, list[str]] = {}
    for name in [name for name in deep if recognise(name)] or deep:
        parts = name.topic.strip("/").split("/")[:-1]
        alike = takewhile(lambda pair: pair[0] == pair[1], zip(agreed.get(parts[0], parts), parts, strict=False))
        agreed[parts[0]] = [part for part, _ in alike]
    return sorted("/" + "/".join(parts) for parts in agreed.values())


def _moves(roles: set[str]) -> bool:
    return any(place <= roles for place in _PLACES) and any(heading <= roles for heading in _HEADINGS)
