// The page that plays: sliders for what was added, the motion over time, rollouts anew at every move; no network.
"use strict";

(function () {
  const source = document.getElementById("play-data"), box = document.getElementById("play");
  if (!source || !box) return;
  const data = JSON.parse(source.textContent), step = data.step, every = Math.round(data.horizon / step);
  const find = (name) => box.querySelector('[data-play="' + name + '"]');
  const time = find("time"), track = find("track"), told = find("told"), where = find("where"), bar = find("bar");
  const run = find("run"), cursor = find("cursor"), clock = find("clock"), span = find("span"), speed = find("speed");
  const still = window.matchMedia("(prefers-reduced-motion: reduce)");
  const state = { before: null, yours: null, at: 0, touched: false, playing: false };
  const panels = [["u", "surge speed, m/s"], ["v", "sway speed, m/s"], ["r", "turn rate, rad/s"]];
  const STATES = ["north", "east", "psi", "u", "v", "r"];

  // ---- the measurement, and the stretches of it that are predicted each by its own model ---------------------------

  const log = { step };
  for (const name of STATES) {
    const [unit, steps] = data.columns[name];
    let sum = 0;
    log[name] = Float64Array.from(steps, (one) => (sum += one) * unit);
  }
  log.commands = data.commands.map((one) => Float64Array.from(one));
  const rows = log.u.length, seconds = new Float64Array(rows);
  const pieces = data.pieces.map(({ first, last, start, begin, boat }) => {
    for (let k = first; k < last; k++) seconds[k] = start + (k - first) * step;
    const own = { step, minutes: Float64Array.from({ length: last - first }, (_, k) => begin + (k * step) / 60.0) };
    for (const name of STATES) own[name] = log[name].subarray(first, last);
    own.commands = log.commands.map((one) => one.subarray(first, last));
    return { first, last, boat, log: own };
  });
  const firstOf = new Int32Array(rows);
  pieces.forEach(({ first, last }) => firstOf.fill(first, first, last));
  const restarts = (k) => (k - firstOf[k]) % every === 0;

  const nominal = data.boats.map(() => undertowVehicle(data.nominal));
  const boats = data.boats.map((boat) => undertowVehicle(boat));

  // All predictions that are drawn, put back on the measurement after each horizon.
  function rolled(fleet) {
    const found = Object.fromEntries(STATES.map((name) => [name, new Float64Array(rows)]));
    for (const piece of pieces) {
      const own = fleet[piece.boat].rollouts(piece.log, every);
      STATES.forEach((name) => found[name].set(own[name], piece.first));
    }
    return found;
  }

  // Root mean square error of predictions that start every `data.spacing` rows, as the scores of a run count it: the
  // mean over the rows of each prediction, then over all of them. A generator, so that the page can draw meanwhile.
  function* error(fleet) {
    let total = 0.0, count = 0, sum = 0.0, own = null;
    const take = (k, x) => {
      for (const [place, name] of data.metric) sum += (x[place] - own[name][k]) ** 2;
    };
    for (const piece of pieces) {
      own = piece.log;
      const ahead = fleet[piece.boat].open(own);
      for (let start = 0; start + every < piece.last - piece.first; start += data.spacing) {
        sum = 0.0;
        ahead(start, every, take);
        total += sum / every;
        count += 1;
        yield null;
      }
    }
    return Math.sqrt(total / Math.max(count, 1));
  }

  // Works through a generator in slices of some milliseconds; a later call of the same `turn` ends an earlier one.
  const turns = {};
  function work(turn, steps, done) {
    const mine = (turns[turn] = (turns[turn] || 0) + 1);
    (function slice() {
      if (turns[turn] !== mine) return;
      const begun = performance.now();
      let one = steps.next();
      while (!one.done && performance.now() - begun < 12) one = steps.next();
      if (one.done) done(one.value); else setTimeout(slice, 0);
    })();
  }

  // ---- sliders ------------------------------------------------------------------------------------------------------

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  const written = (x, digits) => {
    if (x === 0) return "0";
    const size = Math.abs(x);
    if (size >= 1e5 || size < 1e-4) return x.toExponential(1).replace("-", "\u2212");
    return String(Number(x.toPrecision(digits))).replace("-", "\u2212");
  };

  const knobs = data.knobs.map((knob, k) => {
    const row = box.querySelectorAll(".knob")[k];
    const slider = row.querySelector("input"), value = row.querySelector("output");
    slider.min = 0; slider.max = 200; slider.step = "any";
    const place = (x) => (200.0 * (x - knob.low)) / (knob.high - knob.low);
    const at = (p) => knob.low + ((knob.high - knob.low) * p) / 200.0;
    const ticks = row.querySelectorAll(".ends i");
    ["before", "after"].forEach((which, j) => (ticks[j].style.left = place(knob[which]) / 2.0 + "%"));
    const own = { knob, share: 1.0 };
    own.show = (x) => {
      own.share = (x - knob.before) / (knob.after - knob.before);
      value.textContent = written(x, 3) + (knob.unit ? " " + knob.unit : "");
      slider.setAttribute("aria-valuetext", value.textContent);
    };
    own.put = (x) => { slider.value = place(x); own.show(x); };
    slider.addEventListener("input", () => { own.show(at(Number(slider.value))); soon(roll); });
    return own;
  });

  // Every model has, of each number that it changes, the share that its slider says: none before, all of it after.
  function setBoats() {
    const mean = knobs.reduce((sum, { share }) => sum + share, 0.0) / knobs.length;
    const shares = Object.fromEntries(knobs.map(({ knob, share }) => [knob.symbol, share]));
    data.changes.forEach((changes, k) => {
      for (const [symbol, before, after] of changes)
        boats[k].set(symbol, before + (symbol in shares ? shares[symbol] : mean) * (after - before));
    });
  }

  const asked = new Set();
  function soon(what) {
    if (asked.has(what)) return;
    asked.add(what);
    requestAnimationFrame(() => { asked.delete(what); what(); });
  }

  let most = 1e-12;
  function roll() {
    const begun = performance.now();
    setBoats();
    state.yours = rolled(boats);
    box.dataset.milliseconds = (performance.now() - begun).toFixed(1);
    delete box.dataset.error;
    work("yours", error(boats), tell);
    draw();
  }

  function tell(now) {
    const far = !(now < 1e4);
    most = Math.max(most, far ? 0.0 : now);
    told.textContent = far ? "runs away" : now.toPrecision(2).replace(/e\+?/, "\u00b710^") + " " + data.unit;
    bar.style.width = Math.min(100, (100 * now) / most) + "%";
    bar.parentElement.setAttribute("aria-label", "your error is " + told.textContent);
    box.dataset.error = now;
  }

  // ---- drawings -----------------------------------------------------------------------------------------------------

  // The rows that are drawn: the page of the log on which the cursor is.
  function view() {
    const length = span.value === "all" ? rows : Math.min(rows, Math.round(Number(span.value) / step));
    const first = Math.max(0, Math.min(Math.floor(state.at / length) * length, rows - length));
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

  function stroke(pen, first, last, stride, point, style, thick, breaks) {
    pen.beginPath();
    for (let k = first; k < last; k += stride) {
      const [x, y] = point(k);
      const anew = k === first || firstOf[k] !== firstOf[k - stride] || (breaks && stride === 1 && restarts(k));
      if (anew) pen.moveTo(x, y); else pen.lineTo(x, y);
    }
    pen.strokeStyle = style; pen.lineWidth = thick; pen.stroke();
  }

  const LINES = [["measured", () => log, 4.5, false], ["before", () => state.before, 1.4, true], ["after", () => state.yours, 1.8, true]];
  const LEFT = 44, BELOW = 20;

  // Room for what was measured and what is predicted, of which the measurement keeps a third.
  function ends(name, first, last) {
    let low = Infinity, high = -Infinity, least = Infinity, most = -Infinity;
    for (let k = first; k < last; k++) {
      low = Math.min(low, log[name][k]); high = Math.max(high, log[name][k]);
      for (const rolls of [state.before, state.yours]) {
        least = Math.min(least, rolls[name][k]); most = Math.max(most, rolls[name][k]);
      }
    }
    const room = high - low || 0.1;
    low = Math.min(low, Math.max(least, low - room)); high = Math.max(high, Math.min(most, high + room));
    return [low - 0.06 * room, high + 0.06 * room];
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
    const stride = Math.max(1, Math.floor((last - first) / (2 * width)));
    panels.forEach(([name, title], j) => {
      const [low, high] = ends(name, first, last), top = j * tall + 18, deep = tall - 26;
      const y = (value) => top + deep - ((value - low) / (high - low)) * deep;
      pen.fillStyle = colour("muted"); pen.textAlign = "left"; pen.fillText(title, LEFT, top - 6);
      pen.textAlign = "right";
      ticks(low, high, 5).forEach((value) => {
        pen.fillText(written(value, 3), LEFT - 6, y(value) + 4);
        pen.fillStyle = colour("grid"); pen.fillRect(LEFT, y(value), width - LEFT - 6, 1); pen.fillStyle = colour("muted");
      });
      pen.save(); pen.beginPath(); pen.rect(LEFT, top - 2, width - LEFT, deep + 4); pen.clip();
      LINES.forEach(([role, series, thick, breaks]) => {
        const found = series()[name];
        stroke(pen, first, last, stride, (k) => [x(k), y(found[k])], colour(role), thick, breaks);
      });
      pen.restore();
    });
    pen.fillStyle = colour("muted"); pen.textAlign = "center";
    const even = ticks(0, (last - first) * step, Math.max(3, width / 120)), size = even[1] - even[0];
    for (let k = first + 1; k < last; k++) {
      const mark = Math.floor(seconds[k] / size + 1e-9);
      if (mark > Math.floor(seconds[k - 1] / size + 1e-9) && x(k) < width - 20) pen.fillText(written(mark * size, 6) + " s", x(k), height - 5);
    }
    pen.fillStyle = colour("ink"); pen.fillRect(x(state.at) - 0.5, 0, 1.5, height - BELOW);
    time.rowAt = (px) => Math.round(first + ((px - LEFT) / (width - LEFT - 6)) * (last - 1 - first));
  }

  // A hull that heads where the boat does, drawn as long as can be seen.
  function hull(pen, x, y, psi, style, large) {
    pen.save(); pen.translate(x, y); pen.rotate(psi); pen.scale(large, large);
    pen.beginPath(); pen.moveTo(0, -11); pen.lineTo(5.5, -2); pen.lineTo(5.5, 8); pen.lineTo(-5.5, 8); pen.lineTo(-5.5, -2);
    pen.closePath(); pen.fillStyle = style; pen.fill(); pen.strokeStyle = colour("ink"); pen.lineWidth = 1; pen.stroke();
    pen.restore();
  }

  function drawTrack() {
    const [pen, width, height] = prepared(track), [first, last] = view();
    const [south, north] = ends("north", first, last), [west, east] = ends("east", first, last);
    const scale = Math.min((width - 24) / (east - west), (height - 40) / (north - south));
    const x = (e) => width / 2 + (e - (east + west) / 2) * scale, y = (n) => (height - 16) / 2 - (n - (north + south) / 2) * scale;
    // Once the time moves, what is predicted now stands out: the prediction that the cursor is in, up to the cursor.
    const now = state.at - ((state.at - firstOf[state.at]) % every);
    LINES.forEach(([role, series, thick, breaks]) => {
      const found = series(), point = (k) => [x(found.east[k]), y(found.north[k])];
      pen.globalAlpha = breaks && state.touched ? 0.25 : 1.0;
      stroke(pen, first, last, 1, point, colour(role), thick, breaks);
      pen.globalAlpha = 1.0;
      if (breaks && state.touched) stroke(pen, now, state.at + 1, 1, point, colour(role), 2.6, false);
    });
    const size = ticks(0, (width - 16) / scale, 4)[1];
    pen.fillStyle = colour("muted"); pen.fillRect(8, height - 8, size * scale, 2);
    pen.textAlign = "left"; pen.fillText(written(size, 3) + " m, north is up", 8, height - 13);
    LINES.forEach(([role, series]) => {
      const found = series(), k = state.at;
      hull(pen, x(found.east[k]), y(found.north[k]), found.psi[k], colour(role), role === "measured" ? 1.5 : 1.0);
    });
  }

  function draw() { drawTime(); drawTrack(); }

  // ---- time ---------------------------------------------------------------------------------------------------------

  function go(row) {
    state.at = Math.min(Math.max(Math.round(row), 0), rows - 1);
    const k = state.at, one = (series) => panels.map(([name]) => written(series[name][k], 2)).join(", ");
    cursor.value = k;
    clock.textContent = seconds[k].toFixed(1) + " s";
    cursor.setAttribute("aria-valuetext", clock.textContent);
    if (!state.playing) where.textContent = "in m/s, m/s and rad/s: measured " + one(log) + "; before " + one(state.before) + "; yours " + one(state.yours);
    draw();
  }

  function play(on) {
    state.playing = on;
    state.touched = true;
    run.textContent = on ? "Pause" : "Play";
    if (on && state.at >= rows - 1) state.at = 0;
    let from = performance.now(), row = state.at;
    const tick = (instant) => {
      if (!state.playing) return;
      row += (Math.max(0, instant - from) / 1000.0) * (Number(speed.value) / step);
      from = Math.max(from, instant);
      if (state.at !== state.shown) row = state.at; // moved by hand meanwhile
      // Who asked for less motion sees one step a second.
      if (!still.matches || row - state.at >= Number(speed.value) / step || row >= rows - 1) { go(row); state.shown = state.at; }
      if (row >= rows - 1) play(false); else requestAnimationFrame(tick);
    };
    state.shown = state.at;
    go(state.at);
    if (on) requestAnimationFrame(tick);
  }

  run.addEventListener("click", () => play(!state.playing));
  cursor.max = rows - 1;
  cursor.addEventListener("input", () => { state.touched = true; state.at = Number(cursor.value); soon(() => go(state.at)); });
  const point = (event) => { state.touched = true; go(time.rowAt(event.offsetX)); };
  time.addEventListener("pointerdown", point);
  time.addEventListener("pointermove", (event) => { if (event.pointerType === "mouse" && !state.playing) point(event); });
  find("all-before").addEventListener("click", () => { knobs.forEach(({ put, knob }) => put(knob.before)); roll(); });
  find("all-after").addEventListener("click", () => { knobs.forEach(({ put, knob }) => put(knob.after)); roll(); });
  span.addEventListener("change", draw);
  window.addEventListener("resize", draw);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);

  if (rows * step <= 60) span.value = "all";
  box.hidden = false;
  document.getElementById("play-note").hidden = true;
  state.before = rolled(nominal);
  knobs.forEach(({ put, knob }) => put(knob.after));
  work("before", error(nominal), (found) => { most = Math.max(most, found < 1e4 ? found : 0.0); roll(); });
  setBoats();
  state.yours = rolled(boats);
  go(0);
})();
