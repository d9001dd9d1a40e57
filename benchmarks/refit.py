"""Count how often `discover --refit` names the hidden effect and nothing else, with every parameter of the model wrong.

    python benchmarks/refit.py [--plain]

Every hull is a random sister of a shipped vehicle with one hidden effect of typical size, or none; the nominal model
has each damping and added mass wrong by up to a third. `--plain` runs `discover` without `--refit` beside it. An effect
that acts through freed parameters, as the coupling of CyberShip II does, should not be named.
"""

import argparse

import numpy as np

from undertow.discovery.basis import DiscoverySettings
from undertow.discovery.candidates.candidate import calibratable
from undertow.discovery.discover import find_missing
from undertow.physics.effects import effect_named
from undertow.physics.vehicle import load_vehicle
from undertow.physics.worlds.hidden_effects import random_hull, typical_effect
from undertow.physics.worlds.world import simulate_world

WORLDS = (("blueboat", "field", "rich"), ("blueboat", "field", "gentle"), ("blueboat", "rough", "rich"))
WORLDS += (("otter", "rough", "rich"), ("cybership2", "field", "rich"))
HIDDEN = (
    *("munk_moment", "sway_lift", "yaw_speed_damping", "reverse_thrust_loss", "thruster_lag", "input_delay"),
    *("thruster_asymmetry", "steady_current", "mean_wind", "yaw_trim", "surge_turn_drag", "advance_loss"),
    *("thrust_dead_zone", "sway_yaw_coupling", "cg_offset", "wake_memory", None, None, None),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plain", action="store_true")
    plain = parser.parse_args().plain
    for name, noise, programme in WORLDS:
        exact = wrong = plainly_wrong = 0
        for k, effect in enumerate(HIDDEN):
            rng = np.random.default_rng(100 + k)
            true = random_hull(load_vehicle(name), rng)
            hidden = typical_effect(effect, true, rng) if effect else {}
            symbols = calibratable(true)
            nominal = true.with_values({s: true.value(s) * (1.0 + rng.uniform(-0.33, 0.33)) for s in symbols})
            motion = simulate_world(true, hidden, programme=programme, noise=noise, seed=k).motion(0.05)
            findings = find_missing([motion], nominal, DiscoverySettings(refit=True)).findings
            freed = effect is not None and set(effect_named(effect).symbols) <= set(symbols)
            want = {effect} if effect and not freed else set()
            exact, wrong = exact + (set(findings.missing) == want), wrong + bool(set(findings.missing) - want)
            if set(findings.missing) != want:
                print(f"  {effect}: {', '.join(findings.missing) or findings.verdict}", flush=True)
            if plain:
                plainly_wrong += bool(set(find_missing([motion], nominal).findings.missing) - want)
        more = f", without --refit a wrong name in {plainly_wrong}" if plain else ""
        print(
            f"{name}, {noise}, {programme}: exact {exact} of {len(HIDDEN)}, a wrong name in {wrong}{more}", flush=True
        )


if __name__ == "__main__":
    main()
