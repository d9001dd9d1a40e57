"""What is made of whole vectors: operations that a graph of another tool has, and functions that are built of them.

A program of single numbers says everything of a hull; a layer of a network is a product with a matrix, and a program
of its thousands of numbers would be long and slow.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...physics.frames import Array
from .functions import Function, Group

Vector = Any
"""Whatever stands for a vector there."""


class VectorOperations(ABC):
    """Operations on vectors."""

    @abstractmethod
    def constant(self, values: Array) -> Vector:
        """A vector that is known."""

    @abstractmethod
    def affine(self, weight: Array, bias: Array | None, x: Vector) -> Vector:
        """weight x + bias, for weight (m, n), bias (m,) and x (n,)."""

    @abstractmethod
    def add(self, a: Vector, b: Vector) -> Vector:
        """Elements added."""

    @abstractmethod
    def mul(self, a: Vector, b: Vector) -> Vector:
        """Elements multiplied."""

    @abstractmethod
    def tanh(self, x: Vector) -> Vector:
        """Hyperbolic tangent of each element."""

    @abstractmethod
    def relu(self, x: Vector) -> Vector:
        """Each element, or zero where it is negative."""

    @abstractmethod
    def part(self, x: Vector, begin: int, end: int) -> Vector:
        """The elements from one place up to another, which is left out."""

    @abstractmethod
    def joined(self, parts: Sequence[Vector]) -> Vector:
        """Vectors one after the other."""

    @abstractmethod
    def called(self, function: Function, groups: Mapping[str, Vector]) -> Vector:
        """What a function of a program gives; groups that it lacks are passed over."""


@dataclass(frozen=True, slots=True)
class Built:
    """A function that is built of vectors.

    Attributes
    ----------
    name, about : what it is called, and what it does
    inputs, outputs : groups of numbers
    build : the outputs by operations of a tool, from the inputs by name
    """

    name: str
    about: str
    inputs: tuple[Group, ...]
    outputs: tuple[Group, ...]
    build: Callable[[VectorOperations, Mapping[str, Vector]], Sequence[Vector]]
