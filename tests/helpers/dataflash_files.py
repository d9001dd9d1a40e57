"""Small DataFlash files, as ArduPilot writes them: FMT, FMTU and PARM messages first, then what the boat measured."""

import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from undertow.physics.motion import body_to_earth
from undertow.physics.worlds.world import SimulatedLog

CODES = {"B": "B", "b": "b", "h": "h", "H": "H", "i": "i", "I": "I", "f": "f", "d": "d", "Q": "Q", "q": "q"} | {
    "n": "4s",
    "N": "16s",
    "Z": "64s",
    "c": "h",
    "C": "H",
    "e": "i",
    "E": "I",
    "L": "i",
}
SCALES = {"c": 100, "C": 100, "e": 100, "E": 100, "L": 1e7}
MESSAGES = {
    "PARM": (64, "QNff", "TimeUS,Name,Value,Default", "s---"),
    "ATT": (65, "QccccCCCCB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw,AEKF", "sddddhhdh-"),
    "GPS": (
        66,
        "QBBIHBcLLeffffB",
        "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U",
        "s#-s-S-DUmnhnh-",
    ),
    "XKF1": (67, "QBccCfffffffccce", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH", "s#ddhnnnnmmmkkkm"),
    "XKF4": (68, "QBcccccfffHBIHb", "TimeUS,C,SV,SP,SH,SM,SVT,errRP,OFN,OFE,FS,TS,SS,GPS,PI", "s#------mm-----"),
    "IMU": (69, "QBffffffIIfBBHH", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz", "s#EEEooo--O--zz"),
    "RCOU": (70, "QHHHHHHHHHHHHHH", "TimeUS," + ",".join(f"C{k}" for k in range(1, 15)), "s" + "Y" * 14),
    "RCIN": (71, "QHHHHHHHHHHHHHH", "TimeUS," + ",".join(f"C{k}" for k in range(1, 15)), "s" + "Y" * 14),
    "FMTU": (72, "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "s---"),
}
"""Name -> number, format, columns, units: ArduPilot 4.5, `LOG_STRUCTURE`."""
SERVOS = {
    "SERVO1_FUNCTION": 74, "SERVO1_MIN": 1100, "SERVO1_TRIM": 1500, "SERVO1_MAX": 1900, "SERVO1_REVERSED": 0,
    "SERVO3_FUNCTION": 73, "SERVO3_MIN": 1100, "SERVO3_TRIM": 1500, "SERVO3_MAX": 1900, "SERVO3_REVERSED": 0,
    "AHRS_EKF_TYPE": 3, "EK3_IMU_MASK": 3,
}  # fmt: skip
START = 10_000_000
"""TimeUS of the world's beginning."""


class Writer:
    """A DataFlash file in memory, `content`; `text` is the same as ArduPilot's text logs have it."""

    def __init__(self, units: bool = True, messages: dict = MESSAGES) -> None:
        self._messages = messages
        self.content, self.text = bytearray(), []
        self._define(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
        for name, (number, characters, columns, _) in messages.items():
            self._define(number, name, characters, columns)
        for number, _, _, told in messages.values() if units else ():
            self.add("FMTU", 0, number, told.encode(), b"")

    def _define(self, number: int, name: str, characters: str, columns: str) -> None:
        length = 3 + struct.calcsize("<" + "".join(CODES[c] for c in characters))
        body = struct.pack("<BB4s16s64s", number, length, name.encode(), characters.encode(), columns.encode())
        self.content += b"\xa3\x95\x80" + body
        self.text.append(f"FMT, {number}, {length}, {name}, {characters}, {columns}")

    def add(self, name: str, *values: float | bytes) -> None:
        """Add a message, its values in the units that a reader sees."""
        number, characters, _, _ = self._messages[name]
        raw = [round(v * SCALES[c]) if c in SCALES else v for c, v in zip(characters, values, strict=True)]
        self.content += b"\xa3\x95" + bytes([number])
        self.content += struct.pack("<" + "".join(CODES[c] for c in characters), *raw)
        shown = [
            v.decode() if isinstance(v, bytes) else f"{v:.10g}" if isinstance(v, float) else str(v) for v in values
        ]
        self.text.append(", ".join([name, *shown]))

    def parameters(self, values: Mapping[str, float]) -> None:
        for name, value in values.items():
            self.add("PARM", 1000, name.encode(), float(value), float("nan"))


def dataflash_of(log: SimulatedLog, writer: Writer | None = None, servos: Mapping[str, float] = SERVOS) -> Writer:
    """Write a simulated world as ArduPilot would: EKF core 1 is primary, core 0 wrong; port on output 3, stbd on 1."""
    writer = writer or Writer()
    writer.parameters(servos)
    stamps = START + np.rint(1e6 * log.odometry_time).astype(int)
    sent = START + np.rint(1e6 * log.command_time).astype(int)
    port, stbd = (log.commands[:, log.truth.thrusters.index(name)] for name in ("port", "stbd"))
    rows = [(int(stamp), 0, row) for row, stamp in enumerate(stamps)] + [(int(s), 1, row) for row, s in enumerate(sent)]
    for stamp, kind, row in sorted(rows):
        if kind:
            pulses = [0] * 14
            pulses[0], pulses[2] = (
                round(2 * servos[f"SERVO{k}_TRIM"] - value if servos[f"SERVO{k}_REVERSED"] else value)
                for k, value in ((1, stbd[row]), (3, port[row]))
            )
            writer.add("RCOU", stamp, *pulses)
            continue
        north, east, psi, u, v, r = log.odometry[row]
        yaw = np.degrees(psi) % 360.0
        yaw = yaw if round(100 * yaw) < 36000 else 0.0
        velocity = tuple(float(value) for value in body_to_earth(psi, u, v))
        writer.add("XKF4", stamp, 0, *[0.0] * 8, 0, 0, 0, 0, 1)
        writer.add("XKF1", stamp, 0, 0.0, 0.0, 123.0, 9.0, 9.0, *[0.0] * 2, 9.0, 9.0, *[0.0] * 5)
        writer.add("XKF1", stamp, 1, 0.0, 0.0, yaw, *velocity, *[0.0] * 2, north, east, *[0.0] * 5)
        writer.add("ATT", stamp, *[0.0] * 5, yaw, 0.0, 0.0, 3)
        for number in (0, 1):
            rate = r if number else 7.0
            writer.add("IMU", stamp, number, 0.0, 0.0, rate, 0.1 * number, -0.2, -9.8, 0, 0, 30.0, 1, 1, 1000, 1000)
    return writer


def write(path: Path, writer: Writer) -> Path:
    path.write_bytes(bytes(writer.content)) if path.suffix != ".log" else path.write_text("\n".join(writer.text) + "\n")
    return path
