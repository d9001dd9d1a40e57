"""Draw architecture.svg, the house and the way of a log through it.

Floors and arrows are read from the imports, what a floor is for from the first line of its docstring. Run
`python docs/architecture.py` after a room or a floor has been added; a test compares the picture with the code.
"""

import ast
from functools import cache
from html import escape
from math import ceil
from pathlib import Path
from textwrap import wrap

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "architecture.svg"

WAY = {
    "measurements/formats": "read the file",
    "measurements/channels": "name its channels",
    "measurements/quality": "is it sound?",
    "measurements/preparation": "one clock, 10 Hz",
    "discovery/balance": "forces, or rollouts",
    "discovery/candidates": "a column an effect",
    "discovery/search": "which explain it?",
    "discovery/evidence": "how sure? verdict",
    "discovery/lawful": "refit under laws",
    "discovery/experiment": "what to drive next",
    "comparison/comparison": "better, held out?",
    "comparison/failing": "where does it fail?",
    "reports/page": "one page to read",
}
"""The stations of a log on its way to a report, and what happens there."""
DOORS = ("workflows/inputs", "workflows/discover_and_add", "workflows/report")
"""Where a run begins: every station must be reached from there by imports."""

WIDTH, RIGHT, LEFT = 1200, 1130, 376
"""Of the picture; right end of the floors, left end of the rooms [px]."""
CHIP, STEP, ROW, ROW_STEP = 108, 121, 6, 58
"""Width of a room, from one to the next; rooms in a row, from row to row [px]."""
BAND, GAP = 80, 16
"""Height of a floor of one row, and between floors [px]."""
FONT = "Helvetica, Arial, DejaVu Sans, sans-serif"
INK, SOFT, ROUTE = "#1c2b39", "#5b6b7a", "#c2541a"


@cache
def imports() -> dict[str, set[str]]:
    """The files of each floor, as floor/room or floor/file, and what each of them imports."""
    known: dict[str, set[str]] = {}
    floors = [found.parent for found in ROOT.glob("*/__init__.py")]  # tests, benchmarks and the like are none
    for path in sorted(path for floor in floors for path in floor.rglob("*.py")):
        parts = path.relative_to(ROOT).parts
        used = known.setdefault(room(parts), set())
        tree = ast.parse(path.read_text(encoding="utf-8"))
        drawers = drawn_by(tree)
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.level:
                above = parts[: len(parts) - node.level]
                module = tuple(node.module.split(".")) if node.module else ()
                if ".".join((*above, *module)) not in drawers:
                    used |= {room((*above, *module, alias.name)) for alias in node.names}
    return {name: {other for other in used if other in known and other != name} for name, used in known.items()}


def drawn_by(tree: ast.Module) -> set[str]:
    """The modules of whose plots a file knows the type alone, and which are loaded when somebody asks."""
    named = [n for n in ast.walk(tree) if isinstance(n, ast.AnnAssign) and ast.unparse(n.target) == "DRAWN_BY"]
    return {str(ast.literal_eval(node.value)).partition(":")[0] for node in named if node.value is not None}


def room(parts: tuple[str, ...]) -> str:
    """Floor and room of a file, or floor and file where it stands beside the rooms."""
    return "/".join(part.removesuffix(".py") for part in parts[:2])


def levels(graph: dict[str, set[str]]) -> list[str]:
    """The nodes from the bottom up: each above all that it uses."""
    order: list[str] = []
    while len(order) < len(graph):
        ready = sorted(node for node, used in graph.items() if node not in order and used <= set(order))
        if not ready:
            raise SystemExit(f"these use each other in a circle: {sorted(set(graph) - set(order))}")
        order.append(ready[0])
    return order


def reached(graph: dict[str, set[str]], start: str) -> set[str]:
    """All that a node uses, at any distance."""
    seen: set[str] = set()
    waiting = [start]
    while waiting:
        new = graph[waiting.pop()] - seen
        seen |= new
        waiting += new
    return seen


