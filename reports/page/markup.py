"""Markup of the page: its boxes, and its style sheet for light paper, dark screen and print (Okabe-Ito palette)."""

from collections.abc import Iterable, Sequence

from ...exports.elements import NOTHING, Html, element, escaped, render, table

__all__ = ["NOTHING", "Html", "element", "enlargeable", "escaped", "figure", "folded", "lines", "render", "table"]


def folded(title: str, *parts: str) -> Html:
    """A card of details that a reader opens."""
    return element("details", element("summary", element("h3", title)), *parts, cls="card")


def lines(texts: Iterable[str]) -> list[Html]:
    """Each text on a line of its own."""
    return [element("div", text) for text in texts]


def figure(svgs: Sequence[Html], caption: str, *, cls: str = "") -> Html:
    """Drawings side by side with one caption that says what to see."""
    drawings = element("div", *map(enlargeable, svgs), cls=f"plots {cls}".strip())
    return element("figure", drawings, element("figcaption", caption), cls="card")


def enlargeable(svg: Html) -> Html:
    """A drawing that fills the window when it is clicked, and goes back when it is clicked again; without a script."""
    box = Html('<input type="checkbox" aria-label="enlarge this drawing">')
    return element("label", box, svg, cls="zoom")


LIGHT = """
  --paper: #f6f7f8; --card: #ffffff; --ink: #1b2329; --muted: #5d6a75; --grid: #dfe4e8; --surface: #ffffff;
  --measured: #b3bec7; --before: #d55e00; --after: #0072b2; --between: #a9bccb; --likely: #8fc1e0;
  --tint: #eaf3f9; --line: #dfe4e8; --shade: #1b232926;
  --heat1: #d3dbe2; --heat2: #f3c987; --heat3: #f0a04b; --heat4: #d96c1e; --heat5: #a53f0f; --heat6: #5f1f09;
"""
DARK = """
  --paper: #12171c; --card: #1a2127; --ink: #e6ebef; --muted: #9aa8b4; --grid: #313c46; --surface: #1a2127;
  --measured: #6b7986; --before: #ee7f2d; --after: #56b4e9; --between: #4f6779; --likely: #2f6f9c;
  --tint: #1d2f3c; --line: #2d3842; --shade: #e6ebef26;
  --heat1: #3d4954; --heat2: #75502f; --heat3: #ad6524; --heat4: #e08a35; --heat5: #f8bd77; --heat6: #fff1d6;
"""
HEAT_KEY = "\n".join(
    f".key .heat{step} i {{ background: var(--heat{step}); height: {2 + step}px; }}" for step in range(1, 7)
)
MATH = '"Latin Modern Math", "STIX Two Math", "Cambria Math", "Libertinus Math", "DejaVu Math TeX Gyre", math'
"""Fonts with a table of mathematical measures, which tells a browser how far down an index goes.

Without one a browser leaves it on the base line: for that case the style gives the base of an index some depth,
below which MathML puts the index."""
CSS = f"""
:root {{
  color-scheme: light dark;
  --font: system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", sans-serif;
  --mono: ui-monospace, SFMono-Regular, Menlo, Consolas, "DejaVu Sans Mono", monospace;
  --math: {MATH};
  {LIGHT.strip()}
}}
@media (prefers-color-scheme: dark) {{ :root {{ {DARK.strip()} }} }}
@media print {{ :root {{ color-scheme: light; {LIGHT.strip()} --paper: #ffffff; }} }}
* {{ box-sizing: border-box; }}
:focus-visible {{ outline: 3px solid var(--after); outline-offset: 2px; }}
body {{ margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.55 var(--font); }}
main {{ max-width: 1140px; margin: 0 auto; padding: 28px 20px 72px; }}
h1 {{ font-size: clamp(1.5rem, 4vw, 2.15rem); line-height: 1.2; margin: .3em 0 .45em; max-width: 28em; }}
h1 {{ letter-spacing: -.015em; text-wrap: balance; }}
h2 {{ font-size: 1.35rem; letter-spacing: -.01em; margin: 2em 0 .6em; }}
h3 {{ font-size: 1.05rem; margin: 0 0 .3em; }}
section > a[id], details > a[id] {{ scroll-margin-top: 5em; }}
.folded {{ border-top: 1px solid var(--line); margin-top: 0; }}
.folded > summary {{ margin: 0; padding: 12px 0; }}
.folded > summary h2 {{ display: inline; font-size: 1.12rem; margin: 0 0 0 .3em; color: var(--ink); }}
.card > summary {{ margin: 0; }}
.card > summary h3 {{ display: inline; margin: 0 0 0 .3em; color: var(--ink); }}
.contents {{ font-size: .85rem; display: flex; gap: 4px 16px; overflow-x: auto; white-space: nowrap; }}
.contents {{ padding: 10px 12px 6px; scrollbar-width: none; }}
.contents a {{ color: var(--muted); text-decoration: none; }}
.contents a:hover {{ color: var(--after); }}
@media (min-width: 1180px) {{
  body:has(> .contents) {{ display: grid; grid-template-columns: 190px minmax(0, 1fr); }}
  .contents {{ position: sticky; top: 0; align-self: start; flex-direction: column; white-space: normal; }}
  .contents {{ padding: 74px 7px 0 20px; max-height: 100vh; overflow-y: auto; }}
  .contents .detail {{ padding-left: .9em; font-size: .8rem; }}
  body:has(> .contents) > main {{ margin: 0; }}
}}
p, li, summary, h1, h2, h3, figcaption {{ overflow-wrap: break-word; }}
p {{ margin: .4em 0; max-width: 46em; }}
ul {{ padding-left: 1.2em; margin: .4em 0; }}
li {{ margin: .3em 0; max-width: 48em; }}
code {{ font-family: var(--mono); font-size: .88em; overflow-wrap: anywhere; }}
a {{ color: var(--after); }}
summary {{ cursor: pointer; color: var(--muted); margin: 10px 0; }}
.brand {{ color: var(--muted); font-size: .88rem; display: flex; gap: .6em; align-items: center; }}
.brand svg {{ width: 32px; flex: none; }}
.brand b {{ color: var(--after); letter-spacing: .02em; }}
.lead {{ font-size: 1.1rem; color: var(--muted); }}
.card {{
  background: var(--card); border: 1px solid var(--line); border-radius: 12px; padding: 18px 20px; margin: 14px 0;
}}
.numbers {{ display: flex; flex-wrap: wrap; gap: 6px 28px; align-items: center; margin-top: 22px; }}
.big {{ display: flex; flex-direction: column; }}
.big b {{ font-size: clamp(2.3rem, 7vw, 3.5rem); line-height: 1.1; letter-spacing: -.03em; white-space: nowrap; }}
.big small, .numbers .what {{ color: var(--muted); font-size: .9rem; }}
.numbers .what {{ flex: 1 1 300px; line-height: 1.5; }}
.numbers .what strong {{ color: var(--ink); font-size: 1.05rem; }}
.axes {{ display: flex; flex-wrap: wrap; gap: 0 18px; color: var(--ink); }}
.before b {{ color: var(--before); }}
.after b {{ color: var(--after); }}
.arrow {{ font-size: 2rem; color: var(--muted); }}
.key {{ display: flex; flex-wrap: wrap; gap: 4px 20px; margin: 0 0 10px; font-size: .9rem; }}
.key span {{ display: inline-flex; align-items: center; gap: 7px; }}
.key i {{ width: 22px; height: 4px; border-radius: 2px; }}
.key .measured i {{ background: var(--measured); height: 7px; border-radius: 4px; }}
.key .before i {{ background: var(--before); }}
.key .after i, .key .yours i {{ background: var(--after); }}
.key .band i {{ background: var(--after); opacity: .25; height: 12px; }}
{HEAT_KEY}
figure {{ break-inside: avoid; }}
figcaption {{ color: var(--muted); font-size: .9rem; margin-top: 10px; max-width: 56em; }}
svg {{ display: block; width: 100%; height: auto; overflow: visible; }}
.plots.steps {{ display: grid; grid-template-columns: 472fr 162fr 162fr 162fr; }}
.plots.steps + .plots {{ margin-top: 8px; }}
.side {{ align-self: center; color: var(--muted); font-size: .92rem; padding-right: 18%; text-align: right; }}
.side b {{ color: var(--ink); font-size: 1.05rem; }}
.plots.trio {{ display: grid; gap: 14px 22px; }}
.plots.trio {{ grid-template-columns: repeat(auto-fit, minmax(min(100%, 270px), 1fr)); }}
.plots.trio svg {{ max-width: 400px; }}
.plots.pair {{ display: grid; gap: 18px 32px; }}
.plots.pair {{ grid-template-columns: repeat(auto-fit, minmax(min(100%, 400px), 1fr)); }}
.plots.pair svg {{ max-width: 560px; }}
.plots.wide {{ overflow-x: auto; }}
.plots.wide svg {{ min-width: 620px; }}
.plots.one svg {{ max-width: 560px; }}
figure.card:has(> .plots.one) {{ display: grid; gap: 8px 24px; align-items: center; }}
figure.card:has(> .plots.one) {{ grid-template-columns: repeat(auto-fit, minmax(min(100%, 300px), 1fr)); }}
.plots.three {{ display: grid; gap: 14px; grid-template-columns: repeat(auto-fit, minmax(min(100%, 260px), 1fr)); }}
.plots.three svg {{ max-width: 400px; }}
.columns {{ display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 400px), 1fr)); gap: 14px; }}
.columns:has(> .effect) {{ grid-template-columns: repeat(auto-fit, minmax(min(100%, 300px), 1fr)); }}
.columns {{ margin: 14px 0; }}
.columns > .card {{ margin: 0; min-width: 0; }}
.scroll + h3, .facts + h3 {{ margin-top: 1.6em; }}
.columns > .card:only-child svg {{ max-width: 560px; }}
.effect {{ border-left: 5px solid var(--line); }}
.effect.missing {{ border-left-color: var(--after); }}
.effect.likely {{ border-left-color: var(--likely); }}
.effect.possible {{ border-left: 5px dashed var(--after); }}
.answer {{ display: grid; grid-template-columns: max-content minmax(0, 1fr); gap: 6px 16px; margin: 0 0 14px; }}
.answer dt {{ font-weight: 600; color: var(--after); }}
.answer dd {{ margin: 0; max-width: 50em; }}
.equation {{
  display: inline-block; font-family: var(--mono); font-size: .95rem; background: var(--tint); border-radius: 7px;
  padding: 5px 11px; margin: 5px 0; overflow-wrap: anywhere;
}}
.balance {{ display: flex; flex-wrap: wrap; align-items: first baseline; gap: 8px 6px; margin: 4px 0 20px; }}
.term {{ display: inline-flex; flex-direction: column; align-items: center; padding: 3px 2px; border-radius: 7px; }}
math {{ font-family: var(--math); }}
msub > :first-child {{ padding-bottom: .16em; }}
.term > math {{ font-size: 1.28rem; line-height: 1.5; white-space: nowrap; }}
.term small {{ font-size: .74rem; color: var(--muted); white-space: nowrap; }}
.term.new {{ background: var(--tint); padding: 3px 8px; box-shadow: inset 0 -2.5px var(--after); }}
.term.new > math {{ color: var(--after); }}
.term.new small {{ color: var(--ink); }}
.verdict {{ font-size: 1.1rem; }}
.mark {{ color: var(--muted); font-weight: 700; }}
.mark.better, b.pass {{ color: var(--after); }}
.mark.worse, b.fail {{ color: var(--before); }}
b.noted {{ color: var(--muted); }}
.told {{ font-size: .92rem; margin: 10px 0 0; }}
.told dt {{ font-weight: 600; margin-top: .5em; }}
.told dd {{ margin: 0 0 0 1em; max-width: 52em; }}
.facts {{ color: var(--muted); font-size: .92rem; }}
.warn {{ border-left: 3px solid var(--before); padding-left: 10px; font-size: .92rem; }}
.warning {{ border-left: 6px solid var(--before); font-size: 1.06rem; font-weight: 600; max-width: none; }}
.zoom {{ display: block; min-width: 0; }}
.zoom input {{ position: absolute; opacity: 0; width: 1px; height: 1px; }}
.zoom:has(:focus-visible) {{ outline: 3px solid var(--after); outline-offset: 4px; }}
.plots.wide .zoom:has(:focus-visible) {{ outline-offset: -3px; }}
@media screen {{
  .zoom {{ cursor: zoom-in; }}
  .zoom:has(:checked) {{
    position: fixed; inset: 0; z-index: 9; padding: 3vmin; background: var(--card); cursor: zoom-out;
    display: grid; align-items: center;
  }}
  .zoom > :checked + svg {{ max-width: none !important; min-width: 0 !important; width: 100%; height: 94vh; }}
}}
.scroll {{ overflow-x: auto; }}
.scroll, .plots.wide {{
  background:
    linear-gradient(to right, var(--card) 40%, transparent) left, linear-gradient(to left, var(--card) 40%, transparent)
    right, linear-gradient(to right, var(--shade), transparent) left, linear-gradient(to left, var(--shade),
    transparent) right;
  background-size: 48px 100%, 48px 100%, 14px 100%, 14px 100%; background-repeat: no-repeat;
  background-attachment: local, local, scroll, scroll;
}}
table {{ border-collapse: collapse; min-width: min(100%, 36rem); font-size: .9rem; }}
td.text small {{ display: block; color: var(--muted); }}
table {{ font-variant-numeric: tabular-nums; }}
caption {{ text-align: left; color: var(--muted); padding: 4px 0 8px; }}
th {{ font-weight: 600; color: var(--muted); font-size: .82rem; vertical-align: bottom; }}
th, td {{ padding: 6px 9px; border-bottom: 1px solid var(--line); text-align: right; }}
td {{ white-space: nowrap; }}
th:first-child, td:first-child {{ padding-left: 0; }}
th.text, td.text {{ text-align: left; white-space: normal; }}
.wordy table {{ min-width: min(58rem, max(100%, 46rem)); }}
.wordy td.text:last-child {{ min-width: 12rem; }}
td div {{ white-space: nowrap; }}
tbody tr:last-child td {{ border-bottom: 0; }}
.tag {{
  display: inline-block; border-radius: 99px; padding: 0 9px; font-size: .8rem; border: 1px solid var(--line);
  color: var(--muted); white-space: nowrap;
}}
.tag.missing {{ background: var(--after); border-color: var(--after); color: var(--card); font-weight: 600; }}
.tag.likely {{ background: var(--likely); border-color: var(--likely); color: var(--ink); font-weight: 600; }}
.tag.possible {{ border-color: var(--after); color: var(--after); }}
.board {{ display: grid; grid-template-columns: minmax(280px, 1fr) 1.6fr; gap: 10px 30px; }}
.board canvas {{ display: block; width: 100%; touch-action: pan-y; }}
.stage canvas[data-play=time] {{ height: 240px; cursor: crosshair; margin-top: 8px; }}
.stage canvas[data-play=track] {{ height: 230px; }}
.desk .error b {{ font-size: 2.3rem; line-height: 1.1; color: var(--after); letter-spacing: -.02em; }}
.desk .error small {{ color: var(--muted); display: block; }}
.meter {{ height: 7px; border-radius: 4px; background: var(--grid); margin: 6px 0 14px; overflow: hidden; }}
.meter i {{ display: block; height: 100%; width: 0; background: var(--after); border-radius: 4px; }}
.knob {{ display: block; margin: 8px 0; font-size: .9rem; }}
.knob .name {{ display: flex; justify-content: space-between; gap: 10px; flex-wrap: wrap; }}
.knob .name > span {{ color: var(--muted); }}
.knob .name b {{ color: var(--ink); }}
.knob output {{ white-space: nowrap; font-variant-numeric: tabular-nums; }}
.knob input, .window input {{ width: 100%; margin: 3px 0 0; accent-color: var(--after); }}
.knob .ends {{ display: block; position: relative; height: 6px; margin: 0 8px; }}
.knob .ends i {{ position: absolute; top: 0; width: 3px; height: 6px; margin-left: -1px; background: var(--after); }}
.knob .ends i.before {{ background: var(--before); }}
.buttons {{ display: flex; gap: 10px; margin-top: 12px; }}
.play button, .window select {{
  font: inherit; color: var(--ink); background: var(--paper); border: 1px solid var(--line); border-radius: 8px;
  padding: 4px 12px; cursor: pointer;
}}
.window {{ display: flex; flex-wrap: wrap; gap: 8px 16px; align-items: center; font-size: .9rem; color: var(--muted); }}
.window button {{ min-width: 5.2em; }}
.window input {{ flex: 1 1 140px; width: auto; min-width: 0; }}
.window output {{ min-width: 4.6em; font-variant-numeric: tabular-nums; }}
.where {{ font-size: .85rem; color: var(--muted); font-variant-numeric: tabular-nums; min-height: 1.5em; }}
footer {{ color: var(--muted); font-size: .9rem; }}
@media (max-width: 720px) {{
  main {{ padding: 18px 12px 48px; }}
  .card {{ padding: 14px; }}
  .numbers {{ column-gap: 14px; }}
  .answer {{ grid-template-columns: minmax(0, 1fr); gap: 0; }}
  .answer dd {{ margin-bottom: 8px; }}
  h2 {{ margin-top: 1.5em; }}
  .effect p {{ font-size: .92rem; line-height: 1.45; }}
  .plots.three svg {{ max-width: 330px; }}
  .stage canvas[data-play=track] {{ height: 280px; }}
  .stage canvas[data-play=time] {{ height: 300px; }}
  .plots.steps {{ grid-template-columns: 1fr 1fr 1fr; gap: 6px; }}
  .board {{ grid-template-columns: minmax(0, 1fr); }}
  .plots.wide::before, .scroll:has(th:nth-child(5))::before, .wordy .scroll::before {{
    content: "scroll sideways \\2192"; display: block; position: sticky; left: 0; width: max-content;
    color: var(--muted); font-size: .8rem; padding-bottom: 4px;
  }}
  .plots.steps > :first-child {{ grid-column: 1 / -1; text-align: left; padding: 0; }}
}}
.paper {{ display: none; }}
@page {{ size: A4; margin: 13mm 12mm; }}
@media print {{
  .play, .contents, details:not([open], .folded, .card) {{ display: none; }}
  .paper {{ display: block; }}
  .appendix {{ break-before: page; }}
  .appendix + section > h2 {{ margin-top: .6em; }}
  body:has(> .contents) {{ display: block; }}
  .folded::details-content, details.card::details-content {{ content-visibility: visible; block-size: auto; }}
  .folded > summary, .card > summary {{ list-style: none; }}
  .folded > summary {{ padding: 1.2em 0 0; }}
  :root {{ font-size: 12px; }}
  body {{ font-size: 9pt; line-height: 1.42; }}
  main {{ max-width: none; padding: 0; }}
  h1 {{ font-size: 17pt; }}
  h2 {{ margin: 1.3em 0 .4em; font-size: 12pt; }}
  .folded > summary h2 {{ font-size: 12pt; margin: 0; }}
  .lead {{ font-size: 10pt; }}
  .card {{ padding: 9px 12px; margin: 8px 0; border-radius: 7px; box-decoration-break: clone; }}
  .numbers {{ margin-top: 10px; }}
  .big b {{ font-size: 24pt; }}
  figcaption, .facts, .warn, .told, .key {{ font-size: 8pt; margin-top: 4px; }}
  .card p {{ max-width: none; }}
  .effect, .balance, .warning, tr, li, dd {{ break-inside: avoid; }}
  h2, h3, summary, .key, dt {{ break-after: avoid; }}
  table, .wordy table {{ min-width: 0; font-size: 8pt; }}
  .paper table {{ width: 100%; }}
  .effect .tag {{ white-space: normal; border-radius: 6px; }}
  td, td div {{ white-space: normal; }}
  td.text {{ overflow-wrap: anywhere; min-width: 7em; }}
  .wordy td.text:last-child {{ min-width: 0; }}
  .term > math {{ font-size: 11pt; }}
  .term small {{ font-size: 7pt; }}
  .plots.three, .plots.trio, .columns:has(> .effect) {{ grid-template-columns: repeat(3, minmax(0, 1fr)); }}
  .plots.trio, .columns {{ gap: 8px 14px; margin: 8px 0; }}
  .plots.pair, .columns {{ grid-template-columns: repeat(2, minmax(0, 1fr)); }}
  .plots svg {{ max-height: 88mm; }}
  .plots.wide svg {{ min-width: 0; max-height: 135mm; }}
  .told {{ columns: 2; }}
  .scroll, .plots.wide {{ overflow: visible; background: none; }}
  .scroll::before, .plots.wide::before {{ display: none !important; }}
  th, td {{ padding: 2px 6px; }}
}}
""".strip()
