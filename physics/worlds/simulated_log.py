"""Simulated logs: what the sensors of a world wrote down, beside the truth; to a file, or straight to a `Motion`."""

import gzip
import io
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import RequestError
from ..files import in_stamps, parquet_data, remark, write_bytes
from ..motion import Array, Motion, body_to_earth, wrap_angle
from ..registry_members import how_to_install
from ..sampled_series import area_average, understated_noise
from ..vehicle import Vehicle

ODOMETRY_FIELDS = ("x", "y", "psi", "u", "v", "r")
WIND_FIELDS = ("wind_u", "wind_v")
_ENDINGS = (".csv", ".csv.gz", ".parquet")


def check_ending(path: Path) -> None:
    """Refuse a name whose ending promises another format, or that no reader looks for in a folder.

    Raises
    ------
    RequestError
        for an ending that is none of .csv, .csv.gz and .parquet; a name without one is a table.
    """
    if path.suffix and not path.name.lower().endswith(_ENDINGS):
        raise RequestError(
            f"cannot write {path}: expected a name that ends in .csv, .csv.gz or .parquet; bags are read, not written"
        )


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedLog:
    """A log of a world, and the truth.

    Attributes
    ----------
    vehicle : the true vehicle, effects included
    truth : the motion without noise and waves, on the simulation's grid
    odometry_time : (n,) stamps [s], increasing
    odometry : (n, 6) north, east [m], psi [rad, continuous], u, v [m/s], r [rad/s], noisy
    command_time : (m,) stamps [s], increasing; a command is held until the next stamp
    commands : (m, thrusters) in the thrusters' command units
    wind : (n, 2) apparent wind, ahead and to starboard [m/s], at the stamps of the odometry, noisy; None without an
        anemometer
    """

    vehicle: Vehicle
    truth: Motion
    odometry_time: Array
    odometry: Array
    command_time: Array
    commands: Array
    wind: Array | None = None

    def motion(self, time_step: float = 0.05) -> Motion:
        """The logged (noisy) motion on an even grid, without a file in between.

        Measurements are interpolated linearly (over dropouts too), held commands become means over each step.

        Parameters
        ----------
        time_step : [s]

        Raises
        ------
        RequestError
            when the log has no two grid points.
        """
        stamps = self.odometry_time
        first, last = np.ceil(stamps[0] / time_step - 1e-6), np.floor(stamps[-1] / time_step + 1e-6)
        if not time_step > 0 or last <= first:
            raise RequestError(f"motion: a step of {time_step:g} s does not fit a log of {stamps[-1] - stamps[0]:g} s")
        time = time_step * np.arange(first, last + 1)
        columns = [np.interp(time, stamps, column) for column in self.odometry.T]
        state = np.column_stack(columns)
        commands = area_average(self.command_time, self.commands, time, time_step)
        told = understated_noise(stamps, time)
        air = None
        if self.wind is not None:
            ahead, starboard = (np.interp(time, stamps, column) for column in self.wind.T)
            air = np.column_stack(body_to_earth(columns[2], ahead + columns[3], starboard + columns[4]))
        return Motion(
            time,
            state[:, :2].copy(),
            columns[2],
            state[:, 3:].copy(),
            commands,
            self.truth.thrusters,
            self.truth.source,
            air=air,
            understated=(told, told, told),
        )

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the log as a long table `time,topic,field,value` (NED/FRD, seconds), to a temporary name, then renamed.

        Topic `odometry` has the fields x y psi u v r, topic `command` one field `<command>_<thruster>` each, and topic
        `anemometer`, if there is one, wind_u and wind_v. Gzip when the name ends in `.csv.gz`, Parquet when it ends in
        `.parquet`, CSV when it ends in `.csv` or has no ending. The same log gives the same bytes, with a mark of the
        verb `simulate` (see `files`).

        Raises
        ------
        RequestError
            when the folder does not exist, the name ends otherwise, or Parquet is asked for without pyarrow.
        """
        target = Path(path)
        check_ending(target)
        if not target.parent.is_dir():
            raise RequestError(f"cannot write {target}: the folder {target.parent} does not exist; create it first")
        if target.suffix.lower() == ".parquet":
            data = self._parquet(target)
        else:
            text = "".join(["time,topic,field,value\n", *(f"{t:.6f},{a},{b},{x:.9g}\n" for t, a, b, x in self._rows())])
            data = in_stamps(text).encode("utf-8")
            data = gzip.compress(data, mtime=0) if target.suffix.lower() == ".gz" else data
        return write_bytes(target, data)

    def _rows(self) -> list[tuple[float, str, str, float]]:
        state = self.odometry.copy()
        state[:, 2] = wrap_angle(state[:, 2])
        channels = [t.channel for t in self.vehicle.thrusters]
        wind = [] if self.wind is None else [("anemometer", WIND_FIELDS, self.odometry_time, self.wind)]
        rows = [
            (t, topic, field, x)
            for topic, names, stamps, table in (
                ("command", channels, self.command_time, self.commands),
                ("odometry", ODOMETRY_FIELDS, self.odometry_time, state),
                *wind,
            )
            for t, line in zip(stamps.tolist(), table.tolist(), strict=True)
            for field, x in zip(names, line, strict=True)
        ]
        return sorted(rows, key=lambda row: row[0])

    def _parquet(self, target: Path) -> bytes:
        import pandas as pd

        table = pd.DataFrame(self._rows(), columns=["time", "topic", "field", "value"])
        plain, marked = io.BytesIO(), io.BytesIO()
        try:
            table.to_parquet(plain, index=False)
            table.attrs["undertow"] = remark("simulate", parquet_data(plain.getvalue()))
            table.to_parquet(marked, index=False)
        except ImportError:
            raise RequestError(f"cannot write {target}: Parquet needs pyarrow: {how_to_install('logs')}") from None
        return marked.getvalue()
