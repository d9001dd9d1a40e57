"""A tab's work without a browser: the demo opened on a worker of its own."""

from undertow.app.session import Session
from undertow.app.steps import History
from undertow.app.worker import Worker
from undertow.workflows.workbench_facts import Fit, Source

DEMO = Source()


async def opened() -> Session:
    """A session with the demo open and not searched, which is what takes long."""
    session = Session()
    session.search = _nothing  # type: ignore[method-assign]
    await session.open(DEMO)
    assert session.errands.trouble == ""
    return session


def fit_of(session: Session) -> Fit:
    """The model of the present step."""
    assert session.shown.fit is not None
    return session.shown.fit


def history_of(session: Session) -> History:
    """The steps of a session."""
    assert session.shown.history is not None
    return session.shown.history


def worker_of(session: Session) -> Worker:
    """The process that computes for a session."""
    assert session.errands.worker is not None
    return session.errands.worker


async def _nothing() -> None:
    """Instead of a search."""
