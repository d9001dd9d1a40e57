// The page that plays: sliders for what was added, rollouts anew at every move, nothing from the network.
"use strict";

(function () {
  const source = document.getElementById("play-data"), box = document.getElementById("play");
  if (!source || !box) return;
  const data = JSON.parse(source.textContent), log = data.log, boat = undertowVehicle(data.vehicle);
  const rows = log.u.length, step = log.step, every = Math.round(data.horizon / step);
  log.minutes = Float64Array.from({ length: rows }, (_, k) => log.begin + (k * step) / 60.0);
  const find = (name) => box.querySelector('[data-play="' + name + '"]');
  const time = find("time"), track = find("track"), told = find("told"), where = find("where"), bar = find("bar");
  const from = find("from"), span = find("span");
  const state = { before: null, yours: null, at: null };
  const panels = [["u", "surge speed, m/s"], ["v", "sway speed, m/s"], ["r", "turn rate, rad/s"]];

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  const written = (x, digits) => {
    if (x === 0) return "0";
    const size = Math.abs(x);
    if (size >= 1e5 || size < 1e-4) return x.toExponential(1).replace("-", "\u2212");
    return String(Number(x.toPrecision(digits))).replace("-", "\u2212");
  };

  // Root mean square distance between two tracks, over the rows that are predicted.
  function error(rolled) {
    let sum = 0.0, count = 0;
    for (let k = 0; k < rows; k++) {
      if (k % every === 0) continue;
      sum += (rolled.north[k] - log.north[k]) ** 2 + (rolled.east[k] - log.east[k]) ** 2;
      count += 1;
    }
    return Math.sqrt(sum / Math.max(count, 1));
  }

  // The ends are the two vehicles as they are, whatever has a slider.
  const before = undertowVehicle(data.nominal).rollouts(log, every), errorBefore = error(before);
  const after = boat.rollouts(log, every), errorAfter = error(after);
  state.before = before; state.yours = after;

  const knobs = data.knobs.map((knob, k) => {
    const row = box.querySelectorAll(".knob")[k];
    const slider = row.querySelector("input"), value = row.querySelector("output");
    slider.min = 0; slider.max = 200; slider.step = "any";
    const place = (x) => (200.0 * (x - knob.low)) / (knob.high - knob.low);
    const at = (p) => knob.low + ((knob.high - knob.low) * p) / 200.0;
    const ticks = row.querySelectorAll(".ends i");
    ["before", "after"].forEach((which, j) => (ticks[j].style.left = place(knob[which]) / 2.0 + "%"));
    const show = (x) => {
      value.textContent = written(x, 3) + (knob.unit ? " " + knob.unit : "");
      slider.setAttribute("aria-valuetext", value.textContent);
    };
    const put = (x) => { slider.value = place(x); boat.set(knob.symbol, x); show(x); };
    slider.addEventListener("input", () => { boat.set(knob.symbol, at(Number(slider.value))); show(at(Number(slider.value))); soon(); });
    return { put, knob };
  });

  let asked = false;
  function soon() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => { asked = false; roll(); });
  }

  function roll() {
    const begun = performance.now();
    state.yours = boat.rollouts(log, every);
    box.dataset.milliseconds = (performance.now() - begun).toFixed(1);
    tell();
    draw();
  }

  function tell() {
    const now = error(state.yours), most = Math.max(errorBefore, errorAfter, 1e-12);
    told.textContent = (now < 1e4 ? written(now, 2) : "runs away") + (now < 1e4 ? " m" : "");
    bar.style.width = Math.min(100, (100 * now) / most) + "%";
    bar.parentElement.setAttribute("aria-label", "your error is " + told.textContent);
  }

  const seconds = () => (span.value === "all" ? rows * step : Number(span.value));
  function view() {
    const length = Math.min(rows, Math.round(seconds() / step));
    const first = Math.round(((rows - length) * Number(from.value)) / 1000);
    return [first, first + length];
  }

  function prepared(canvas) {
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "12px " + getComputedStyle(document.body).fontFamily;
    pen.lineJoin = "round";
    return [pen, width, height];
  }

  function stroke(pen, points, style, thick, breaks) {
    pen.beginPath();
    let open = false;
    points.forEach(([x, y, k]) => {
      if (!open || (breaks && k % every === 0)) pen.moveTo(x, y); else pen.lineTo(x, y);
      open = true;
    });
    pen.strokeStyle = style; pen.lineWidth = thick; pen.stroke();
  }

  const LINES = [["measured", () => log, 4.5, false], ["before", () => state.before, 1.4, true], ["after", () => state.yours, 1.8, true]];
  const LEFT = 44, BELOW = 20;

  function ends(name, first, last) {
    let low = Infinity, high = -Infinity;
    for (let k = first; k < last; k++) { low = Math.min(low, log[name][k]); high = Math.max(high, log[name][k]); }
    const room = 0.25 * (high - low) || 0.1;
    return [low - room, high + room];
  }

  function ticks(low, high, count) {
    const raw = (high - low) / count, power = Math.pow(10, Math.floor(Math.log10(raw)));
    const size = [1, 2, 5, 10].map((n) => n * power).find((n) => n >= raw);
    const found = [];
    for (let x = Math.ceil(low / size) * size; x <= high + 1e-9 * size; x += size) found.push(Math.abs(x) < 1e-9 * size ? 0 : x);
    return found;
  }

  function drawTime() {
    const [pen, width, height] = prepared(time), [first, last] = view();
    const tall = (height - BELOW) / panels.length, x = (k) => LEFT + ((k - first) / (last - 1 - first)) * (width - LEFT - 6);
    panels.forEach(([name, title], j) => {
      const [low, high] = ends(name, first, last), top = j * tall + 18, deep = tall - 26;
      const y = (value) => top + deep - (Math.min(Math.max(value, low), high) - low) / (high - low) * deep;
      pen.fillStyle = colour("muted"); pen.textAlign = "left"; pen.fillText(title, LEFT, top - 6);
      pen.textAlign = "right";
      ticks(low, high, 3).forEach((value) => {
        pen.fillText(written(value, 3), LEFT - 6, y(value) + 4);
        pen.fillStyle = colour("grid"); pen.fillRect(LEFT, y(value), width - LEFT - 6, 1); pen.fillStyle = colour("muted");
      });
      LINES.forEach(([role, series, thick, breaks]) => {
        const found = series()[name], points = [];
        const stride = Math.max(1, Math.floor((last - first) / (2 * width)));
        for (let k = first; k < last; k += stride) points.push([x(k), y(found[k]), stride > 1 ? 1 : k]);
        stroke(pen, points, colour(role), thick, breaks);
      });
    });
    pen.fillStyle = colour("muted"); pen.textAlign = "center";
    ticks(log.start + first * step, log.start + last * step, Math.max(3, width / 120)).forEach((t) => {
      const k = (t - log.start) / step;
      if (k <= last - 1) pen.fillText(written(t, 6) + " s", x(k), height - 5);
    });
    if (state.at !== null && state.at >= first && state.at < last) {
      pen.fillStyle = colour("ink"); pen.fillRect(x(state.at), 0, 1, height - BELOW);
    }
    time.rowAt = (px) => Math.round(first + ((px - LEFT) / (width - LEFT - 6)) * (last - 1 - first));
  }

  function drawTrack() {
    const [pen, width, height] = prepared(track), [first, last] = view();
    const [south, north] = ends("north", first, last), [west, east] = ends("east", first, last);
    const scale = Math.min((width - 16) / (east - west), (height - 26) / (north - south));
    const x = (e) => width / 2 + (e - (east + west) / 2) * scale, y = (n) => (height - 10) / 2 - (n - (north + south) / 2) * scale;
    LINES.forEach(([role, series, thick, breaks]) => {
      const found = series(), points = [];
      for (let k = first; k < last; k++) points.push([x(found.east[k]), y(found.north[k]), k]);
      pen.save(); pen.beginPath(); pen.rect(0, 0, width, height); pen.clip();
      stroke(pen, points, colour(role), thick, breaks);
      pen.restore();
    });
    const size = ticks(0, (width - 16) / scale, 4)[1];
    pen.fillStyle = colour("muted"); pen.fillRect(8, height - 8, size * scale, 2);
    pen.textAlign = "left"; pen.fillText(written(size, 3) + " m, north is up", 8, height - 13);
    if (state.at !== null && state.at >= first && state.at < last)
      LINES.forEach(([role, series]) => {
        pen.beginPath(); pen.arc(x(series().east[state.at]), y(series().north[state.at]), 4.5, 0, 7);
        pen.fillStyle = colour(role); pen.fill(); pen.strokeStyle = colour("ink"); pen.lineWidth = 1; pen.stroke();
      });
  }

  function draw() { drawTime(); drawTrack(); }

  time.addEventListener("pointermove", (event) => {
    const k = time.rowAt(event.offsetX), [first, last] = view();
    state.at = k >= first && k < last ? k : null;
    if (state.at !== null) {
      const one = (series) => panels.map(([name]) => written(series[name][k], 2)).join(", ");
      where.textContent = (log.start + k * step).toFixed(1) + " s: measured " + one(log) + "; before " + one(state.before) + "; yours " + one(state.yours);
    }
    draw();
  });
  time.addEventListener("pointerleave", () => { state.at = null; where.textContent = "\u00a0"; draw(); });
  find("all-before").addEventListener("click", () => { knobs.forEach(({ put, knob }) => put(knob.before)); roll(); });
  find("all-after").addEventListener("click", () => { knobs.forEach(({ put, knob }) => put(knob.after)); roll(); });
  from.addEventListener("input", draw);
  span.addEventListener("change", draw);
  window.addEventListener("resize", draw);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);

  if (rows * step <= 60) span.value = "all";
  box.hidden = false;
  document.getElementById("play-note").hidden = true;
  knobs.forEach(({ put, knob }) => put(knob.after));
  roll();
})();
