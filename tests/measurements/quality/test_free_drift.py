"""A boat that drifts and turns freely owes its quick motion to its hull, and answers its commands all the same."""

from dataclasses import replace

import pytest

from undertow.measurements.log import read_log
from undertow.measurements.quality.checks.drive import DRIVE
from undertow.measurements.quality.record import Record
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.world import simulate_world

HULL = {"mass": 15.59, "inertia_z": 5.58, "X_udot": -3.4, "Y_vdot": -23.07, "N_rdot": -1.8, "X_u": -9.0, "N_r": -7.65}


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Record:
    """Two minutes of a hull with little damping in sway."""
    hull = load_vehicle("blueboat_paper").with_values({**HULL, "Y_v": -10.7})
    path = tmp_path_factory.mktemp("log") / "drifting.csv"
    return Record.of(read_log(simulate_world(hull, {}, duration=120.0, seed=4).write(path)), hull)


def test_it_is_not_taken_for_another_run(record: Record):
    assert [finding.verdict for finding in DRIVE.examine([record])] == ["ok"]


@pytest.mark.parametrize(("known", "verdict"), [(True, "defect"), (False, "warning")])
def test_commands_of_another_run_are_still_told(record: Record, known: bool, verdict: str):
    """Without a vehicle its hull is fitted too, and takes some of the motion for its own."""
    mirrored = tuple(replace(s, commands=s.commands[::-1].copy()) for s in record.stretches)
    found = DRIVE.examine([replace(record, stretches=mirrored, vehicle=record.vehicle if known else None, known={})])
    assert [finding.verdict for finding in found] == [verdict]
    assert "does not answer" in found[0].sentence
