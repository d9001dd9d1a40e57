"""A broken log ends in a clear error, or in what can be read of it: the fast slice of benchmarks/fuzz.py."""

import contextlib
import importlib

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from log_samples import SAMPLES, broken
from places import ROOT

from undertow.measurements.formats.base import read_head
from undertow.measurements.formats.registry import FORMATS, format_of
from undertow.measurements.log import Log, read_log
from undertow.physics.errors import LogError

FILES = 50
ENDINGS = {"matlab": ".mat"}
"""A .mat of version 4 has no mark; all other formats are known by their content."""


@pytest.mark.parametrize("name", SAMPLES)
def test_a_broken_file_is_refused_clearly_or_read_in_part(name, tmp_path):
    sample = SAMPLES[name](tmp_path)
    sound = sample.file.read_bytes()
    assert isinstance(read_log(sample.log), Log)

    @settings(
        max_examples=FILES,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
    )
    @given(st.integers(0, 2**32))
    def check(seed):
        sample.file.write_bytes(broken(sound, seed))
        with contextlib.suppress(LogError):
            read_log(sample.log)

    check()


def test_memory_that_runs_out_counts_as_a_failure(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    fuzz = importlib.import_module("fuzz")
    refusal = LogError("a broken MATLAB file")
    refusal.__cause__ = ValueError("no room")
    refusal.__cause__.__cause__ = MemoryError()
    assert fuzz.ran_out(refusal)
    assert fuzz.ran_out(LogError("a broken MATLAB file (Unable to allocate 2.00 GiB for an array)"))
    assert not fuzz.ran_out(LogError("a broken MATLAB file (an element of type 0)"))


def test_what_guided_fuzzing_kept_is_refused_clearly_or_read(tmp_path):
    """The corpus of benchmarks/fuzz_guided.py: small inputs, each of which reaches code that no other does."""
    kept = sorted((ROOT / "benchmarks" / "corpus").rglob("*"))
    files = [path for path in kept if path.is_file()]
    assert len(files) >= 20
    assert sum(path.stat().st_size for path in files) < 400_000
    for place, path in enumerate(files):
        log = tmp_path / f"{place}{ENDINGS.get(path.parent.name, '.log')}"
        log.write_bytes(path.read_bytes())
        with contextlib.suppress(LogError):
            read_log(log)


def test_every_format_has_a_sample(tmp_path):
    found = set()
    for place, (name, write) in enumerate(SAMPLES.items()):
        folder = tmp_path / str(place)
        folder.mkdir()
        form = format_of(read_head(write(folder).log))
        assert form is not None, name
        found.add(form.name)
    assert found == {form.name for form in FORMATS}


def test_breaking_is_the_same_for_equal_seeds_and_mostly_breaks():
    content = bytes(range(256)) * 40
    assert [broken(content, seed) for seed in range(50)] == [broken(content, seed) for seed in range(50)]
    assert sum(broken(content, seed) != content for seed in range(200)) > 180
    assert all(broken(b"", seed) == b"" for seed in range(50))
