"""Who is told of every change: the views of a tab."""

from collections.abc import Callable
from contextlib import suppress

View = Callable[[], None]


class Audience:
    """Views, called after every change."""

    def __init__(self) -> None:
        self._views: list[View] = []

    def watch(self, view: View) -> View:
        """Call a view after every change, until the function that is given back is called."""
        self._views.append(view)

        def leave() -> None:
            with suppress(ValueError):
                self._views.remove(view)

        return leave

    def tell(self) -> None:
        """Tell all views; one that fails keeps no other from being told."""
        failed = None
        for view in tuple(self._views):
            try:
                view()
            except Exception as error:
                failed = error
        if failed is not None:
            raise failed

    def leave(self) -> None:
        """Tell nobody any more."""
        self._views.clear()
