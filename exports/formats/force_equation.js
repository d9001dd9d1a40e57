// The force equation of a surface vehicle in the plane, and its open-loop rollouts, in plain JavaScript:
// M nu_r_dot = B T + other - C(nu_r) nu_r - D(nu_r) nu_r, nu_r = nu - R(psi)^T current (Fossen 2021, eq. 6.1 in the plane).
// SI units, earth NED, body FRD. `undertowVehicle(data)` takes what `to_javascript.py` writes; no library, no global state.
"use strict";

function undertowVehicle(data) {
  const own = JSON.parse(JSON.stringify(data));
  const values = own.values, thrusters = own.thrusters;
  const SIGNALS = ["u", "v", "r", "|u|", "|v|", "|r|", "q_v", "q_r", "cos psi", "sin psi", "u_a", "v_a", "|V_a|", "t",
    "F_Y", "F_N"];
  const SPEED_LIMIT = 50.0; // beyond it [m/s, rad/s] a rollout has run away and is held

  function set(symbol, value) {
    const one = thrusters.find((t) => t.name + "_scale" === symbol);
    if (one) one.scale = value;
    else if (own.shared.includes(symbol)) thrusters.forEach((t) => (t[symbol] = value));
    else if (symbol in values) values[symbol] = value;
    else throw new Error("no parameter " + symbol);
  }

  // ---- thrusters: from a command to a force -------------------------------------------------------------------------

  function interpolate(x, xs, ys) {
    const n = xs.length;
    if (x <= xs[0]) return ys[0];
    if (x >= xs[n - 1]) return ys[n - 1];
    let low = 0, high = n - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (xs[middle] <= x) low = middle; else high = middle;
    }
    return ys[low] + ((ys[high] - ys[low]) * (x - xs[low])) / (xs[high] - xs[low]);
  }

  function fraction(t, command) {
    return (command - t.at_zero) / (t.at_one - t.at_zero);
  }

  function curve(t, command) {
    const c = t.curve;
    if (c.kind === "table") return interpolate(command, c.command, c.force);
    const speed = t.command === "rad_s" ? command : fraction(t, command) * c.scale + c.offset;
    return c.k_t * c.rho * Math.pow(c.diameter, 4) * speed * Math.abs(speed);
  }

  function commandOf(t, share) {
    const command = t.at_zero + share * (t.at_one - t.at_zero);
    if (t.curve.kind !== "table") return command;
    const points = t.curve.command;
    return Math.min(Math.max(command, points[0]), points[points.length - 1]);
  }

  function powered(t, command) {
    const force = curve(t, command);
    if (t.thrust_exponent === 1.0) return force;
    const ends = [curve(t, commandOf(t, -1.0)), curve(t, commandOf(t, 1.0))];
    let full = force < 0.0 ? -Math.min(...ends) : Math.max(...ends);
    if (!(full > 0.0)) full = Math.abs(force);
    if (!(full > 0.0)) return 0.0;
    return Math.sign(force) * full * Math.pow(Math.abs(force) / full, t.thrust_exponent);
  }

  function bent(t, force) {
    const gains = own.gains.map((name) => t[name]);
    if (gains.every((gain) => gain === 1.0)) return force;
    let ends = [-3, -2, -1, 0, 1, 2, 3].map((k) => powered(t, commandOf(t, k / 3)));
    const sign = ends[6] < ends[0] ? -1.0 : 1.0; // mounted or wired the other way round
    ends = ends.map((end) => sign * end);
    const f = sign * force, astern = ends.slice(0, 4), ahead = ends.slice(3);
    for (let k = 2; k >= 0; k--) astern[k] = Math.min(astern[k], astern[k + 1]);
    for (let k = 1; k < 4; k++) ahead[k] = Math.max(ahead[k], ahead[k - 1]);
    const clip = (low, high) => Math.min(Math.max(f, low), high);
    let total = ends[3];
    for (let k = 0; k < 3; k++) total += gains[k] * (clip(k ? astern[k] : -Infinity, astern[k + 1]) - astern[k + 1]);
    for (let k = 0; k < 3; k++) total += gains[3 + k] * (clip(ahead[k], k < 2 ? ahead[k + 1] : Infinity) - ahead[k]);
    return sign * total;
  }

  // Force at zero speed [N] and its loss per advance speed [N s/m] of a command that has lasted.
  function lasting(t, command) {
    const share = fraction(t, command);
    let force = bent(t, powered(t, command)) * t.scale * t.thrust_scale;
    if (share < 0) force *= t.reverse_scale;
    if (t.dead_zone > 0 && Math.abs(share) <= t.dead_zone) return [0.0, 0.0];
    return [force, t.advance_loss * Math.abs(share)];
  }

  // y of T y' = x - y for an x that is linear between samples, at rest in the first.
  function lag(series, constant, step, start) {
    if (!(constant > 0) || constant < 1e-6 * step) return series;
    const ratio = step / constant, a = Math.exp(-ratio), slope = (1.0 - a) / ratio;
    const found = new Float64Array(series.length);
    found[0] = start === undefined ? series[0] : start;
    for (let k = 1; k < series.length; k++)
      found[k] = a * found[k - 1] + (slope - a) * series[k - 1] + (1.0 - slope) * series[k];
    return found;
  }

  function late(series, delay, step) {
    if (delay === 0.0) return series;
    const last = series.length - 1;
    return series.map((_, k) => {
      const place = Math.min(Math.max(k - delay / step, 0), last), low = Math.min(Math.floor(place), last - 1);
      return last < 1 ? series[0] : series[low] + (place - low) * (series[low + 1] - series[low]);
    });
  }

  // Rows in which a held command switches have the mean of the forces before and after.
  function between(command, force) {
    const n = command.length, found = Float64Array.from(force);
    let most = 0.0;
    for (let k = 1; k < n; k++) most = Math.max(most, Math.abs(command[k] - command[k - 1]));
    const same = (k) => Math.abs(command[k + 1] - command[k]) <= 1e-9 * most;
    for (let k = 0; k + 4 < n; k++) {
      if (!(same(k) && !same(k + 1) && !same(k + 2) && same(k + 3))) continue;
      const gap = command[k + 3] - command[k + 1], share = gap ? (command[k + 2] - command[k + 1]) / gap : 0.0;
      if (share > 0.0 && share < 1.0) found[k + 2] = (1.0 - share) * force[k + 1] + share * force[k + 3];
    }
    return found;
  }

  // Force and loss along a command series, as `Thruster.response`.
  function response(t, command, step, minutes) {
    const lagged = lag(Float64Array.from(command), t.lag, step);
    const pairs = Array.from(lagged, (c) => lasting(t, c));
    return [0, 1].map((which) => {
      const prompt = between(lagged, pairs.map((pair) => pair[which]));
      const after = late(prompt, t.delay, step);
      return t.thrust_rate === 0.0 ? after : after.map((x, k) => x * Math.max(1.0 + t.thrust_rate * minutes[k], 0.0));
    });
  }

  // ---- the momentum balance -----------------------------------------------------------------------------------------

  function massMatrix() {
    const p = values, m13 = -p.mass * p.y_g, m23 = p.mass * p.x_g - p.Y_rdot;
    return [[p.mass - p.X_udot, 0.0, m13], [0.0, p.mass - p.Y_vdot, m23], [m13, m23, p.inertia_z - p.N_rdot]];
  }

  function inverse(m) {
    const cofactor = (i, j) => {
      const [a, b] = [0, 1, 2].filter((k) => k !== i), [c, d] = [0, 1, 2].filter((k) => k !== j);
      return ((i + j) % 2 ? -1 : 1) * (m[a][c] * m[b][d] - m[a][d] * m[b][c]);
    };
    const determinant = [0, 1, 2].reduce((sum, j) => sum + m[0][j] * cofactor(0, j), 0.0);
    return [0, 1, 2].map((i) => [0, 1, 2].map((j) => cofactor(j, i) / determinant));
  }

  // Summands of the force without thrusters: [places of the factors among SIGNALS, axis, coefficient].
  function summands(m) {
    const found = [];
    const add = (axis, coefficient, factors) => {
      if (coefficient !== 0.0) found.push([factors.map((name) => SIGNALS.indexOf(name)), axis, coefficient]);
    };
    // Minus C(nu) nu, multiplied out.
    add(0, m[1][1], ["v", "r"]); add(0, m[1][2], ["r", "r"]);
    add(1, -m[0][0], ["u", "r"]); add(1, -m[0][2], ["r", "r"]);
    add(2, m[0][0] - m[1][1], ["u", "v"]); add(2, -m[1][2], ["u", "r"]); add(2, m[0][2], ["v", "r"]);
    for (const [symbol, axis, factors, damps] of own.hydrodynamic) {
      add(axis, values[symbol], factors);
      if (damps) add(axis, values[symbol] * values.fouling_rate, [...factors, "t"]);
    }
    for (const [axis, name] of own.cross_flow.forces) {
      add(axis, -values.cross_flow, [name]);
      add(axis, -values.cross_flow * values.fouling_rate, [name, "t"]);
    }
    for (const [axis, sign, factors, symbol] of own.around) add(axis, sign * values[symbol], factors);
    return found;
  }

  function ready() {
    const m = massMatrix();
    const p = values;
    return {
      inverse: inverse(m),
      terms: summands(m),
      current: [p.current_north, p.current_east, p.current_rate_north, p.current_rate_east],
      pushes: thrusters.map((t) => {
        const ahead = Math.cos(t.angle), aside = Math.sin(t.angle);
        return [ahead, aside, t.arm_scale * (t.x * aside - t.y * ahead)];
      }),
    };
  }

  // What a hull of C_d = 1 resists the water with that crosses it, strip by strip, in pairs about the origin [N, N m].
  function acrossHull(v, r) {
    const strips = own.cross_flow.strips, length = own.hull.length;
    let force = 0.0, moment = 0.0;
    for (let k = 0; k < strips / 2; k++) {
      const x = ((k + 0.5) / strips) * length, ahead = v + x * r, abaft = v - x * r;
      force += Math.abs(ahead) * ahead + Math.abs(abaft) * abaft;
      moment += x * (Math.abs(ahead) * ahead - Math.abs(abaft) * abaft);
    }
    const width = (0.5 * own.cross_flow.density * own.hull.draught * length) / strips;
    return [width * force, width * moment];
  }

  // Rate of change of [north, east, psi, u, v, r, q_v, q_r].
  function rate(model, x, thrust, load, minutes, signals, out) {
    const cosine = Math.cos(x[2]), sine = Math.sin(x[2]), c = model.current;
    const north = c[0] + c[2] * minutes, east = c[1] + c[3] * minutes;
    const ahead = cosine * north + sine * east, starboard = cosine * east - sine * north;
    const u = x[3] - ahead, v = x[4] - starboard, r = x[5];
    const windAhead = -x[3], windAside = -x[4]; // of still air
    signals[0] = u; signals[1] = v; signals[2] = r;
    signals[3] = Math.abs(u); signals[4] = Math.abs(v); signals[5] = Math.abs(r);
    signals[6] = x[6]; signals[7] = x[7]; signals[8] = cosine; signals[9] = sine;
    signals[10] = windAhead; signals[11] = windAside; signals[12] = Math.hypot(windAhead, windAside);
    signals[13] = minutes;
    if (values.cross_flow !== 0.0) [signals[14], signals[15]] = acrossHull(v, r);
    let f0 = 0.0, f1 = 0.0, f2 = 0.0;
    for (const [places, axis, coefficient] of model.terms) {
      let product = coefficient;
      for (let k = 0; k < places.length; k++) product *= signals[places[k]];
      if (axis === 0) f0 += product; else if (axis === 1) f1 += product; else f2 += product;
    }
    for (let k = 0; k < thrust.length; k++) {
      const force = thrust[k] - load[k] * u, push = model.pushes[k];
      f0 += push[0] * force; f1 += push[1] * force; f2 += push[2] * force;
    }
    const i = model.inverse;
    out[0] = cosine * x[3] - sine * x[4];
    out[1] = sine * x[3] + cosine * x[4];
    out[2] = r;
    out[3] = i[0][0] * f0 + i[0][1] * f1 + i[0][2] * f2 + starboard * r + (cosine * c[2] + sine * c[3]) / 60.0;
    out[4] = i[1][0] * f0 + i[1][1] * f1 + i[1][2] * f2 - ahead * r + (cosine * c[3] - sine * c[2]) / 60.0;
    out[5] = i[2][0] * f0 + i[2][1] * f1 + i[2][2] * f2;
    out[6] = (v - x[6]) / values.memory_time;
    out[7] = (r - x[7]) / values.memory_time;
  }

  // What the wake remembers along a measured motion, [q_v, q_r] by row.
  function memory(log) {
    const n = log.u.length, v = new Float64Array(n), p = values;
    for (let k = 0; k < n; k++) {
      const north = p.current_north + p.current_rate_north * log.minutes[k];
      const east = p.current_east + p.current_rate_east * log.minutes[k];
      v[k] = log.v[k] - (Math.cos(log.psi[k]) * east - Math.sin(log.psi[k]) * north);
    }
    return [lag(v, p.memory_time, log.step), lag(Float64Array.from(log.r), p.memory_time, log.step)];
  }

  const STATES = ["north", "east", "psi", "u", "v", "r"];

  // Opens a log {step, minutes, north, east, psi, u, v, r, commands: [series of each thruster]} with the values as they
  // are now: a function that predicts open loop from the measured row `start`, and gives each of the `steps` rows ahead
  // with its state [north, east, psi, u, v, r, ...] to `take`.
  function open(log) {
    const model = ready(), h = log.step, count = thrusters.length;
    const acts = thrusters.map((t, k) => response(t, log.commands[k], h, log.minutes));
    const wake = memory(log);
    const signals = new Float64Array(SIGNALS.length), x = new Float64Array(8), y = new Float64Array(8);
    const slopes = [0, 1, 2, 3].map(() => new Float64Array(8));
    const thrust = [0, 1, 2].map(() => new Float64Array(count)), load = [0, 1, 2].map(() => new Float64Array(count));

    function step(k) {
      for (let j = 0; j < count; j++) {
        const [force, loss] = acts[j];
        thrust[0][j] = force[k]; thrust[2][j] = force[k + 1]; thrust[1][j] = 0.5 * (force[k] + force[k + 1]);
        load[0][j] = loss[k]; load[2][j] = loss[k + 1]; load[1][j] = 0.5 * (loss[k] + loss[k + 1]);
      }
      const minutes = log.minutes[k];
      for (let stage = 0; stage < 4; stage++) {
        const share = stage === 0 ? 0.0 : stage === 3 ? 1.0 : 0.5, at = stage === 0 ? 0 : stage === 3 ? 2 : 1;
        for (let j = 0; j < 8; j++) y[j] = stage ? x[j] + share * h * slopes[stage - 1][j] : x[j];
        rate(model, y, thrust[at], load[at], minutes + (share * h) / 60.0, signals, slopes[stage]);
      }
      for (let j = 0; j < 8; j++)
        x[j] += (h / 6.0) * (slopes[0][j] + 2.0 * slopes[1][j] + 2.0 * slopes[2][j] + slopes[3][j]);
      for (let j = 3; j < 6; j++)
        if (!(Math.abs(x[j]) <= SPEED_LIMIT)) x[j] = Number.isNaN(x[j]) ? 0.0 : Math.sign(x[j]) * SPEED_LIMIT;
    }

    return function ahead(start, steps, take) {
      STATES.forEach((name, place) => (x[place] = log[name][start]));
      x[6] = wake[0][start]; x[7] = wake[1][start];
      for (let k = start; k < start + steps; k++) { step(k); take(k + 1, x); }
    };
  }

  // Open-loop rollouts along a log, put back on the measurement every `every` rows: {north, east, psi, u, v, r}, the
  // measurement in the rows of starts.
  function rollouts(log, every) {
    const ahead = open(log), last = log.u.length - 1;
    const found = Object.fromEntries(STATES.map((name) => [name, Float64Array.from(log[name])]));
    for (let start = 0; start < last; start += every)
      ahead(start, Math.min(every, last - start), (k, x) => {
        if (k % every) STATES.forEach((name, place) => (found[name][k] = x[place]));
      });
    return found;
  }

  return { set, open, rollouts, values, thrusters };
}
