"""A page gone through with the Tab key alone: what gets the focus, how it shows, and what it is called."""

from typing import Any, NamedTuple

_STOPS = """() => {
  const able = 'a[href], button, input, select, textarea, summary, [tabindex]';
  const within = [...document.querySelectorAll('[aria-modal=true]')].at(-1) ?? document;
  const stops = [...within.querySelectorAll(able)].filter(one =>
    one.tabIndex >= 0 && !one.disabled && !one.closest('[inert]') && one.getAttribute('aria-disabled') !== 'true'
    && one.checkVisibility({visibilityProperty: true, contentVisibilityAuto: true})
    && !(one.type === 'radio' && !one.checked && document.querySelector(`input[name="${one.name}"]:checked`)));
  window.stops = stops;
  window.told = one => `${one.ariaLabel ?? one.innerText ?? ''} ${one.outerHTML.slice(0, 100)}`.replaceAll('\\n', ' ');
  return stops.length;
}"""
_FOCUS = """() => {
  const one = document.activeElement;
  if (!one || one === document.body || one.tabIndex < 0) return null;
  const parse = text => {
    const found = text.match(/[\\d.]+/g)?.map(Number) ?? [0, 0, 0, 0];
    return found.length < 4 ? [...found, 1] : found;
  };
  const light = ([r, g, b]) => {
    const [x, y, z] = [r, g, b].map(c => c / 255).map(c => c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
    return 0.2126 * x + 0.7152 * y + 0.0722 * z;
  };
  const ratio = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  const behind = from => {
    for (let box = from; box; box = box.parentElement) {
      const colour = parse(getComputedStyle(box).backgroundColor);
      if (colour[3] > 0.99) return colour;
    }
    return [255, 255, 255, 1];
  };
  let ring = one;
  const drawn = box => {
    const style = getComputedStyle(box);
    return style.outlineStyle === 'solid' && parseFloat(style.outlineWidth) >= 2 && parse(style.outlineColor)[3] > 0.99
      && Number(style.opacity) > 0;
  };
  for (let far = 0; far < 5 && ring && !drawn(ring); far++) ring = ring.parentElement;
  const box = (ring ?? one).getBoundingClientRect();
  return {
    told: window.told(one),
    stop: (window.stops ?? []).indexOf(one),
    contrast: ring && drawn(ring)
      ? ratio(light(parse(getComputedStyle(ring).outlineColor)), light(behind(ring.parentElement))) : 0,
    seen: box.width > 1 && box.height > 1 && box.bottom > 0 && box.right > 0
      && box.top < innerHeight && box.left < innerWidth,
  };
}"""


_GLANCES = 20
"""How often the focus is looked at, 50 ms apart, until it is drawn and scrolled to: a busy machine does that late."""


class Focus(NamedTuple):
    """What the Tab key came to: its HTML, the contrast of the outline about it (0: none), whether that is in view."""

    told: str
    contrast: float
    seen: bool


def tab_through(page: Any, most: int = 400) -> tuple[list[Focus], list[str]]:
    """Press Tab until it comes to the same again; what got the focus, and what never did."""
    count = page.evaluate(_STOPS)
    found, reached = [], set()
    for _ in range(most):
        page.keyboard.press("Tab")
        now = _focus(page)
        if now is None or now["stop"] < 0:  # beyond the end, from where the next press comes to the top, or drawn anew
            continue
        if now["stop"] in reached:
            break
        reached.add(now["stop"])
        found.append(Focus(now["told"], now["contrast"], now["seen"]))
    missed = [k for k in range(count) if k not in reached]
    return found, page.evaluate("some => some.map(k => window.told(window.stops[k]))", missed)


def _focus(page: Any) -> dict[str, Any] | None:
    """What has the focus, as soon as its outline is drawn and in view, or as it is at last."""
    now = None
    for _ in range(_GLANCES):
        now = page.evaluate(_FOCUS)
        if now is None or now["stop"] < 0 or (now["seen"] and now["contrast"] >= 3.0):
            break
        page.wait_for_timeout(50)
    return now


def nameless(page: Any) -> list[str]:
    """Roles of what can have the focus and has no name that a screen reader could say."""
    nodes = page.context.new_cdp_session(page).send("Accessibility.getFullAXTree")["nodes"]
    return [
        f"{node['role']['value']} {node.get('description', {}).get('value', '')}"
        for node in nodes
        if not node["ignored"]
        and node["role"]["value"] not in ("RootWebArea", "generic", "none")
        and any(one["name"] == "focusable" and one["value"].get("value") for one in node.get("properties", []))
        and not node.get("name", {}).get("value")
    ]
