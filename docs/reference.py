"""Write reference.md and a page for each topic in `reference/`: public names, and files that people extend.

Run `python docs/reference.py` after a public name has been added to `TOPICS`; a test compares the pages with the code.
The site puts the whole docstrings below each (`conf.py`).
"""

import ast
import inspect
import sys
from importlib import import_module
from itertools import pairwise
from pathlib import Path

import undertow

HERE = Path(__file__).resolve().parent
EXTENDING = "extending"
TOPICS = {
    "logs": (
        "Logs",
        "read, checked and prepared",
        "read_log inspect_log read_inputs prepare split Log Motion Inputs Reading DataSet Recipe PAPER WEAK",
    ),
    "vehicles": (
        "Vehicles",
        "their files and their numbers",
        "load_vehicle init fit simulate_world EFFECTS Vehicle Hull",
    ),
    "discovery": (
        "Discovery",
        "what is missing, what it is worth, what to drive next",
        "discover add plan write_plan DiscoverySettings Findings Bounds",
    ),
    "runs": ("Run folders", "kept, read, reported and drawn", "load_run write_run report Run Moved Plots"),
    "models": (
        "Models",
        "compared, judged by laws, held to limits, exported",
        "load_model compare check audit ci first_limits load_limits export Audit Limits Choices",
    ),
    "networks": ("Networks", "trained and explained", "train distil TrainRun TrainingSettings Augmentation Choice"),
    "steering": (
        "Closed loop and live",
        "steered with a model, followed along a log",
        "control adapt Trial AdaptSettings",
    ),
    "fleets": (
        "Fleets",
        "many boats, and a hull over months",
        "build_fleet merge_fleets read_fleet diary_of Fleet HullEstimate WatchSettings Engine",
    ),
    "factors": (
        "Factors",
        "long logs as small matrices",
        "compress ensemble read_factors write_factors Factors Ensemble",
    ),
    "errors": ("Errors", "the three ways to refuse", "LogError VehicleError RequestError"),
}
"""By page: its title, what it is about, and its public names, in the order in which they are shown."""
MODULES = {
    "physics.effects": "Effect Parameter",
    "physics.laws.audit.base": "Law Ruling",
    "residuals.models.base": "Model",
    "residuals.networks.base": "Network Scaling",
    "measurements.formats.base": "Format Head Request Recording Stream",
    "measurements.quality.record": "Check Finding Fix",
    "reports.page.chapters.base": "Chapter Section",
    "physics.worlds.world": "World Sensors Orders",
}
"""Files beside which, or in which, people add something of their own, and what they need of each; see extending.md."""


def names_of(topic: str) -> list[str]:
    """The public names on a page."""
    return TOPICS[topic][2].split()


def directive(name: str) -> str:
    """What autodoc is asked for a public name."""
    kind = _kind(name)
    more = "\n   :no-value:" if kind == "data" else "\n   :members:" if kind == "class" else ""
    return f".. auto{kind}:: undertow.{name}{more}"


def _kind(name: str) -> str:
    thing = getattr(undertow, name)
    return "class" if inspect.isclass(thing) else "function" if callable(thing) else "data"


def told(name: str) -> str:
    """The first paragraph of a name's docstring, on one line."""
    thing = getattr(undertow, name)
    text = (inspect.getdoc(thing) or "") if _kind(name) != "data" else below_assignment(name)
    return " ".join(text.split("\n\n")[0].split()).replace("|", "\\|")


def below_assignment(name: str) -> str:
    """The text that stands below a constant."""
    home = undertow._PUBLIC[name].partition(":")[0]
    body = ast.parse(Path(import_module(f"undertow.{home}").__file__ or "").read_text(encoding="utf-8")).body
    for node, after in pairwise(body):
        named = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if any(isinstance(one, ast.Name) and one.id == name for one in named):
            match after:
                case ast.Expr(value=ast.Constant(value=str() as text)):
                    return text
    return ""


def docstrings(topic: str) -> str:
    """What stands in the code of every name of a page, for autodoc."""
    if topic == EXTENDING:
        named = [f"undertow.{module}.{name}" for module, names in MODULES.items() for name in names.split()]
        return "\n\n".join(f".. autoclass:: {name}\n   :members:" for name in named)
    return "\n\n".join(directive(name) for name in names_of(topic))


def pages() -> dict[str, str]:
    """The text of each page, by its path below `docs/`."""
    listed = [name for topic in TOPICS for name in names_of(topic)]
    unlisted = set(undertow.__all__) ^ set(listed)
    assert not unlisted, f"docs/reference.py: put {unlisted} into one of TOPICS"
    assert len(set(listed)) == len(listed), "docs/reference.py: a name stands in two of TOPICS"
    foot = "Written by `python docs/reference.py` from the docstrings; do not edit."
    topics = [f"- [{title}](reference/{topic}.md): {about}" for topic, (title, about, _) in TOPICS.items()]
    head = "What `import undertow` offers, by topic. `help(undertow.discover)` shows the docstring of one; the site,"
    found = {
        "reference.md": _page(
            "# Reference",
            f"{head}\nwhich `make docs` builds, shows all of them.",
            "## Python\n" + "\n".join([*topics, f"- [Where to extend it](reference/{EXTENDING}.md): base classes"]),
            foot,
        )
    }
    for topic, (title, about, _) in TOPICS.items():
        rows = [f"| `undertow.{name}` | {told(name)} |" for name in names_of(topic)]
        table = "\n".join(["| name | what it is |", "| --- | --- |", *rows])
        found[f"reference/{topic}.md"] = _page(f"# {title}: {about}", table, foot)
    files = {name.replace(".", "/") + ".py": import_module(f"undertow.{name}") for name in MODULES}
    rows = [f"| [`{path}`](../../{path}) | {(file.__doc__ or '').splitlines()[0]} |" for path, file in files.items()]
    table = "\n".join(["| file | what it is |", "| --- | --- |", *rows])
    about = "[Extending](../extending.md) adds one thing of each kind."
    found[f"reference/{EXTENDING}.md"] = _page("# Where to extend it", about, table, foot)
    return found


def _page(*parts: str) -> str:
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    written = pages()
    for path, text in written.items():
        if "--text" in sys.argv:
            print(text)
        else:
            (HERE / path).parent.mkdir(exist_ok=True)
            (HERE / path).write_text(text, encoding="utf-8")
    if "--text" not in sys.argv:
        print(f"{len(written)} pages written")
