"""What logs, files and runs are called reaches neither the terminal nor the page nor a file as anything but text."""

import json
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from rich.text import Text
from sample_run import edit, write_sample
from verbs import call

from undertow.cli.console import fail, progress, prose, say, show
from undertow.measurements.channels.channel_map import Entry, map_text, read_channel_map
from undertow.physics.errors import one_line, printable, shortened, shown
from undertow.physics.files import yaml_text
from undertow.physics.reading import parse_yaml
from undertow.physics.sources import with_sources
from undertow.physics.vehicle import load_vehicle
from undertow.reports.page.markup import element
from undertow.reports.terminal.layout import bullets, plain_table, section

HOSTILE = "\x1b[31m\x9b2J\x7f\u202egnp\u2066\udcff\x00\r"
RAW = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""What must be nowhere in an output."""


def test_escapes_are_visible_and_letters_stay():
    assert printable(HOSTILE) == r"\x1b[31m\x9b2J\x7f\u202egnp\u2066\udcff\x00\r"
    assert printable("Größe, 速度, m/s², 👩‍🚀, नमस्ते\n\tx") == "Größe, 速度, m/s², 👩‍🚀, नमस्ते\n\tx"
    assert one_line("a\nb\tc\u2028d") == r"a\nb\tc\u2028d"


def test_long_texts_keep_head_and_tail():
    text = shortened("head" + "x" * 10**6 + "tail", 4000)
    assert len(text) <= 4000
    assert text.startswith("headx")
    assert text.endswith("xtail")
    nested: list = []
    for _ in range(100_000):
        nested = [nested]
    assert len(shown(nested)) < 50
    assert len(shown({"k" * 10**6: ["v" * 10**6] * 10**4})) <= 120
    assert shown(10**5000) == "a number of very many digits"


def test_nothing_raw_reaches_the_terminal(capsys):
    table = plain_table(f"title {HOSTILE}", f"caption {HOSTILE}")
    table.add_column(f"head {HOSTILE}")
    table.add_row(Text(f"text {HOSTILE}"))
    table.add_row(f"[red]word[/red] :smile: {HOSTILE}")
    show(section(HOSTILE, bullets([f"bullet {HOSTILE} [bold]"])), table)
    say(f"line\n{HOSTILE}")
    prose(f"prose {HOSTILE}" + "x" * 10_000)
    progress(f"going on {HOSTILE}")
    with pytest.raises(BaseException, match=r"^$|2"):
        fail(f"failed {HOSTILE}\nnext" + "y" * 10_000)
    out, err = capsys.readouterr()
    assert not RAW.search(out)
    assert not RAW.search(err)
    assert "[red]word[/red] :smile:" in out
    assert r"line\n\x1b" in out
    assert max(len(line) for line in err.splitlines()) <= 4000


def test_nothing_raw_reaches_the_page():
    text = element("p", f"<script>{HOSTILE}", title=f'"{HOSTILE}')
    assert not RAW.search(text)
    assert "<script>" not in text
    assert text.encode("utf-8")


def test_names_in_yaml_are_read_back_as_they_were(tmp_path):
    for name in ("Jörg/速度:x", "a\u202eb\x1b[1m\nc:d", "plain:u"):
        text = map_text({"u": Entry(name)}, [f"unused\n{HOSTILE}"])
        assert not RAW.search(text)
        path = tmp_path / "map.yaml"
        path.write_text(text, encoding="utf-8")
        assert read_channel_map(path) == {"u": Entry(name)}
    assert yaml_text({"name": "Jörg"}) == "name: Jörg\n"
    hull = load_vehicle("blueboat")
    named = with_sources(hull, hull.with_values({"X_u": -1.0}), f"identified by undertow from log{HOSTILE}.csv")
    named.save(tmp_path / "boat.yaml")
    assert load_vehicle(tmp_path / "boat.yaml").sources == named.sources
    assert parse_yaml((tmp_path / "boat.yaml").read_text()) == named.to_dict()


def test_a_log_of_an_odd_name_with_odd_topics_is_inspected(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    time = np.arange(0.0, 25.0, 0.05)
    lines = ["# a remark \x1b[31m", "time,topic,field,value"]
    for topic, field in (
        ("/odo\x1b[2Jm", "u"),
        ("/\u202eodom", "v"),
        ("/x", "psi"),
        ("/[red]thr", "newton_port"),
        ("/z\x9b", "w"),
    ):
        lines += [f"{t:.2f},{topic},{field},{np.sin(t):.6f}" for t in time]
    name = os.fsdecode(b"log \xff\x1b[31m\n.csv")
    Path(name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    for words in ((), ("--json",), ("--map-out", "map.yaml"), ("--fix", "clean.csv")):
        result = call("inspect", name, *words)
        assert not isinstance(result.exception, UnicodeError), result.exception
        assert not RAW.search(result.output)
        if "--json" in words:
            json.loads(result.stdout)
    for path in (Path("map.yaml"), Path("clean.csv")):
        assert not path.exists() or not RAW.search(path.read_text("utf-8"))


def test_hostile_words_of_a_run_are_words_on_its_page(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = write_sample(tmp_path / "run", seconds=100.0)
    bad = f"<script>alert(1)</script>{HOSTILE}"
    edit(run / "findings.json", lambda f: f.update(warnings=[bad], headline=bad, notes=[bad]))
    edit(run / "comparison.json", lambda c: c.update(logs=[bad], warnings=[bad]))
    edit(run / "inspection.json", lambda i: i["logs"][0].update(path=bad, verdict=bad))
    result = call("report", "run")
    assert result.exit_code == 0, result.stderr
    text = (run / "report.html").read_text("utf-8")
    assert "<script>alert" not in text
    assert text.count("<script") == 2  # the page's own, and its data
    assert not RAW.search(text)
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in text
    shutil.rmtree(run)