def between_floors(graph: dict[str, set[str]]) -> dict[str, set[str]]:
    """What each floor uses of the others."""
    floors: dict[str, set[str]] = {}
    for name, used in graph.items():
        floor = name.split("/")[0]
        floors.setdefault(floor, set()).update({other.split("/")[0] for other in used} - {floor})
    return floors


def text(x: float, y: float, words: str, size: int = 13, fill: str = INK, more: str = "") -> str:
    """One line of text."""
    return f'<text x="{x:g}" y="{y:g}" font-size="{size}" fill="{fill}" {more}>{escape(words)}</text>'


def chips_of(floor: str, graph: dict[str, set[str]]) -> list[str]:
    """A floor's stations in their order, its other rooms, and as many files as fill the row, the most used first."""
    inside = [name for name in graph if name.startswith(f"{floor}/") and not name.endswith("__init__")]
    stations = [name for name in WAY if name in inside]
    rooms = [name for name in inside if (ROOT / name).is_dir() and name not in stations]
    uses = {name: sum(name in used for used in graph.values()) for name in inside}
    files = sorted(set(inside) - {*stations, *rooms}, key=lambda name: (-uses[name], name))
    shown = stations + rooms
    return shown + files[: ROW * max(ceil(len(shown) / ROW), 1) - len(shown)]


