"""Spoilt files of users and of runs end in a clear error, or are read: the fast slice of benchmarks/fuzz_files.py."""

import pytest
from spoilt_files import HOSTILE, KINDS, judged, spoilt_json, spoilt_yaml

from undertow.reports.page import page

FILES = 50
DRAWN = 25
"""Of so many files one is drawn as a page, which takes a second."""


@pytest.mark.parametrize("name", KINDS)
def test_a_spoilt_file_is_refused_clearly_or_read(name, tmp_path, monkeypatch):
    kind = KINDS[name]
    path = kind.write(tmp_path)
    sound = path.read_bytes()
    draw = page.page
    kind.use(path)  # as it came; else every spoilt one would be refused for what is wrong already
    monkeypatch.setattr(page, "fleet_page", lambda runs, home: "")
    for seed in range(FILES):
        monkeypatch.setattr(page, "page", draw if seed % DRAWN == 0 else lambda run: "")
        assert judged(kind, path, sound, seed) in ("read", "clear error"), f"seed {seed}"


def test_spoiling_is_the_same_for_equal_seeds_and_spoils():
    content = b'{"a": {"b": [1, 2.5, "x"]}, "c": null}'
    for spoil in (spoilt_json, spoilt_yaml):
        assert [spoil(content, seed) for seed in range(60)] == [spoil(content, seed) for seed in range(60)]
        assert len({spoil(content, seed) for seed in range(60)}) > 40
    assert any(isinstance(value, list) and len(value) > 1000 for value in HOSTILE)
