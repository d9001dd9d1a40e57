"""What languages share in which arrays are values: a function takes and gives them."""

from collections.abc import Sequence

from .functions import Function
from .printer import Language


class ArrayLanguage(Language):
    """A language in which arrays are values.

    Attributes
    ----------
    item : an element of an array, with braces for the array and the place
    packed, between : an array of numbers, with braces for them, and what stands between two
    named : a name for an expression, with braces for both
    several : names of more than one result, with braces for them
    first : the place of an array's first element
    """

    item = "{}[{}]"
    packed = "[{}]"
    between = ", "
    named = "{} = {}"
    several = "[{}]"
    first = 0

    def number(self, value: float) -> str:
        """See `Language.number`."""
        return repr(value)

    def element(self, array: str, place: int) -> str:
        """See `Language.element`."""
        return self.item.format(array, place + self.first)

    def assigned(self, name: str, text: str) -> str:
        """See `Language.assigned`."""
        return self.named.format(name, text)

    def pack(self, texts: Sequence[str]) -> str:
        """An array of numbers."""
        return self.packed.format(self.between.join(texts))

    def called(self, function: Function, given: Sequence[str], names: Sequence[str]) -> list[str]:
        """See `Language.called`."""
        arguments = [
            texts[0] if group.single else self.pack(texts)
            for group, texts in zip(function.inputs, function.split(given), strict=True)
        ]
        found = names[0] if len(names) == 1 else self.several.format(", ".join(names))
        return [self.assigned(found, f"{function.name}({', '.join(arguments)})")]
