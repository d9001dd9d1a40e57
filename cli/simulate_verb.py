"""The verb `simulate`: write the log of a world with hidden effects."""

from pathlib import Path

from ..physics.effects import EFFECTS
from .console import say, tell_replaced
from .options import FORCE, REQUIRED, SEED, VEHICLE, check_files, option


def amounts() -> str:
    """What the values of `simulate --effect` mean, effect by effect."""
    added, absolute = (", ".join(e.name for e in EFFECTS if e.added is kind) for kind in (True, False))
    return (
        "Added to the vehicle's own number, so that X_uu=-12 makes -8 to -20 (a term such as yaw:u|r| too): "
        f"{added}.\n\n"
        f"Put in the place of the vehicle's own number: {absolute}.\n\n"
        "Symbols such as X_uu, lag or port_scale count like their effects; inertia_z and Y_rdot are put in "
        "place. What came of it is printed."
    )


def simulate(
    vehicle: str = VEHICLE,
    out: Path = option("--out -o", "Log to write: .csv, .csv.gz or .parquet.", REQUIRED),
    effect: list[str] | None = option("--effect", "Hidden effect as name=value[,value], or a symbol=value; see below."),
    programme: str = option("--programme", "Manoeuvres: rich, zigzag or gentle.", "rich"),
    duration: float = option("--duration", "Length of the log in seconds.", 300.0, min=1.0, max=86400.0),
    noise: str = option("--noise", "Sensors: clean, field or rough.", "field"),
    force: bool = FORCE,
    seed: int = SEED,
) -> None:
    """Write the log of a world with hidden effects."""
    from ..measurements.quality.checks.excitation import excitation_of
    from ..physics.vehicle import load_vehicle
    from ..physics.worlds.hidden_effects import parse_effects
    from ..physics.worlds.world import check_ending, simulate_world

    earlier = check_files((("--out", "simulate", out),), (vehicle,), force=force)
    check_ending(out)
    hidden = parse_effects(effect or [])
    nominal = load_vehicle(vehicle)
    world = simulate_world(nominal, hidden, programme=programme, duration=duration, noise=noise, seed=seed)
    world.write(out)
    tell_replaced(earlier)
    before = {symbol: nominal.value(symbol) for symbol in world.vehicle.values}
    changed = [f"{s} {before[s]:g} -> {v:g}" for s, v in world.vehicle.values.items() if v != before[s]]
    listed = ", ".join(changed) or "nothing"
    say(f"{out}: {duration:g} s, {programme} manoeuvres, {noise} sensors, seed {seed}; hidden: {listed}")
    for sentence in () if programme == "gentle" else excitation_of([world.truth]).sentences:
        say(f"{sentence} A longer --duration, or another --seed, has more manoeuvres in it.")
