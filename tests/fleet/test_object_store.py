"""Logs in an object store: listed, fetched, known by their bytes, and what is told where the store is not there."""

from collections.abc import Iterator
from pathlib import Path

import pytest

import undertow
from undertow.fleet.build_fleet import build_fleet
from undertow.fleet.fleet_folder import read_index
from undertow.fleet.log_sources import find_sources
from undertow.fleet.workers import Engine
from undertow.physics.worlds.world import simulate_world

HULL = undertow.load_vehicle("blueboat")


@pytest.fixture(scope="module")
def bucket(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A store with two logs of one boat and something else, and a folder with one of the logs."""
    import obstore
    from moto.server import ThreadedMotoServer
    from obstore.store import S3Store

    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    told = {
        "AWS_ACCESS_KEY_ID": "none",
        "AWS_SECRET_ACCESS_KEY": "none",
        "AWS_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": "http://{}:{}".format(*server.get_host_and_port()),
        "AWS_ALLOW_HTTP": "true",
    }
    folder = tmp_path_factory.mktemp("store")
    with pytest.MonkeyPatch.context() as patch:
        for name, value in told.items():
            patch.setenv(name, value)
        store = S3Store("fleet", client_options={"allow_http": True})
        import urllib.request

        urllib.request.urlopen(urllib.request.Request(f"{told['AWS_ENDPOINT_URL']}/fleet", method="PUT")).close()
        for n in (3, 4):
            name = f"2026-05-0{n}.csv"
            simulate_world(HULL, {}, duration=30.0, seed=n).write(folder / name)
            obstore.put(store, f"2026/ada/{name}", (folder / name).read_bytes())
        obstore.put(store, "2026/ada/README.txt", b"nothing")
        yield folder
    server.stop()


def test_logs_are_listed_and_read_by_their_bytes(bucket: Path, tmp_path: Path):
    found = find_sources(["s3://fleet/2026/"])
    assert [(s.boat, s.place) for s in found] == [("ada", f"s3://fleet/2026/ada/2026-05-0{n}.csv") for n in (3, 4)]
    (one,) = find_sources(["s3://fleet/2026/ada/2026-05-03.csv"])
    assert one == found[0]
    for pattern in ("2026/*/2026-05-*.csv", "**/*.csv", "2026/**/2026*"):
        assert find_sources([f"s3://fleet/{pattern}"]) == found
    assert find_sources(["s3://fleet/*/ada/*-0[3].csv"]) == (one,)
    alone = Engine(workers=1)
    done = build_fleet("s3://fleet/2026/", HULL, tmp_path / "fleet", engine=alone, progress=None)
    assert (done.read, done.kept) == (2, 0)
    build_fleet(bucket, HULL, tmp_path / "local", engine=alone, progress=None)
    remote, local = (read_index(tmp_path / name).logs for name in ("fleet", "local"))
    assert [log.factors for log in remote] == [log.factors for log in local]
    again = build_fleet("s3://fleet/2026/", HULL, tmp_path / "fleet", engine=alone, progress=None)
    assert (again.read, again.kept) == (0, 2)


def test_what_is_not_there_is_told(bucket: Path):
    with pytest.raises(undertow.LogError, match="expected logs at this address, got 0 objects|cannot be read"):
        find_sources(["s3://fleet/none/"])
    with pytest.raises(undertow.LogError, match="got 3 objects and none that meets the pattern"):
        find_sources(["s3://fleet/2026/*.csv"])
    with pytest.raises(undertow.LogError, match="s3://nowhere/x.csv: cannot be read .*look at the address"):
        find_sources(["s3://nowhere/x.csv"])
