// Linked time plots: panels above each other with one cursor and one zoom; the server sends what the window needs.
import uPlot from "undertow-uplot";
import { barred, between, colour, dressed, label, moving, oncePerFrame, shareCursor, traced, whenColoursChange, whenCursorMoves, written } from "drawing";

const THICK = { measured: 3.5, between: 1.4, before: 1.4, after: 1.8 };
const RESTLESS = 6;  // a line that goes up and down more than so many times its way along needs no slopes
const SMALLEST = 4;  // pixels that a drag must cross to be one
const NARROWEST = 1e-3;  // seconds: no window is narrower
const SOON = 40;  // milliseconds that a window may wait for its own lines before it is drawn with those that are here
const PATIENCE = 1000;  // milliseconds after which an answer counts as lost

const CSS = `
.undertow-time { display: block; position: relative; width: 100%; min-width: 0; color: var(--ink); outline-offset: 4px; border-radius: 6px; }
.undertow-time .head { display: flex; flex-wrap: wrap; gap: 0 14px; align-items: center; font-size: 13px; line-height: 1.5; padding-left: 52px; }
.undertow-time .panel + .panel .head { margin-top: 8px; }
.undertow-time .head b { font-weight: 600; }
.undertow-time .head .unit { color: var(--muted); font-weight: 400; }
.undertow-time .key { display: inline-flex; align-items: center; gap: 6px; color: var(--muted); white-space: nowrap; }
.undertow-time .key[hidden] { display: none; }
.undertow-time .key i { width: 16px; border-radius: 2px; display: inline-block; }
.undertow-time .key .value { color: var(--ink); font-variant-numeric: tabular-nums; min-width: 6ch; }
.undertow-time .u-over { cursor: crosshair; touch-action: pan-y; }
.undertow-time .u-select { background: color-mix(in srgb, var(--after) 16%, transparent); }
.undertow-time .brushing .u-select { background: color-mix(in srgb, var(--heat3) 34%, transparent); }
.undertow-time .u-hz .u-cursor-x { border-right: 1px solid var(--ink); opacity: .55; }
.undertow-time .foot { display: flex; flex-wrap: wrap; justify-content: space-between; gap: 0 16px; padding-left: 52px; font-size: 12px; line-height: 1.6; color: var(--muted); min-height: 1.6em; }
.undertow-time .foot .heard { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }
.undertow-time .foot .now { color: var(--ink); font-variant-numeric: tabular-nums; }
.undertow-time .by-finger { font: inherit; font-size: 13px; color: var(--ink); background: transparent; border: 1px solid var(--muted); border-radius: 9px; padding: 5px 12px; min-height: 34px; }
.undertow-time .by-finger[aria-pressed="true"] { background: color-mix(in srgb, var(--heat3) 34%, transparent); }
@media (hover: none) { .undertow-time .hint { display: none; } }
@media (max-width: 560px) {
  .undertow-time .head, .undertow-time .foot { padding-left: 0; }
  .undertow-time .head { font-size: 12px; gap: 0 10px; }
  .undertow-time .head b { flex-basis: 100%; font-size: 13px; }
  .undertow-time .key { gap: 4px; }
  .undertow-time .key i { width: 10px; }
  .undertow-time .hint { display: none; }
}
`;

