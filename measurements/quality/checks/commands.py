"""Check for a command of a thruster, and for nothing else that steers."""

from collections.abc import Iterator, Sequence

from ..record import About, Check, Finding, Found, Record, command_names


def _commands(records: Sequence[Record]) -> Found:
    """Look for thruster commands, and for rudders among what was not recognised."""
    names = tuple(command_names(records))
    text = f"commands of {len(names)} thruster{'s' if len(names) > 1 else ''}: {', '.join(names)}"
    known = About("commands", names, float(len(names)), "1").ok(text)
    return list(_wrong_commands(records)) or [known]


def _wrong_commands(records: Sequence[Record]) -> Iterator[Finding]:
    """What is wrong with the commands of logs: what steers beside them, none at all, and one stream for several."""
    about = About("commands", unit="1")
    if rudders := sorted({name for record in records for name in record.steered}):
        yield about.warning(
            f"the log has a rudder or its like ({', '.join(rudders)}); the vehicles and effects of undertow have none",
            value=float(len(rudders)),
            consequence="what it does would be laid at the door of hull, current or thrusters",
            remedy="if it turns a rudder or a nozzle, fit no vehicle to the log; if it is the difference of "
            "two sides, mix it into them ('mix: skid' in a channel map)",
            short=f"it is steered by {', '.join(rudders)}, which no vehicle file has",
        )
    if not command_names(records):
        yield about.warning(
            "no command of a thruster is recognised",
            value=0.0,
            consequence="no vehicle can be judged; only the motion can be looked at",
            remedy="map the commands with a channel map (--map), for example 'pwm_port: COLUMN' of pulses in "
            "microseconds, 'normalized_port: COLUMN' of shares from -1 to 1",
            short="no thruster command is recognised",
        )
    for source, fed in sorted(_shared(records).items()):
        text = f"{source} is the command of {len(fed)} thrusters"
        yield about.warning(
            f"{text}: {', '.join(fed)}",
            value=float(len(fed)),
            channels=fed,
            consequence="the thrusters cannot be told apart, and a command that the boat had may be missing",
            remedy="if each thruster has its own, name each in the channel map (--map); keep it if one drives both",
            short=text,
        )


def _shared(records: Sequence[Record]) -> dict[str, tuple[str, ...]]:
    """Streams that a channel map takes for several commands, and these."""
    fed: dict[str, set[str]] = {}
    for record in records:
        for name in record.commands:
            fed.setdefault(record.log.channels[name].origin, set()).add(name)
    return {source: tuple(sorted(names)) for source, names in fed.items() if len(names) > 1}


COMMANDS = Check("commands", _commands)
