"""The examples below the options of each verb: every verb has some, and each is a line that the verb takes."""

import shlex

import pytest
from typer.main import get_command
from verbs import done

from undertow.__main__ import app
from undertow.cli.options import EXAMPLES

VERBS = {command.name or command.callback.__name__: command for command in app.registered_commands if command.callback}


def test_every_verb_has_examples() -> None:
    assert set(EXAMPLES) == set(VERBS)


@pytest.mark.parametrize("line", [line for lines in EXAMPLES.values() for line in lines])
def test_an_example_is_a_line_that_the_verb_takes(line: str) -> None:
    program, verb, *words = shlex.split(line)
    assert program == "undertow"
    group = get_command(app)
    command = group.commands[verb]  # type: ignore[attr-defined]
    assert command.make_context(verb, words).params


def test_they_stand_below_the_options() -> None:
    assert "undertow discover boat.csv --vehicle boat.yaml --out run" in " ".join(done("discover", "--help").split())
