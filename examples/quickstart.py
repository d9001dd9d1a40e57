from pathlib import Path

import undertow

data = Path(undertow.__file__).parent / "data"
inputs = undertow.read_inputs(data / "gazebo_blueboat.csv.gz", data / "demo.yaml")
run = undertow.discover(inputs)

print(run.findings.headline)
for effect in run.findings.candidates:
    for term in effect.terms if effect.in_model else ():
        print(f"{term.symbol:4} {term.value:7.2f} {term.unit} ({effect.verdict}, {int(100 * effect.confidence)} %)")
for step in run.findings.steps:
    print(f"{step.rollout_rmse['10'].position:.2f} m, adding {step.added or 'nothing'}")
undertow.write_run(run, "blueboat-run")