export default {
  template: `
    <div class="undertow-time" tabindex="0" role="group" :aria-label="label" @keydown="pressed">
      <div ref="panels"></div>
      <div class="foot"><span ref="now" class="now"></span><span ref="shown" aria-live="polite"></span><span ref="heard" class="heard" aria-live="polite"></span>
        <span class="hint">drag to zoom, Shift and drag to select, double-click for all</span>
        <button v-if="fingers" type="button" class="by-finger" :aria-pressed="String(selecting)" @click="selecting = !selecting">{{ selecting ? "A drag selects" : "A drag zooms" }}</button></div>
    </div>`,
  props: { panels: Array, height: Number, label: String },
  emits: ["ready", "window", "brush"],
  // A finger has no Shift: a button says what its drag does.
  data() { return { selecting: false, fingers: navigator.maxTouchPoints > 0 || window.matchMedia("(any-pointer: coarse)").matches }; },

  mounted() {
    dressed("undertow-time-style", CSS);
    this.whole = null; this.begin = 0; this.end = 1;
    this.time = []; this.columns = {}; this.marks = []; this.logs = []; this.at = null;
    this.asked = 0; this.late = 0; this.waiting = null; this.wanted = false; this.still = () => {};
    this.plots = this.panels.map((panel) => this.built(panel));
    this.soon = oncePerFrame(() => this.drawn());
    this.ends = [
      whenColoursChange(() => this.plots.forEach(({ chart }) => chart.redraw(false))),
      whenCursorMoves(this, (time) => this.point(time)),
    ];
    this.size = new ResizeObserver(() => this.resized());
    this.size.observe(this.$refs.panels);
    this.told = this.pixels();
    this.$emit("ready", { width: this.told });
  },

  unmounted() {
    this.size.disconnect(); this.still(); this.soon.stop(); clearTimeout(this.late);
    this.ends.forEach((end) => end());
    this.plots.forEach(({ chart }) => chart.destroy());
  },

  methods: {
    // One panel: its title with the key, and below it a chart.
    built(panel) {
      const box = document.createElement("div"), head = document.createElement("div"), ink = (name) => colour(this.$el, name);
      const last = panel === this.panels[this.panels.length - 1];
      box.className = "panel"; head.className = "head";
      const title = document.createElement("b"), unit = document.createElement("span");
      title.textContent = panel.title + " "; unit.className = "unit"; unit.textContent = panel.unit;
      title.append(unit); head.append(title);
      const values = panel.lines.map((line) => {
        const key = document.createElement("span"), sample = document.createElement("i"), value = document.createElement("span");
        key.className = "key"; value.className = "value";
        sample.style.background = "var(--" + line.role + ")"; sample.style.height = THICK[line.role] + 0.5 + "px";
        key.append(sample, line.label, value); head.append(key);
        return { key, value };
      });
      box.append(head);
      this.$refs.panels.append(box);
      const none = () => null;
      const axis = { stroke: () => ink("muted"), font: "12px " + getComputedStyle(this.$el).fontFamily, ticks: { stroke: () => ink("muted"), width: 1, size: 4 }, grid: { stroke: () => ink("grid"), width: 1 } };
      const chart = new uPlot({
        width: this.wide(), height: this.height + (last ? 24 : 0), padding: [6, 8, last ? 0 : 6, 0],
        legend: { show: false },
        cursor: {
          y: false, drag: { x: false, y: false, setScale: false }, points: { size: 7, width: 1.5 },
          bind: { mousedown: none, mouseup: none, mousemove: none, mouseenter: none, mouseleave: none, click: none, dblclick: none },
        },
        scales: { x: { time: false, range: () => [this.begin, this.end] }, y: { range: () => this.reach(panel) } },
        axes: [
          { ...axis, size: last ? 24 : 0, space: 80, gap: 6, values: (self, found) => found.map((x) => (last && self.valToPos(x, "x") < self.bbox.width / devicePixelRatio - 18 ? written(x, 7) + " s" : "")) },
          { ...axis, size: 52, space: 34, gap: 6, values: (_, found) => found.map((x) => written(x, 4)) },
        ],
        series: [{}, ...panel.lines.map((line) => ({ stroke: () => ink(line.role), width: THICK[line.role], points: { show: false }, paths: none }))],
        hooks: { drawClear: [(self) => this.shade(self)], draw: [(self) => { this.lines(self, panel); this.borders(self, panel === this.panels[0]); }] },
      }, [[], ...panel.lines.map(() => [])], box);
      this.listen(chart);
      return { box, chart, panel, values };
    },

    wide() { return Math.max(120, this.$refs.panels.clientWidth); },
    pixels() { return Math.max(50, Math.round((this.plots[0]?.chart.bbox.width ?? 0) / uPlot.pxRatio)); },

    resized() {
      const width = this.wide();
      if (this.plots[0]?.chart.width === width) return;
      this.plots.forEach(({ chart }) => chart.setSize({ width, height: chart.height }));
      if (this.whole) this.ask();
    },

    // From the server: the series of a window, and the times of the whole log.
    draw(message) {
      if (message.asked === this.asked) this.waiting = null;
      const first = !this.whole || message.fresh;
      this.whole = message.whole;
      if (first) [this.begin, this.end] = message.window;
      const columns = message.columns, from = this.columns;
      const alike = message.moved && message.time.length === this.time.length && message.time[0] === this.time[0];
      this.still();
      this.time = message.time;
      if (alike) {
        this.still = moving((share) => {
          this.columns = Object.fromEntries(Object.entries(columns).map(([name, to]) => [name, share < 1 && from[name] ? between(from[name], to, share) : to]));
          this.fill();
        });
      } else { this.columns = columns; this.fill(); }
      if (this.wanted || Math.abs(this.pixels() - this.told) > 2) this.ask();  // the page may have grown meanwhile
    },

    divide(logs) { this.logs = logs; this.plots.forEach(({ chart }) => chart.redraw(false)); },
    mark(intervals) { this.marks = intervals; this.plots.forEach(({ chart }) => chart.redraw(false)); },

    fill() {
      clearTimeout(this.late); this.late = 0; this.soon.stop();
      const begun = performance.now();
      this.plots.forEach(({ chart, panel, values }) => {
        panel.lines.forEach((line, k) => (values[k].key.hidden = !this.columns[line.name]));
        const none = this.time.map(() => null);
        chart.setData([this.time, ...panel.lines.map((line) => this.columns[line.name] ?? none)]);
      });
      this.$el.dataset.milliseconds = (performance.now() - begun).toFixed(1);
      this.tell();
    },

    drawn() {
      this.plots.forEach(({ chart }) => chart.setScale("x", { min: this.begin, max: this.end }));
      this.tell();
    },

    tell() {
      if (!this.whole) return;
      const part = this.begin > this.whole[0] || this.end < this.whole[1];
      this.$refs.shown.textContent = part ? "showing " + written(this.begin, 6) + " s to " + written(this.end, 6) + " s" : "";
    },

    // Lowest and highest value to show: all that was measured, and predictions up to as much again beyond it.
    reach(panel) {
      const found = panel.lines.map((line) => this.extremes(this.columns[line.name], line.role)).filter((ends) => ends);
      if (!found.length) return [-1, 1];
      const measured = found.filter((ends) => ends.role === "measured");
      let low = Math.min(...found.map((ends) => ends.low)), high = Math.max(...found.map((ends) => ends.high));
      if (measured.length) {
        const least = Math.min(...measured.map((ends) => ends.low)), most = Math.max(...measured.map((ends) => ends.high)), room = most - least;
        if (room > 0) { low = Math.max(low, least - room); high = Math.min(high, most + room); }
      }
      const margin = 0.06 * (high - low) || 0.1 * Math.abs(high) || 0.1;
      return [low - margin, high + margin];
    },

    extremes(column, role) {
      if (!column) return null;
      const { time, begin, end } = this;  // once: every look into a component costs more than a comparison
      let low = Infinity, high = -Infinity;
      for (let k = 0; k < time.length; k++) {
        const value = column[k];
        if (value === null || time[k] < begin || time[k] > end) continue;
        if (value < low) low = value;
        if (value > high) high = value;
      }
      return low <= high ? { low, high, role } : null;
    },

    // The lines of a panel, from back to front. uPlot's own are as good but strokes of some thousand points take it long.
    lines(chart, panel) {
      const { left, top, width, height } = chart.bbox, pen = chart.ctx, ratio = uPlot.pxRatio;
      const { time, begin, end } = this;
      const y = chart.scales.y, along = width / (end - begin), up = height / (y.max - y.min);
      let first = 0, last = time.length - 1;
      while (first < last && time[first + 1] < begin) first += 1;
      while (last > first && time[last - 1] > end) last -= 1;
      const xs = new Float64Array(Math.max(last - first + 1, 0));
      for (let k = first; k <= last; k++) xs[k - first] = left + (time[k] - begin) * along;
      pen.save();
      pen.beginPath(); pen.rect(left, top, width, height); pen.clip();
      this.bandOf(pen, panel, xs, (value) => top + height - (value - y.min) * up, first);
      panel.lines.forEach((line) => {
        const column = this.columns[line.name];
        if (!column) return;
        const ys = new Float64Array(xs.length);
        let travel = 0;
        for (let k = 0; k < ys.length; k++) {
          const value = column[first + k];
          ys[k] = value === null || value === undefined ? NaN : top + height - (value - y.min) * up;
          if (k) travel += Math.abs(ys[k] - ys[k - 1]) || 0;
        }
        const ink = colour(this.$el, line.role), thick = THICK[line.role] * ratio;
        if (travel < RESTLESS * width || ys.length * ratio < width) traced(pen, xs, ys, ink, thick);
        else barred(pen, xs, ys, ink, line.role === "measured" ? thick : ratio, Math.round(ratio));
      });
      pen.restore();
    },

    // What is shaded between two columns, piece by piece.
    bandOf(pen, panel, xs, y, first) {
      const [lows, highs] = panel.band.map((name) => this.columns[name]);
      if (!lows || !highs) return;
      const known = (k) => k < xs.length && Number.isFinite(lows[first + k] ?? NaN) && Number.isFinite(highs[first + k] ?? NaN);
      pen.save();
      pen.fillStyle = colour(this.$el, "after"); pen.globalAlpha = 0.2;
      for (let begin = 0; begin < xs.length; begin++) {
        if (!known(begin)) continue;
        let end = begin;
        while (known(end + 1)) end += 1;
        pen.beginPath();
        for (let k = begin; k <= end; k++) pen.lineTo(xs[k], y(Math.max(lows[first + k], highs[first + k])));
        for (let k = end; k >= begin; k--) pen.lineTo(xs[k], y(Math.min(lows[first + k], highs[first + k])));
        pen.fill();
        begin = end;
      }
      pen.restore();
    },

    // Where one log ends and the next begins, with their names in the first panel.
    borders(chart, named) {
      const { left, top, width, height } = chart.bbox, pen = chart.ctx, ratio = uPlot.pxRatio, right = left + width;
      const at = (time) => Math.min(Math.max(chart.valToPos(time, "x", true), left), right);
      pen.save();
      pen.font = 12 * ratio + "px " + getComputedStyle(this.$el).fontFamily; pen.textAlign = "left"; pen.textBaseline = "top";
      this.logs.forEach(([name, begin, end], k) => {
        if (end < this.begin || begin > this.end) return;
        if (k && begin >= this.begin) {
          pen.strokeStyle = colour(this.$el, "muted"); pen.lineWidth = ratio; pen.setLineDash([4 * ratio, 3 * ratio]);
          pen.beginPath(); pen.moveTo(at(begin), top); pen.lineTo(at(begin), top + height); pen.stroke();
        }
        if (named) label(pen, name, at(begin) + 4 * ratio, top + ratio, at(end) - at(begin) - 8 * ratio, this.$el);
      });
      pen.restore();
    },

    shade(chart) {
      const { left, top, width, height } = chart.bbox, pen = chart.ctx;
      pen.save();
      pen.fillStyle = colour(this.$el, "heat3"); pen.globalAlpha = 0.26;
      this.marks.forEach(([begin, end]) => {
        if (end < this.begin || begin > this.end) return;
        const from = Math.max(left, chart.valToPos(begin, "x", true)), to = Math.min(left + width, chart.valToPos(end, "x", true));
        pen.fillRect(from, top, Math.max(to - from, 1), height);
      });
      pen.restore();
    },

    // The server sends what a window needs, most often before a frame is over; else what is here does until then.
    look(begin, end) {
      if (!this.whole) return;
      const [first, last] = this.whole, span = Math.min(Math.max(end - begin, NARROWEST), last - first);
      this.begin = Math.min(Math.max(begin, first), last - span);
      this.end = this.begin + span;
      this.late ||= setTimeout(() => { this.late = 0; this.soon(); }, SOON);
      this.ask();
    },

    zoom(factor, about = 0.5 * (this.begin + this.end)) {
      this.look(about - (about - this.begin) * factor, about + (this.end - about) * factor);
    },

    ask() {
      if (this.waiting !== null && performance.now() - this.waiting < PATIENCE) { this.wanted = true; return; }
      this.waiting = performance.now(); this.asked += 1; this.wanted = false;
      this.told = this.pixels();
      this.$emit("window", { begin: this.begin, end: this.end, width: this.told, asked: this.asked });
    },

    // The cursor, on a time or away, in every panel.
    point(time) {
      const inside = time !== null && time >= this.begin && time <= this.end;
      this.at = inside ? time : null;
      this.plots.forEach(({ chart, panel, values }) => {
        chart.setCursor(inside ? { left: chart.valToPos(time, "x"), top: 4 } : { left: -10, top: -10 });
        const k = inside ? chart.cursor.idx : null;
        panel.lines.forEach((line, j) => (values[j].value.textContent = k === null || k === undefined ? "" : written(this.columns[line.name]?.[k], 3)));
      });
      const log = inside ? this.logs.find(([, begin, end]) => time >= begin && time <= end) : null;
      this.$refs.now.textContent = !inside ? "" : log ? log[0] + " at " + written(time - log[1], 6) + " s" : written(time, 6) + " s";
    },

    // The same from the keyboard, told to those who hear the page.
    step(share) {
      const span = this.end - this.begin, now = this.at ?? this.begin + 0.5 * span;
      const time = Math.min(Math.max(now + share * span, this.begin), this.end);
      this.point(time); shareCursor(this, time);
      const told = this.plots.map(({ panel, values }) => panel.title + ": " + panel.lines.map((line, k) => [line, values[k]]).filter(([line]) => this.columns[line.name]).map(([line, { value }]) => line.label + " " + value.textContent).join(", "));
      this.$refs.heard.textContent = written(time, 6) + " s. " + told.join(". ");
    },

    listen(chart) {
      const over = chart.over, at = (event) => Math.min(Math.max(event.clientX - over.getBoundingClientRect().left, 0), over.clientWidth);
      const when = (event) => chart.posToVal(at(event), "x");
      let begun = null;
      const select = (left, width) => this.plots.forEach((plot) => plot.chart.setSelect({ left, width, top: 0, height: width ? plot.chart.over.clientHeight : 0 }, false));
      over.addEventListener("pointerdown", (event) => {
        if (event.button !== 0) return;
        begun = { x: at(event), brush: event.shiftKey || (this.selecting && event.pointerType !== "mouse") };
        over.setPointerCapture(event.pointerId);
        this.$refs.panels.classList.toggle("brushing", begun.brush);
      });
      over.addEventListener("pointermove", (event) => {
        const time = when(event);
        this.point(time); shareCursor(this, time);
        if (begun) select(Math.min(begun.x, at(event)), Math.abs(at(event) - begun.x));
      });
      over.addEventListener("pointerup", (event) => {
        if (!begun) return;
        const [left, right] = [begun.x, at(event)].sort((a, b) => a - b), brush = begun.brush;
        begun = null; select(0, 0);
        if (right - left < SMALLEST) return;
        const begin = chart.posToVal(left, "x"), end = chart.posToVal(right, "x");
        if (brush) this.$emit("brush", { begin, end }); else this.look(begin, end);
      });
      over.addEventListener("pointercancel", () => { begun = null; select(0, 0); });
      over.addEventListener("pointerleave", () => { if (!begun) { this.point(null); shareCursor(this, null); } });
      over.addEventListener("dblclick", () => this.whole && this.look(...this.whole));
      over.addEventListener("wheel", (event) => {
        const out = event.deltaY > 0;
        // All is shown: the wheel is the page's.
        if (!this.whole || event.ctrlKey || (out && this.begin <= this.whole[0] && this.end >= this.whole[1])) return;
        event.preventDefault();
        this.zoom(Math.exp(Math.min(Math.max(event.deltaY, -200), 200) * 0.002), when(event));
      }, { passive: false });
    },

    pressed(event) {
      if (event.target !== this.$el || event.ctrlKey || event.metaKey || event.altKey) return;
      const step = 0.2 * (this.end - this.begin);
      const act = {
        ArrowLeft: () => event.shiftKey ? this.step(-0.01) : this.look(this.begin - step, this.end - step),
        ArrowRight: () => event.shiftKey ? this.step(0.01) : this.look(this.begin + step, this.end + step),
        "+": () => this.zoom(0.7), "=": () => this.zoom(0.7), "-": () => this.zoom(1 / 0.7),
        Home: () => this.look(...this.whole),
        Enter: () => this.$emit("brush", { begin: this.begin, end: this.end }),
      }[event.key];
      if (!act || !this.whole) return;
      event.preventDefault();
      act();
    },
  },
};
