// The map of failure: cells coloured by error; picked ones, by pointer or keyboard, go to the server.
import { dressed, ticks, written } from "drawing";

const SVG = "http://www.w3.org/2000/svg";
const LEFT = 64, BELOW = 46, ABOVE = 8, ASIDE = 12;  // pixels around the cells, for the labels
const HEAT = Array.from({ length: 6 }, (_, k) => k + 1);

const CSS = `
.undertow-map { display: block; width: 100%; min-width: 0; color: var(--ink); }
.undertow-map svg { display: block; width: 100%; user-select: none; -webkit-user-select: none; touch-action: pan-y; }
.undertow-map rect.cell { stroke: var(--surface); stroke-width: 1.5; cursor: pointer; transition: fill .4s ease-out; outline: none; }
.undertow-map rect.cell:hover { stroke: var(--muted); stroke-width: 2; }
.undertow-map rect.cell:focus-visible { stroke: var(--after); stroke-width: 3; }
.undertow-map rect.outline { fill: none; stroke: var(--ink); stroke-width: 2.5; pointer-events: none; }
.undertow-map rect.brush { fill: var(--ink); fill-opacity: .12; stroke: var(--ink); stroke-dasharray: 4 3; pointer-events: none; }
.undertow-map rect.frame { fill: none; stroke: var(--grid); }
.undertow-map text { fill: var(--muted); font-size: 12px; font-family: inherit; }
.undertow-map text.label { fill: var(--ink); font-size: 13px; }
.undertow-map .scale { display: flex; flex-wrap: wrap; align-items: center; gap: 4px 10px; font-size: 12px; color: var(--muted); padding-left: 64px; margin-top: 2px; }
.undertow-map .scale span { display: inline-flex; }
.undertow-map .scale i { width: 20px; height: 10px; display: block; }
.undertow-map .told { padding-left: 64px; font-size: 12px; line-height: 1.5; min-height: 3em; color: var(--muted); }
${HEAT.map((k) => `.undertow-map .heat${k} { fill: var(--heat${k}); background: var(--heat${k}); }`).join("\n")}
@media (max-width: 560px) { .undertow-map .scale, .undertow-map .told { padding-left: 0; } }
@media (prefers-reduced-motion: reduce) { .undertow-map rect.cell { transition: none; } }
`;

const made = (name, attributes, parent) => {
  const element = document.createElementNS(SVG, name);
  Object.entries(attributes).forEach(([key, value]) => element.setAttribute(key, value));
  parent.append(element);
  return element;
};

