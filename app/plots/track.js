// The track on the water: measured and predicted paths on a canvas, north up, one scale for both directions.
import { between, colour, dressed, label, moving, oncePerFrame, prepared, shareCursor, ticks, traced, whenColoursChange, whenCursorMoves, written } from "drawing";

const ROLES = ["measured", "before", "after"];
const THIN = { measured: 3.5, before: 1, after: 1 }, STRONG = { measured: 5.5, before: 2.6, after: 2.8 };
const NEAR = 36;  // pixels: a point farther from the pointer is not meant
const SMALLEST = 4;  // pixels that a drag must cross to be one
const CLOSEST = 400;  // pixels a metre
const REST = 120;  // milliseconds without a move after which the view is looked at closer

const CSS = `
.undertow-track { display: block; position: relative; width: 100%; min-width: 0; color: var(--ink); outline-offset: 4px; border-radius: 6px; }
.undertow-track canvas { display: block; width: 100%; cursor: crosshair; touch-action: pan-y; }
.undertow-track canvas.held { cursor: grabbing; }
.undertow-track canvas.top { position: absolute; inset: 0; pointer-events: none; }
`;

export default {
  template: `
    <div class="undertow-track" tabindex="0" role="group" :aria-label="label" @keydown="pressed">
      <canvas ref="canvas" :style="{ height: height + 'px' }" aria-hidden="true"></canvas>
      <canvas ref="top" class="top" :style="{ height: height + 'px' }" aria-hidden="true"></canvas>
    </div>`,
  props: { height: Number, label: String },
  emits: ["ready", "view", "pick"],

  mounted() {
    dressed("undertow-track-style", CSS);
    this.lines = {}; this.closer = null; this.paths = {}; this.marks = []; this.logs = []; this.at = null;
    this.view = null; this.timer = 0; this.still = () => {};
    this.soon = oncePerFrame(() => { this.paint(); this.dots(); });
    this.dotted = oncePerFrame(() => this.dots());
    this.ends = [whenColoursChange(() => this.soon()), whenCursorMoves(this, (time) => { this.at = time; this.dotted(); })];
    this.size = new ResizeObserver(() => this.soon());
    this.size.observe(this.$refs.canvas);
    this.listen(this.$refs.canvas);
    this.$emit("ready");
  },

  unmounted() {
    this.size.disconnect(); this.still(); this.soon.stop(); this.dotted.stop(); clearTimeout(this.timer);
    this.ends.forEach((end) => end());
  },

  methods: {
    draw(lines) {
      this.still();
      this.lines = lines; this.closer = null; this.view = null;
      this.soon();
    },

    // Other predictions: they move to their new place where they have the same points.
    predict(lines) {
      const from = this.lines, to = { ...from, ...lines };
      this.still(); this.closer = null;
      this.still = moving((share) => {
        const now = { ...to };
        if (share < 1)
          for (const role of Object.keys(lines)) {
            const old = from[role], next = lines[role];
            if (!old || old.time.length !== next.time.length) continue;
            now[role] = { time: next.time, north: between(old.north, next.north, share), east: between(old.east, next.east, share) };
          }
        this.lines = now;
        this.soon();
      });
      this.closely();
    },

    detail(found) { this.closer = found; this.soon(); },
    path(paths) { this.paths = paths; this.soon(); },
    divide(logs) { this.logs = logs; this.soon(); },
    mark(intervals) { this.marks = intervals; this.soon(); },

    whole() {
      const { north = [], east = [] } = this.lines.measured ?? {}, ends = { south: Infinity, north: -Infinity, west: Infinity, east: -Infinity };
      for (let k = 0; k < north.length; k++) {
        if (north[k] === null || east[k] === null) continue;
        ends.south = Math.min(ends.south, north[k]); ends.north = Math.max(ends.north, north[k]);
        ends.west = Math.min(ends.west, east[k]); ends.east = Math.max(ends.east, east[k]);
      }
      return ends.south <= ends.north ? ends : { south: -10, north: 10, west: -10, east: 10 };
    },

    // Metres in the middle, and pixels a metre: where the user looks, or all of the track.
    seen() { return this.view ?? this.fitted(); },

    fitted() {
      const { south, north, west, east } = this.whole(), canvas = this.$refs.canvas;
      const scale = Math.min((canvas.clientWidth - 40) / Math.max(east - west, 1), (canvas.clientHeight - 64) / Math.max(north - south, 1));
      return { north: 0.5 * (north + south) - 12 / scale, east: 0.5 * (east + west), scale };
    },

    box(view) {
      const canvas = this.$refs.canvas, high = canvas.clientHeight / view.scale, wide = canvas.clientWidth / view.scale;
      return { south: view.north - high, north: view.north + high, west: view.east - wide, east: view.east + wide };
    },

    // After a rest: ask for more points of what is in view, with half a view around it.
    closely() {
      clearTimeout(this.timer);
      this.$refs.canvas.style.touchAction = this.view ? "none" : "pan-y";  // while all is shown, a finger scrolls the page
      if (!this.view) { this.closer = null; return; }
      this.timer = setTimeout(() => this.view && this.$emit("view", this.box(this.view)), REST);
    },

    look(view) {
      this.view = view.scale <= 0.5 * this.fitted().scale ? null : { ...view, scale: Math.min(view.scale, CLOSEST) };
      this.soon(); this.closely();
    },

    shown() {
      const box = this.closer?.box, view = this.seen(), canvas = this.$refs.canvas;
      if (!box || !this.view) return this.lines;
      const high = 0.5 * canvas.clientHeight / view.scale, wide = 0.5 * canvas.clientWidth / view.scale;
      const inside = view.north - high >= box[0] && view.north + high <= box[1] && view.east - wide >= box[2] && view.east + wide <= box[3];
      return inside ? this.closer : this.lines;
    },

    paint() {
      const [pen, width, height] = prepared(this.$refs.canvas), view = this.seen(), ink = (name) => colour(this.$el, name);
      const x = (east) => width / 2 + (east - view.east) * view.scale, y = (north) => height / 2 - (north - view.north) * view.scale;
      const lines = this.shown();
      this.grid(pen, width, height, view, x, y, ink);
      const trace = (path, style, thick, keep = () => true) => {
        const xs = new Float64Array(path.time.length), ys = new Float64Array(path.time.length);
        for (let k = 0; k < xs.length; k++) {
          const known = path.north[k] !== null && path.east[k] !== null && keep(path.time[k]);
          xs[k] = known ? x(path.east[k]) : NaN; ys[k] = known ? y(path.north[k]) : NaN;
        }
        traced(pen, xs, ys, style, thick);
      };
      if (this.marks.length && lines.measured) trace(lines.measured, ink("heat2"), 11, this.marked());
      ROLES.forEach((role) => lines[role] && trace(lines[role], ink(role), THIN[role]));
      const strong = ROLES.filter((role) => this.paths[role]);
      strong.forEach((role) => trace(this.paths[role], ink("surface"), STRONG[role] + 3));
      strong.forEach((role) => trace(this.paths[role], ink(role), STRONG[role]));
      if (strong.length) this.dot(pen, this.first(this.paths[strong[0]]), x, y, ink("ink"), ink("surface"), 5);
      this.begins(pen, width, lines.measured, x, y, ink);
      this.scaleBar(pen, width, height, view, ink);
    },

    // Of several logs, where each begins, with its name.
    begins(pen, width, path, x, y, ink) {
      if (!path) return;
      const taken = [];
      this.logs.forEach(([name, begin, end]) => {
        const k = path.time.findIndex((time, i) => time !== null && time >= begin && time <= end && path.north[i] !== null);
        if (k < 0) return;
        const [px, py] = [x(path.east[k]), y(path.north[k])];
        pen.fillStyle = ink("ink"); pen.fillRect(px - 4, py - 4, 8, 8);
        const left = Math.min(px + 8, width - Math.min(pen.measureText(name).width, 140) - 6);
        let top = py - 7;
        while (taken.some(([a, b]) => Math.abs(a - left) < 140 && Math.abs(b - top) < 16)) top += 16;  // logs that begin at one place
        taken.push([left, top]);
        label(pen, name, left, top, 140, this.$el);
      });
    },

    // Where the cursor's time is, on a canvas of its own: the lines below need not be drawn anew.
    dots() {
      const [pen, width, height] = prepared(this.$refs.top), view = this.seen(), lines = this.shown();
      if (this.at === null) return;
      const x = (east) => width / 2 + (east - view.east) * view.scale, y = (north) => height / 2 - (north - view.north) * view.scale;
      const edge = colour(this.$el, "ink");
      ROLES.forEach((role) => {
        const place = this.place(this.paths[role], this.at) ?? this.place(lines[role], this.at);
        this.dot(pen, place, x, y, colour(this.$el, role), edge, 4.5);
      });
    },

    marked() {
      const sorted = [...this.marks].sort((a, b) => a[0] - b[0]);
      let k = 0;
      return (time) => {
        while (k < sorted.length && sorted[k][1] < time) k += 1;
        return k < sorted.length && time >= sorted[k][0];
      };
    },

    first(path) {
      const k = path.north.findIndex((north) => north !== null);
      return k < 0 ? null : [path.north[k], path.east[k]];
    },

    dot(pen, place, x, y, fill, edge, size) {
      if (!place) return;
      pen.beginPath(); pen.arc(x(place[1]), y(place[0]), size, 0, 7);
      pen.fillStyle = fill; pen.fill(); pen.strokeStyle = edge; pen.lineWidth = 1.2; pen.stroke();
    },

    // Where a path is at a time; null where it has a gap.
    place(path, time) {
      if (!path || !path.time.length) return null;
      const times = path.time;
      let low = 0, high = times.length - 1;
      const known = (k) => { while (k > 0 && times[k] === null) k -= 1; return k; };
      while (high - low > 1) {
        const middle = (low + high) >> 1, k = known(middle);
        if ((times[k] ?? -Infinity) <= time) low = middle; else high = middle;
      }
      low = known(low);
      if (times[low] === null || times[high] === null || path.north[low] === null || path.north[high] === null) return null;
      if (time < times[low] || time > times[high]) return null;
      const share = times[high] > times[low] ? (time - times[low]) / (times[high] - times[low]) : 0;
      return [path.north[low] + share * (path.north[high] - path.north[low]), path.east[low] + share * (path.east[high] - path.east[low])];
    },

    grid(pen, width, height, view, x, y, ink) {
      const half = { high: 0.5 * height / view.scale, wide: 0.5 * width / view.scale }, count = width / 110;
      pen.fillStyle = ink("grid");
      const step = ticks(0, width / view.scale, count)[1];
      for (let east = Math.ceil((view.east - half.wide) / step) * step; east < view.east + half.wide; east += step) pen.fillRect(Math.round(x(east)), 0, 1, height);
      for (let north = Math.ceil((view.north - half.high) / step) * step; north < view.north + half.high; north += step) pen.fillRect(0, Math.round(y(north)), width, 1);
    },

    scaleBar(pen, width, height, view, ink) {
      const size = ticks(0, width / view.scale, 5)[1], left = 10, low = height - 10, words = written(size, 3) + " m, north is up";
      pen.fillStyle = ink("surface"); pen.globalAlpha = 0.8;
      pen.fillRect(left - 6, low - 24, Math.max(size * view.scale, pen.measureText(words).width) + 12, 32);
      pen.globalAlpha = 1;
      pen.fillStyle = ink("ink"); pen.fillRect(left, low - 2, size * view.scale, 2); pen.fillRect(left, low - 6, 1.5, 6); pen.fillRect(left + size * view.scale - 1.5, low - 6, 1.5, 6);
      pen.textAlign = "left"; pen.fillStyle = ink("muted"); pen.fillText(words, left, low - 11);
    },

    // The measured point nearest to a place on the canvas, by its time; null where none is near.
    nearest(px, py) {
      const path = this.shown().measured, view = this.seen(), canvas = this.$refs.canvas;
      if (!path) return null;
      const east = view.east + (px - canvas.clientWidth / 2) / view.scale, north = view.north - (py - canvas.clientHeight / 2) / view.scale;
      let best = null, least = (NEAR / view.scale) ** 2;
      for (let k = 0; k < path.time.length; k++) {
        if (path.north[k] === null || path.east[k] === null) continue;
        const away = (path.north[k] - north) ** 2 + (path.east[k] - east) ** 2;
        if (away <= least) { least = away; best = k; }
      }
      return best === null ? null : { time: path.time[best], north, east };
    },

    listen(canvas) {
      const place = (event) => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
      const fingers = new Map();
      let held = null;
      const spread = () => { const [[ax, ay], [bx, by]] = fingers.values(); return [Math.hypot(ax - bx, ay - by), 0.5 * (ax + bx), 0.5 * (ay + by)]; };
      const hold = () => { const [px, py] = fingers.values().next().value; held = { px, py, view: this.seen(), moved: false }; };
      const release = (event) => {
        fingers.delete(event.pointerId);
        held = null; canvas.classList.remove("held");
      };
      canvas.addEventListener("pointerdown", (event) => {
        if (event.button !== 0) return;
        fingers.set(event.pointerId, place(event));
        canvas.setPointerCapture(event.pointerId);
        if (fingers.size === 1) hold(); else held = null;
      });
      canvas.addEventListener("pointermove", (event) => {
        const [px, py] = place(event);
        if (fingers.size === 2 && fingers.has(event.pointerId)) {
          const [before] = spread();
          fingers.set(event.pointerId, [px, py]);
          const [after, mx, my] = spread();
          if (before > 0 && after > 0) this.zoom(after / before, mx, my);
          return;
        }
        if (held) {
          if (Math.hypot(px - held.px, py - held.py) >= SMALLEST) { held.moved = true; canvas.classList.add("held"); }
          if (held.moved) this.look({ ...held.view, north: held.view.north + (py - held.py) / held.view.scale, east: held.view.east - (px - held.px) / held.view.scale });
          return;
        }
        const found = this.nearest(px, py);
        this.at = found ? found.time : null;
        shareCursor(this, this.at);
        this.dotted();
      });
      canvas.addEventListener("pointerup", (event) => {
        if (held && !held.moved) {
          const found = this.nearest(...place(event));
          if (found) this.$emit("pick", { north: found.north, east: found.east });
        }
        release(event);
      });
      canvas.addEventListener("pointercancel", release);
      canvas.addEventListener("pointerleave", () => { if (!held) { this.at = null; shareCursor(this, null); this.dotted(); } });
      canvas.addEventListener("dblclick", () => this.all());
      canvas.addEventListener("wheel", (event) => {
        if (event.ctrlKey || (event.deltaY > 0 && !this.view)) return;  // all is shown: the wheel is the page's
        event.preventDefault();
        this.zoom(Math.exp(-Math.min(Math.max(event.deltaY, -200), 200) * 0.002), ...place(event));
      }, { passive: false });
    },

    all() { this.view = null; this.soon(); this.closely(); },

    zoom(factor, px = this.$refs.canvas.clientWidth / 2, py = this.$refs.canvas.clientHeight / 2) {
      const view = this.seen(), canvas = this.$refs.canvas, right = (px - canvas.clientWidth / 2) / view.scale, up = -(py - canvas.clientHeight / 2) / view.scale;
      this.look({ scale: view.scale * factor, east: view.east + right * (1 - 1 / factor), north: view.north + up * (1 - 1 / factor) });
    },

    pressed(event) {
      if (event.target !== this.$el || event.ctrlKey || event.metaKey || event.altKey) return;
      const view = this.seen(), step = 60 / view.scale;
      const act = {
        ArrowLeft: () => this.look({ ...view, east: view.east - step }), ArrowRight: () => this.look({ ...view, east: view.east + step }),
        ArrowUp: () => this.look({ ...view, north: view.north + step }), ArrowDown: () => this.look({ ...view, north: view.north - step }),
        "+": () => this.zoom(1.4), "=": () => this.zoom(1.4), "-": () => this.zoom(1 / 1.4),
        Home: () => this.all(),
        Enter: () => this.$emit("pick", { north: view.north, east: view.east }),
      }[event.key];
      if (!act) return;
      event.preventDefault();
      act();
    },
  },
};
