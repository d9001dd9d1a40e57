"""Which logs are meant: folders of boats, manifests, patterns, and what is wrong with them."""

from pathlib import Path

import pytest

from undertow.fleet.build_fleet import middle
from undertow.fleet.log_sources import LogSource, date_in, find_sources
from undertow.physics.errors import LogError, RequestError

LOG = "t,x,y,psi,u,v,r\n0.0,0,0,0,0,0,0\n"


@pytest.fixture
def place(tmp_path: Path) -> Path:
    for name in ("logs/ada/2026-05-03.csv", "logs/ada/2026-05-04.csv", "logs/bo/x.csv"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(LOG)
    return tmp_path


def test_a_folder_stands_for_all_below_it_but_fleets(place: Path):
    (place / "logs" / "fleet").mkdir()
    (place / "logs" / "fleet" / "fleet.json").write_text("{}")
    (place / "logs" / "fleet" / "old.csv").write_text(LOG)
    (place / "logs" / "bo" / "notes.txt").write_text("nothing")
    (place / "logs" / "bo" / "died.bin").touch()  # as a logger leaves it that had no power: to be named
    (place / "elsewhere").mkdir()
    (place / "elsewhere" / "cy.csv").write_text(LOG)
    (place / "logs" / "cy").symlink_to(place / "elsewhere")
    (place / "elsewhere" / "back").symlink_to(place / "logs")
    found = find_sources([place / "logs"])
    assert [(s.boat, Path(s.place).name, s.named) for s in found] == [
        ("ada", "2026-05-03.csv", 1777766400.0),
        ("ada", "2026-05-04.csv", 1777852800.0),
        ("bo", "died.bin", None),
        ("bo", "x.csv", None),
        ("elsewhere", "cy.csv", None),
    ]
    assert find_sources([str(place / "logs" / "ad*" / "*.csv"), place / "logs"]) == found
    with pytest.raises(LogError, match="got a fleet; give the folder of its logs"):
        find_sources([place / "logs" / "fleet"])


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("m.csv", "log, boat, day, notes\nlogs/bo, Bo II, 2026-06-01T10:00, after the dock\nlogs/ada/2026-05-03.csv\n"),
        (
            "m.csv",
            "\ufefflog;boat;day;notes\nlogs/bo;Bo II;2026-06-01T10:00;after the dock\n\nlogs/ada/2026-05-03.csv\n",
        ),
        (
            "m.yaml",
            "logs:\n- {log: logs/bo, boat: Bo II, day: '2026-06-01T10:00', notes: after the dock}\n"
            "- log: logs/ada/2026-05-03.csv\n",
        ),
    ],
)
def test_a_manifest_says_boat_day_and_notes(place: Path, name: str, text: str):
    (place / name).write_text(text)
    ada, bo = find_sources([place / name])
    assert (bo.boat, bo.begins, bo.notes) == ("Bo II", 1780308000.0, "after the dock")
    assert (ada.boat, ada.begins, ada.vehicle) == ("ada", None, "")


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("log,boot\nlogs/bo,Bo\n", "row 2: expected log, boat, day, vehicle, notes, got 'boot'"),
        ("log,day\nlogs/bo,yesterday\n", "row 2: expected a day such as 2026-05-03 .*got 'yesterday'"),
        ("log,day\nlogs/bo,3, May 2026\n", "row 2: expected a cell for each of the columns log, day, .*got 3 cells"),
        ("log\nlogs/none*.csv\n", "row 2: .*no file or bag meets this pattern"),
        ("log\n", "expected a manifest with logs, got none"),
        ("log,boat\nlogs/bo,Bo\nlogs/bo/x.csv,Ada\n", "given twice, as Bo and as Ada"),
    ],
)
def test_a_wrong_manifest_is_told_by_its_row(place: Path, text: str, wrong: str):
    (place / "m.csv").write_text(text)
    with pytest.raises((RequestError, LogError), match=wrong):
        find_sources([place / "m.csv"])


def test_a_date_in_a_name():
    assert date_in("log_20260503_101500.bin") == date_in("2026-05-03T10-15.bin") == 1777803300.0
    assert date_in("serial-120260503999.bin") is None
    assert date_in("2026-02-30.csv") is None


def test_a_manifest_has_the_first_word_on_the_day():
    from undertow.fleet.hull_factors import HullFactors

    class Told(HullFactors):
        """A log of a minute that begins at ten."""

        def __init__(self, start: float) -> None:
            import numpy as np

            for name, value in (("begin", [5.0]), ("end", [65.0]), ("start", [start])):
                object.__setattr__(self, name, np.array(value))

    day, ten = 1777766400.0, 1777766400.0 + 36000.0
    none, own = Told(float("nan")), Told(ten)
    assert middle(LogSource("a", "b", named=day), none) == day + 30.0
    assert middle(LogSource("a", "b", named=0.0), own) == ten + 35.0
    assert middle(LogSource("a", "b", begins=day), own) == ten + 35.0
    assert middle(LogSource("a", "b", begins=day - 86400.0), own) == day - 86400.0 + 30.0