export default {
  template: `
    <div class="undertow-map">
      <svg ref="svg" role="group" aria-roledescription="map of failure"></svg>
      <div class="scale" ref="scale" aria-hidden="true"></div>
      <div class="told" ref="told" aria-hidden="true"></div>
    </div>`,
  emits: ["ready", "pick"],

  mounted() {
    dressed("undertow-map-style", CSS);
    this.data = null; this.picked = []; this.rects = new Map(); this.focus = null;
    this.size = new ResizeObserver(() => this.laidOut());
    this.size.observe(this.$el);
    this.listen(this.$refs.svg);
    this.$emit("ready");
  },

  unmounted() { this.size.disconnect(); },

  methods: {
    draw(data) {
      const same = this.data && JSON.stringify([this.data.x, this.data.y]) === JSON.stringify([data.x, data.y]);
      this.data = data;
      if (!same) { this.$refs.svg.replaceChildren(); this.rects.clear(); this.focus = null; this.width = 0; }
      this.laidOut();
      this.coloured();
    },

    pick(cells) { this.picked = cells.map(([i, j]) => i + "," + j); this.outlined(); },

    // Sizes follow the container; cells that are there stay, so that their colour can move.
    laidOut() {
      if (!this.data) return;
      const svg = this.$refs.svg, width = Math.max(200, this.$el.clientWidth);
      if (width === this.width) return;
      this.width = width;
      this.high = Math.min(420, Math.max(220, Math.round(0.62 * width)));
      svg.setAttribute("viewBox", "0 0 " + width + " " + this.high);
      svg.setAttribute("height", this.high);
      svg.setAttribute("aria-label", "Error over " + this.data.x.label + " and " + this.data.y.label);
      svg.querySelectorAll(".under").forEach((old) => old.remove());
      const under = document.createElementNS(SVG, "g"), { x, y } = this.data;
      under.setAttribute("class", "under"); under.setAttribute("aria-hidden", "true");
      svg.prepend(under);
      const right = width - ASIDE, low = this.high - BELOW;
      made("rect", { class: "frame", x: LEFT, y: ABOVE, width: right - LEFT, height: low - ABOVE }, under);
      ticks(x.edges[0], x.edges[x.edges.length - 1], Math.max(2, width / 110)).forEach((value) => {
        made("text", { x: this.x(value), y: low + 17, "text-anchor": "middle" }, under).textContent = written(value, 3);
      });
      ticks(y.edges[0], y.edges[y.edges.length - 1], 5).forEach((value) => {
        made("text", { x: LEFT - 8, y: this.y(value) + 4, "text-anchor": "end" }, under).textContent = written(value, 3);
      });
      made("text", { class: "label", x: 0.5 * (LEFT + right), y: this.high - 8, "text-anchor": "middle" }, under).textContent = x.label;
      const middle = 0.5 * (ABOVE + low);
      made("text", { class: "label", x: 14, y: middle, "text-anchor": "middle", transform: "rotate(-90 14 " + middle + ")" }, under).textContent = y.label;
      this.rects.forEach((rect, key) => this.placed(rect, key));
      this.outlined();
    },

    x(value) { const e = this.data.x.edges; return LEFT + (value - e[0]) / (e[e.length - 1] - e[0]) * (this.width - ASIDE - LEFT); },
    y(value) { const e = this.data.y.edges, low = this.high - BELOW; return low - (value - e[0]) / (e[e.length - 1] - e[0]) * (low - ABOVE); },

    placed(rect, key, room = 0) {
      const [i, j] = key.split(",").map(Number), { x, y } = this.data, left = this.x(x.edges[i]), top = this.y(y.edges[j + 1]);
      rect.setAttribute("x", left + room); rect.setAttribute("y", top + room);
      rect.setAttribute("width", Math.max(this.x(x.edges[i + 1]) - left - 2 * room, 0.5));
      rect.setAttribute("height", Math.max(this.y(y.edges[j]) - top - 2 * room, 0.5));
    },

    coloured() {
      const there = new Set(), svg = this.$refs.svg;
      this.data.cells.forEach(({ i, j, level, told }) => {
        const key = i + "," + j;
        there.add(key);
        let rect = this.rects.get(key);
        if (!rect) {
          rect = made("rect", { role: "button", tabindex: -1, "data-cell": key }, svg);
          made("title", {}, rect);
          this.rects.set(key, rect);
          this.placed(rect, key);
        }
        rect.setAttribute("class", "cell heat" + level);
        rect.setAttribute("aria-label", told);
        rect.firstChild.textContent = told;
      });
      this.rects.forEach((rect, key) => { if (!there.has(key)) { rect.remove(); this.rects.delete(key); } });
      const best = this.rects.has(this.focus) ? this.focus : this.data.cells[0] && this.data.cells[0].i + "," + this.data.cells[0].j;
      this.focused(best, false);
      const scale = this.$refs.scale, swatches = document.createElement("span");
      HEAT.forEach((k) => { const swatch = document.createElement("i"); swatch.className = "heat" + k; swatches.append(swatch); });
      scale.replaceChildren(this.data.scale[0], swatches, this.data.scale[6] + " " + this.data.unit + " and more");
      this.outlined();
    },

    focused(key, move = true) {
      this.rects.get(this.focus)?.setAttribute("tabindex", -1);
      this.focus = key;
      const rect = this.rects.get(key);
      rect?.setAttribute("tabindex", 0);
      if (move) rect?.focus();
    },

    outlined() {
      const svg = this.$refs.svg;
      svg.querySelectorAll(".outline").forEach((old) => old.remove());
      this.rects.forEach((rect, key) => rect.setAttribute("aria-pressed", this.picked.includes(key)));
      this.picked.forEach((key) => this.rects.has(key) && this.placed(made("rect", { class: "outline" }, svg), key, 1));
    },

    choose(keys, more) {
      const before = this.picked;
      if (more) this.picked = keys.every((key) => before.includes(key)) ? before.filter((key) => !keys.includes(key)) : [...new Set([...before, ...keys])];
      else this.picked = keys.length === 1 && before.length === 1 && before[0] === keys[0] ? [] : keys;
      this.outlined();
      this.$emit("pick", { cells: this.picked.map((key) => key.split(",").map(Number)) });
    },

    listen(svg) {
      let begun = null, brush = null;
      const at = (event) => { const box = svg.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
      const frame = (event) => {
        const [x1, y1] = begun.at, [x2, y2] = at(event);
        return { x: Math.min(x1, x2), y: Math.min(y1, y2), width: Math.abs(x2 - x1), height: Math.abs(y2 - y1) };
      };
      const over = () => { begun = null; brush?.remove(); brush = null; };
      svg.addEventListener("pointerdown", (event) => {
        if (event.button !== 0 || !this.data) return;
        begun = { at: at(event), key: event.target.dataset?.cell };
      });
      svg.addEventListener("pointermove", (event) => {
        if (!begun) return;
        const box = frame(event);
        if (!brush && box.width + box.height < 8) return;
        if (!brush) svg.setPointerCapture(event.pointerId);
        brush ??= made("rect", { class: "brush" }, svg);
        Object.entries(box).forEach(([key, value]) => brush.setAttribute(key, value));
      });
      svg.addEventListener("pointerup", (event) => {
        if (!begun) return;
        const more = event.shiftKey || event.ctrlKey || event.metaKey;
        if (brush) {
          const box = frame(event), touched = [...this.rects].filter(([, rect]) => {
            const [x, y, w, h] = ["x", "y", "width", "height"].map((name) => Number(rect.getAttribute(name)));
            return x < box.x + box.width && x + w > box.x && y < box.y + box.height && y + h > box.y;
          }).map(([key]) => key);
          if (touched.length) this.choose(touched, more);
        } else if (begun.key) { this.focused(begun.key, false); this.choose([begun.key], more); }
        over();
      });
      svg.addEventListener("pointercancel", over);
      const tell = (event) => { this.$refs.told.textContent = event.target.getAttribute?.("aria-label") ?? ""; };
      svg.addEventListener("pointerover", (event) => { if (event.target.dataset?.cell) tell(event); });
      svg.addEventListener("pointerleave", () => (this.$refs.told.textContent = ""));
      svg.addEventListener("focusin", (event) => { if (event.target.dataset?.cell) tell(event); });
      svg.addEventListener("keydown", (event) => {
        const key = event.target.dataset?.cell;
        if (!key) return;
        const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
        if (steps) this.go(key, steps);
        else if (event.key === "Enter" || event.key === " ") this.choose([key], event.shiftKey || event.ctrlKey);
        else if (event.key === "Escape") this.choose([], false);
        else return;
        event.preventDefault();
      });
    },

    // To the nearest cell in a direction, past empty ones.
    go(key, [right, up]) {
      const [i, j] = key.split(",").map(Number), most = Math.max(this.data.x.edges.length, this.data.y.edges.length);
      for (let step = 1; step < most; step++) {
        const next = (i + right * step) + "," + (j + up * step);
        if (this.rects.has(next)) { this.focused(next); return; }
      }
    },
  },
};
