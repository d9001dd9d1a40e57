"""A world with two hidden effects, its log, and what `discover` makes of it: a way to learn what a manoeuvre can show.

Run it as `python examples/hidden_effect.py`; it writes `otter.csv.gz` into the folder in which it is run.
"""

import undertow

HIDDEN = {"steady_current": (0.2, -0.1), "sway_lift": 20.0}  # [m/s] north and east; [N s^2/(m rad)]

otter = undertow.load_vehicle("otter")
world = undertow.simulate_world(otter, HIDDEN, duration=300.0, noise="field", seed=0)
world.write("otter.csv.gz")

run = undertow.discover(undertow.read_inputs("otter.csv.gz", otter))
print(run.findings.headline)
for effect in run.findings.candidates:
    if effect.verdict == "no evidence":
        continue
    print(f"{effect.effect}: {effect.verdict}")
    for term in effect.terms:
        interval = f" (95 %: {term.ci95.lower:.3g} to {term.ci95.upper:.3g})" if term.ci95 else ""
        print(f"  {term.symbol} = {term.value:.3g} {term.unit}{interval}")
