"""Remedies name options where they are typed, and arguments where they are read in Python."""

import ast
import pickle
from pathlib import Path

import pytest
from sources import parsed, source_files
from verbs import refused

import undertow
from undertow.measurements.formats.base import in_file
from undertow.physics.errors import LogError, RequestError, in_python
from undertow.physics.presentation import Card

HELD = "t,x,y,psi,u,v,r\n" + "".join(f"{0.1 * k:.1f},{0.1 * k},0,0,1,0,0\n" for k in range(300))


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("say --as-is: every result", "say Reading(as_is=True): every result"),
        ("a channel map (--map channels.yaml)", 'a channel map (Reading(channel_map="channels.yaml"))'),
        ("give it with --map. Not used", "give it with Reading(channel_map=...). Not used"),
        ("Choose one with --namespace /alpha.", 'Choose one with Reading(namespace="/alpha").'),
        ("leave --length out, or --like", "leave Hull(length=...) out, or like=..."),
        ("free one, for example --free X_u", 'free one, for example free=["X_u"]'),
        ("--fix OUT.csv writes a log", "'undertow inspect LOG --fix OUT.csv' writes a log"),
        ("go on with it (--resume)", "go on with it (resume=True)"),
        ("'undertow inspect LOG --map-out map.yaml' writes it", "'undertow inspect LOG --map-out map.yaml' writes it"),
    ],
)
def test_options_become_arguments_but_not_in_a_command(typed: str, said: str) -> None:
    assert in_python(typed) == said
    assert str(RequestError(typed)) == said
    assert RequestError(typed).typed == typed


def test_an_error_that_comes_from_another_process_says_the_same() -> None:
    error = pickle.loads(pickle.dumps(LogError("say --as-is")))
    assert (error.typed, str(error)) == ("say --as-is", "say Reading(as_is=True)")


class _Told(Card):
    def card(self) -> list[tuple[str, str]]:
        return [("verdict", "Not usable as it is. --fix OUT.csv writes a log that can be used.")]


def test_a_card_is_read_in_python() -> None:
    assert "'undertow inspect LOG --fix OUT.csv' writes" in repr(_Told())
    assert "inspect LOG --fix" in _Told()._repr_html_()


def test_one_refusal_is_said_for_both(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    log = tmp_path / "log.csv"
    log.write_text(HELD)
    with pytest.raises(LogError, match=r"channel map.*Reading\(channel_map="):
        undertow.init(log, progress=None)
    said = refused("init", log, match="--map")
    assert "Reading(" not in str(said)  # nor is the way across, which this log does not show, a number that is none


def test_what_is_refused_inside_a_file_is_passed_on_with_its_options() -> None:
    with pytest.raises(LogError) as told, in_file(Path("x.csv")):
        raise LogError("expected a channel map (--map map.yaml)")
    assert told.value.typed == "x.csv: expected a channel map (--map map.yaml)"


def test_no_refusal_is_passed_on_in_the_words_of_python() -> None:
    """What is caught here and told again keeps its options; arguments of Python are put in their place last."""
    ours, wrong = {"LogError", "RequestError", "VehicleError"}, []
    for path in source_files():
        for caught in ast.walk(parsed(path)):
            if not isinstance(caught, ast.ExceptHandler) or caught.type is None or caught.name is None:
                continue
            if ours & {name.id for name in ast.walk(caught.type) if isinstance(name, ast.Name)}:
                wrong += [f"{path}:{caught.lineno}" for said in ast.walk(caught) if _says(said, caught.name)]
    assert wrong == []


def _says(node: ast.AST, name: str) -> bool:
    """Whether a part of the code is `str(name)`, or `{name}` in a text."""
    said = node.value if isinstance(node, ast.FormattedValue) else None
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "str" and node.args:
        said = node.args[0]
    return isinstance(said, ast.Name) and said.id == name