def height(names: list[str]) -> float:
    """Of a floor with these chips."""
    return BAND + ROW_STEP * ((len(names) - 1) // ROW)


def floor_band(floor: str, names: list[str], top: float) -> list[str]:
    """A floor: its name, what it is for, its rooms."""
    told = ast.get_docstring(ast.parse((ROOT / floor / "__init__.py").read_text(encoding="utf-8"))) or ""
    told = told.splitlines()[0].removeprefix(f"{floor.capitalize()}: ")
    told = told[:1].upper() + told[1:]
    parts = [f'<rect x="12" y="{top:g}" width="{RIGHT - 12}" height="{height(names):g}" rx="10" fill="#e9eff5"/>']
    parts.append(text(28, top + 27, floor, 19, more='font-weight="700"'))
    parts += [text(28, top + 45 + 15 * k, line, 12, SOFT) for k, line in enumerate(wrap(told, 46)[:3])]
    for k, name in enumerate(names):
        parts += chip(name, LEFT + STEP * (k % ROW), top + 15 + ROW_STEP * (k // ROW))
    return parts


def chip(name: str, x: float, y: float) -> list[str]:
    """A room, filled, or a file; a station of the log with its number and what happens there."""
    short, station, middle = name.split("/")[1], name in WAY, 'text-anchor="middle"'
    is_room = (ROOT / name).is_dir()
    line = (ROUTE, 2) if station else ("#9fb0bf", 1) if is_room else ("none", 0)
    fill, ink = ("#fff", INK) if is_room or station else ("none", SOFT)
    parts = [
        f'<rect x="{x:g}" y="{y:g}" width="{CHIP}" height="30" rx="6" fill="{fill}" '
        f'stroke="{line[0]}" stroke-width="{line[1]}"/>'
    ]
    parts.append(text(x + CHIP / 2, y + 20, short, 13 if len(short) < 13 else 11, ink, middle))
    if station:
        parts.append(f'<circle cx="{x:g}" cy="{y:g}" r="10" fill="{ROUTE}"/>')
        parts.append(text(x, y + 4, str(list(WAY).index(name) + 1), 11, "#fff", f'{middle} font-weight="700"'))
        parts.append(text(x + CHIP / 2, y + 46, WAY[name], 12, ROUTE, middle))
    return parts


def route(places: dict[str, tuple[float, float]], tops: dict[str, float]) -> str:
    """The way of the log: along a floor from the left, then up between floors and left of the rooms."""
    start = next(iter(WAY))
    x, y = places[start][0] - 44, places[start][1] + 15
    way, here = [f"M{x:g} {y:g}"], start
    for name in WAY:
        left, top = places[name]
        if (floor := here.split("/")[0]) != name.split("/")[0]:
            up = tops[floor] - GAP / 2
            way.append(f"h{(STEP - CHIP) / 2:g} V{up:g} H{LEFT - 22} V{top + 15:g}")
        way.append(f"H{left + CHIP:g}")
        here = name
    return "".join(
        (
            f'<path d="{" ".join(way)}" fill="none" stroke="{ROUTE}" stroke-width="4" stroke-linejoin="round" ',
            'marker-end="url(#head)" opacity="0.55"/>',
            text(x - 6, places[start][1] + 20, "log", 15, ROUTE, 'text-anchor="end" font-weight="700"'),
        )
    )


def uses(floors: dict[str, set[str]], tops: dict[str, float], sizes: dict[str, float]) -> list[str]:
    """Arrows from each floor to those that it uses, but for what another arrow implies."""
    parts = []
    for floor, used in floors.items():
        implied = set().union(*(reached(floors, other) for other in used))
        for k, other in enumerate(sorted(used - implied, key=lambda name: -tops[name])):
            y, end = tops[floor] + sizes[floor] / 2 + 12 * k, tops[other] + sizes[other] / 2 - 14
            bend = 22 + 0.1 * (end - y)
            parts.append(
                f'<path d="M{RIGHT:g} {y:g} C{RIGHT + bend:g} {y:g} {RIGHT + bend:g} {end:g} {RIGHT + 3:g} {end:g}" '
                f'fill="none" stroke="{SOFT}" stroke-width="1.6" marker-end="url(#use)"/>'
            )
    return parts


def draw() -> str:
    """The picture as SVG."""
    graph = imports()
    found = set().union(*({door, *reached(graph, door)} for door in DOORS))
    if lost := [name for name in WAY if name not in found]:
        raise SystemExit(f"no import leads a log to {', '.join(lost)}: mend WAY")
    floors = between_floors(graph)
    names = {floor: chips_of(floor, graph) for floor in levels(floors)}
    sizes = {floor: height(chips) for floor, chips in names.items()}
    tops: dict[str, float] = {}
    top = 50.0
    for floor in reversed(names):
        tops[floor] = top
        top += sizes[floor] + GAP
    places: dict[str, tuple[float, float]] = {
        name: (LEFT + STEP * (k % ROW), tops[floor] + 15 + ROW_STEP * (k // ROW))
        for floor, chips in names.items()
        for k, name in enumerate(chips)
    }
    marks = "".join(
        f'<marker id="{name}" viewBox="0 0 8 8" refX="{at}" refY="4" markerWidth="{size}" markerHeight="{size}" '
        f'orient="auto"><path d="M0 0L8 4L0 8z" fill="{colour}"/></marker>'
        for name, colour, size, at in (("head", ROUTE, 3.5, 2), ("use", SOFT, 7, 7))
    )
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {top:g}" font-family="{FONT}">',
        f"<defs>{marks}</defs>",
        f'<rect width="{WIDTH}" height="{top:g}" fill="#fff"/>',
        text(28, 32, "The house of undertow, and the way of a log through it", 20, more='font-weight="700"'),
        text(WIDTH - 20, 32, "grey arrows: a floor imports what lies below", 13, SOFT, 'text-anchor="end"'),
    ]
    bands = {floor: floor_band(floor, chips, tops[floor]) for floor, chips in names.items()}
    parts += [part[0] for part in bands.values()]
    parts.append(route(places, tops))
    parts += [line for part in bands.values() for line in part[1:]]
    parts += uses(floors, tops, sizes)
    return "\n".join([*parts, "</svg>", ""])


if __name__ == "__main__":
    PICTURE.write_text(draw(), encoding="utf-8")
    print(f"{PICTURE.relative_to(ROOT)} written")
