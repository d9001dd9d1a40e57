"""Worlds of simulators that are not ours: their own equations, files by linear algebra, and what is hidden in each."""

from .kinds import FIRST, KINDS, Kind
from .worlds import logged

__all__ = ["FIRST", "KINDS", "Kind", "logged"]
