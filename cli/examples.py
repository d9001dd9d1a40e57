"""Examples of every verb, shown below its options."""

EXAMPLES = {
    "demo": ("undertow demo",),
    "init": (
        "undertow init boat.bin --mass 22 --length 1.2",
        "undertow init logs/ --like otter --out boat.yaml --channels map.yaml",
    ),
    "inspect": (
        "undertow inspect boat.bin --vehicle blueboat",
        "undertow inspect boat.csv --fix repaired.csv --map-out channels.yaml",
    ),
    "compare": (
        "undertow compare boat.csv --vehicle boat.yaml --model run --model lstm",
        "undertow compare boat.csv --vehicle boat.yaml --split all --out comparison.json --json",
        "undertow compare second.csv --vehicle boat.yaml --model run --page second",
    ),
    "check": ("undertow check run", "undertow check lstm boat.csv --vehicle boat.yaml --out audit.json"),
    "ci": (
        "undertow ci logs/ --vehicle boat.yaml --limits limits.yaml",
        "undertow ci boat.csv --vehicle boat.yaml --write-limits limits.yaml --margin 0.3",
    ),
    "discover": (
        "undertow discover boat.csv --vehicle boat.yaml --out run",
        "undertow discover logs/*.bin --vehicle boat.yaml --refit --out run",
    ),
    "fit": (
        "undertow fit boat.csv --vehicle boat.yaml --out fitted.yaml",
        "undertow fit boat.csv --vehicle boat.yaml --free X_uu --hold N_rdot --out fitted.yaml",
    ),
    "add": (
        "undertow add surge_quadratic_damping munk_moment --run run --out corrected.yaml",
        "undertow add 'yaw:u|r|' boat.csv --vehicle boat.yaml",
    ),
    "adapt": (
        "undertow adapt boat.csv --vehicle boat.yaml --follow",
        "undertow adapt - --vehicle boat.yaml --effect surge_quadratic_damping --every 5 --json",
        "undertow adapt boat.csv --vehicle boat.yaml --like monday.csv --out now.yaml --values values.csv",
    ),
    "fleet": (
        "undertow fleet logs/ --vehicle boat.yaml --out fleet",
        "undertow fleet boats.csv s3://bucket/2026/ --vehicle boat.yaml --workers 4 --out fleet",
    ),
    "diary": ("undertow diary fleet --out diary.html", "undertow diary fleet --false-alarms 0.2 --json"),
    "merge": ("undertow merge north south --out fleet",),
    "cluster": ("undertow cluster --workers 2",),
    "plan": (
        "undertow plan run --space 40 --thrust 60 --at 54.3233,10.1394 --out mission",
        "undertow plan run munk_moment sway_added_mass --speed 1.5 --out mission",
    ),
    "train": (
        "undertow train boat.csv --vehicle boat.yaml --residual lstm --out lstm --explain",
        "undertow train boat.csv --vehicle boat.yaml --residual mlp --epochs 50 --out mlp --resume",
        "undertow train sister.csv --vehicle sister.yaml --start lstm --set learning_rate=0.001 --out sister-lstm",
    ),
    "explain": ("undertow explain lstm boat.csv --vehicle boat.yaml",),
    "effects": ("undertow effects", "undertow effects munk_moment --vehicle otter"),
    "simulate": (
        "undertow simulate --vehicle otter --effect steady_current=0.2,-0.1 --out otter.csv.gz",
        "undertow simulate --vehicle blueboat --programme zigzag --noise rough --duration 120 --out log.parquet",
    ),
    "app": ("undertow app", "undertow app boat.bin --vehicle boat.yaml --port 8500"),
    "export": (
        "undertow export run --to c --time-step 0.02 --out boat.h",
        "undertow export blueboat --to sdf --gz fortress --out blueboat.sdf",
    ),
    "control": (
        "undertow control blueboat --effect surge_quadratic_damping=-25 --out square.svg",
        "undertow control boat.yaml run lstm --true true.yaml --track eight --track station --controller nmpc",
    ),
    "report": ("undertow report run --model lstm --pdf", "undertow report monday tuesday --out fleet.html"),
}
"""By verb; a test parses each of them."""


def below(verb: str, *more: str) -> str:
    """What stands below the options of a verb: its examples, a line each, then more paragraphs."""
    return "\n\n".join(["Examples:", *(f"  {line}" for line in EXAMPLES[verb]), *more])
