// What the workbench's plots share: colours, numbers, canvases, ticks, motion, and the cursor that all of them show.

const CURSOR = "undertow:cursor";

// Colours are CSS variables of the page, so that light and dark are told in one place.
export const colour = (element, name) => {
  const style = getComputedStyle(element);
  return style.getPropertyValue("--" + name).trim() || style.color;
};

// The page changes its colours by the system's wish, or by a class or attribute on its root or body.
export function whenColoursChange(handler) {
  const query = window.matchMedia("(prefers-color-scheme: dark)"), seen = new MutationObserver(handler);
  const options = { attributes: true, attributeFilter: ["class", "style", "data-theme"] };
  query.addEventListener("change", handler);
  seen.observe(document.documentElement, options);
  seen.observe(document.body, options);
  return () => { query.removeEventListener("change", handler); seen.disconnect(); };
}

export const written = (x, digits) => {
  if (x === null || x === undefined || !Number.isFinite(x)) return "\u2013";
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e6 || size < 1e-4) return x.toExponential(1).replaceAll("-", "\u2212");
  return String(Number(x.toPrecision(digits))).replace("-", "\u2212");
};

export function ticks(low, high, count) {
  const raw = (high - low) / count, power = Math.pow(10, Math.floor(Math.log10(raw)));
  const size = [1, 2, 5, 10].map((n) => n * power).find((n) => n >= raw);
  const found = [];
  for (let x = Math.ceil(low / size) * size; x <= high + 1e-9 * size; x += size) found.push(Math.abs(x) < 1e-9 * size ? 0 : x);
  return found;
}

// A name on the card's colour, cut to what there is room for; none where there is next to none.
export function label(pen, text, x, y, room, element) {
  let shown = text;
  while (shown.length > 1 && pen.measureText(shown).width > room) shown = shown.replace(/.\u2026?$/, "") + "\u2026";
  if (pen.measureText(shown).width > room || shown === "\u2026") return;
  pen.save();
  pen.globalAlpha = 0.85; pen.fillStyle = colour(element, "surface");
  const size = parseFloat(pen.font);
  pen.fillRect(x - 2, y, pen.measureText(shown).width + 4, 1.25 * size);
  pen.globalAlpha = 1; pen.textBaseline = "top"; pen.textAlign = "left"; pen.fillStyle = colour(element, "ink");
  pen.fillText(shown, x, y + 1);
  pen.restore();
}

export function prepared(canvas) {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  const wide = Math.round(width * ratio), high = Math.round(height * ratio);
  if (canvas.width !== wide || canvas.height !== high) { canvas.width = wide; canvas.height = high; }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "12px " + getComputedStyle(canvas).fontFamily;
  pen.lineJoin = "round";
  return [pen, width, height];
}

// Stroke a line through places (NaN breaks it) in short strokes: a browser takes five times as long for one long one.
const SHORT = 40;

export function traced(pen, xs, ys, style, thick) {
  pen.strokeStyle = style; pen.lineWidth = thick; pen.lineJoin = "bevel"; pen.lineCap = "round";
  let count = 0;
  for (let k = 0; k < xs.length; k++) {
    if (!(ys[k] === ys[k] && xs[k] === xs[k])) { if (count > 1) pen.stroke(); count = 0; continue; }
    if (count === 0) { pen.beginPath(); pen.moveTo(xs[k], ys[k]); } else pen.lineTo(xs[k], ys[k]);
    count += 1;
    if (count === SHORT) { pen.stroke(); pen.beginPath(); pen.moveTo(xs[k], ys[k]); count = 1; }
  }
  if (count > 1) pen.stroke();
}

// The same for a line that goes up and down within every pixel: a bar in each column, from its lowest to its highest
// place and on to where the column before it ended.
export function barred(pen, xs, ys, style, thick, wide) {
  pen.fillStyle = style;
  const half = 0.5 * thick;
  let column = -1, low = 0, high = 0, end = NaN;
  const bar = (next) => {
    if (column < 0) return;
    const top = Math.round(low - half), columns = next === column + 2 ? 2 : 1;  // one that was left out is no gap
    pen.fillRect(column * wide, top, columns * wide, Math.max(Math.round(high + half) - top, 1));
  };
  for (let k = 0; k < xs.length; k++) {
    const y = ys[k];
    if (y !== y) { bar(); column = -1; end = NaN; continue; }
    const here = Math.floor(xs[k] / wide);
    if (here !== column) {
      bar(here);
      column = here;
      low = end < y ? end : y; high = end > y ? end : y;
    } else if (y < low) low = y; else if (y > high) high = y;
    end = y;
  }
  bar();
}

// Draw at most once a frame, however often it is asked for.
export function oncePerFrame(draw) {
  let asked = 0;
  const ask = () => { asked ||= requestAnimationFrame(() => { asked = 0; draw(); }); };
  ask.stop = () => { cancelAnimationFrame(asked); asked = 0; };
  return ask;
}

// Call draw(share) with the share of the way from 0 to 1, for as long as the eye needs to follow a line.
export function moving(draw, milliseconds = 400) {
  if (window.matchMedia("(prefers-reduced-motion: reduce)").matches || document.hidden) { draw(1); return () => {}; }
  let frame = 0;
  const begun = performance.now();
  const step = (now) => {
    const share = Math.min(1, Math.max(0, (now - begun) / milliseconds));
    draw(share < 1 ? 1 - Math.pow(1 - share, 3) : 1);
    if (share < 1) frame = requestAnimationFrame(step);
  };
  frame = requestAnimationFrame(step);
  return () => cancelAnimationFrame(frame);
}

export const between = (from, to, share) =>
  to.map((y, k) => (y === null || from[k] === null || from[k] === undefined ? y : from[k] + share * (y - from[k])));

// Tell every plot of the page where the cursor stands in time; null where it left.
export const shareCursor = (sender, time) =>
  window.dispatchEvent(new CustomEvent(CURSOR, { detail: { time, sender } }));

export function whenCursorMoves(listener, handler) {
  const heard = (event) => { if (event.detail.sender !== listener) handler(event.detail.time); };
  window.addEventListener(CURSOR, heard);
  return () => window.removeEventListener(CURSOR, heard);
}

// Put an element's style sheet on the page once.
export function dressed(name, css) {
  if (document.getElementById(name)) return;
  const style = document.createElement("style");
  style.id = name;
  style.textContent = css;
  document.head.append(style);
}
