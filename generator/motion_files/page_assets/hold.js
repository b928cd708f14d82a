// The page of a held posture: loads are dragged or typed, and all numbers follow, as `mover hold` states them.
// Text of the file is inserted as text only, never as markup. Other scripts may use `window.page`.
"use strict";
(() => {
  const { byId, clamp, element } = mover;
  const data = JSON.parse(byId("posture").textContent);
  const UP = [0, 1, 0];
  const AXES = ["x", "y", "z"];
  const METRES_PER_NEWTON = 1 / 500;

  const plus = (one, other) => one.map((value, k) => value + other[k]);
  const times = (vector, factor) => vector.map((value) => value * factor);
  const dot = (one, other) => one.reduce((sum, value, k) => sum + value * other[k], 0);
  const norm = (vector) => Math.sqrt(dot(vector, vector));
  const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  const total = (load) => plus(load.force, times(data.gravity, load.mass));

  // Statics of the supports

  /** The most equal shares of points (x, z) whose centre is nearest to a target. */
  function equalShares(points, target) {
    if (points.length === 1) return [1];
    const middle = [0, 1].map((k) => mean(points.map((point) => point[k])));
    const [x, z] = [0, 1].map((k) => points.map((point) => point[k] - middle[k]));
    // Turned so that both rows are at right angles: their lengths are the singular values.
    const turn = 0.5 * Math.atan2(2 * dot(x, z), dot(z, z) - dot(x, x));
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    const rows = [plus(times(x, c), times(z, -s)), plus(times(x, s), times(z, c))];
    const [tx, tz] = [target[0] - middle[0], target[1] - middle[1]];
    const aims = [c * tx - s * tz, s * tx + c * tz];
    const largest = Math.max(...rows.map(norm));
    let differences = points.map(() => 0);
    rows.forEach((row, k) => {
      if (norm(row) > 1e-9 * largest) differences = plus(differences, times(row, aims[k] / dot(row, row)));
    });
    return differences.map((value) => 1 / points.length + value - mean(differences));
  }

  function sharesOf(centres, force, moment) {
    let active = centres.map((_, k) => k);
    let shares = centres.map(() => 0);
    const share = (height) => {
      const about = plus(moment, times(cross([0, height, 0], force), -1));
      const points = active.map((k) => [centres[k][0], centres[k][2]]);
      const found = equalShares(points, [about[2] / force[1], -about[0] / force[1]]);
      shares = centres.map(() => 0);
      active.forEach((k, n) => (shares[k] = found[n]));
    };
    const heights = centres.map((centre) => centre[1]);
    for (;;) {
      const sum = active.reduce((some, k) => some + shares[k] * heights[k], 0);
      share(shares.some((value) => value !== 0) ? sum : mean(active.map((k) => heights[k])));
      share(dot(shares, heights));
      const worst = shares.indexOf(Math.min(...shares));
      if (shares[worst] >= 0) return shares;
      active = active.filter((k) => k !== worst);
    }
  }

  /** Distance of a point (z, x) to the edge of a hull, negative outside, and the way out. */
  function edge(point, corners) {
    let [best, way, inside] = [Infinity, null, corners.length > 2];
    corners.forEach((corner, k) => {
      const along = plus(corners[(k + 1) % corners.length], times(corner, -1));
      const arm = plus(point, times(corner, -1));
      const place = clamp(dot(arm, along) / (dot(along, along) || 1), 0, 1);
      const away = plus(arm, times(along, -place));
      const distance = Math.hypot(...away);
      if (along[0] * arm[1] - along[1] * arm[0] < 0) inside = false;
      if (distance < best) {
        best = distance;
        way = distance > 1e-6 ? times(away, 1 / distance) : null;
      }
    });
    return { margin: inside ? best : -best, way };
  }

  function carry(force, moment) {
    const weight = -force[1];
    if (!(weight > 0)) {
      const more = (-weight).toFixed(0);
      return { refusal: `the loads lift the body: they pull it up by ${more} N more than its weight` };
    }
    const centres = data.supports.map((support) => support.centre);
    const shares = sharesOf(centres, force, moment);
    const forces = shares.map((share) => times(force, -share));
    const moments = forces.map((own, k) => cross(centres[k], own));
    const rest = moments.reduce((sum, own) => plus(sum, times(own, -1)), times(moment, -1));
    const shift = [rest[2] / weight, 0, -rest[0] / weight];
    const couple = rest[1] - cross(shift, times(force, -1))[1];
    const bearings = data.supports.map((support, k) => {
      const point = plus(centres[k], shift);
      const isInside = edge([point[2], point[0]], support.corners).margin >= -1e-6;
      const own = [0, shares[k] * couple, 0];
      return { support, share: shares[k], force: forces[k], point, moment: plus(cross(point, forces[k]), own), isInside };
    });
    const centre = bearings.reduce((sum, one) => plus(sum, times(one.point, one.share)), [0, 0, 0]);
    const found = { bearings: bearings.filter((one) => one.share > 0), centre };
    return { ...found, ...edge([centre[2], centre[0]], data.hull) };
  }

  function balanceSentence(standing) {
    const names = standing.bearings.map((one) => one.support.name).sort();
    const labels = standing.bearings.map((one) => one.support.label);
    const where = names.join() === "left_foot,right_foot" ? "both feet" : labels.join(" and ");
    const ways = [];
    if (standing.way) {
      const [z, x] = standing.way;
      const least = Math.sin(Math.PI / 8);
      if (Math.abs(z) > least) ways.push(z > 0 ? "forward" : "back");
      if (Math.abs(x) > least) ways.push(x > 0 ? "to the left" : "to the right");
    }
    const way = ways.length ? `, ${ways.join(" and ")}` : "";
    let advice = "change the pose";
    if (data.forwards) {
      const [x, , z] = cross(data.forwards, UP);
      const sides = data.hull.map((corner) => z * corner[0] + x * corner[1]);
      const side = x * standing.centre[0] + z * standing.centre[2];
      advice += ", or shift the pelvis by --balance";
      if (side < Math.min(...sides) || side > Math.max(...sides))
        advice =
          "lean to the other side, or name what else bears it by --support (--balance shifts fore and aft only)";
    }
    const distance = (-100 * standing.margin).toFixed(1);
    return `the centre of pressure is ${distance} cm outside ${where}${way}: the person tips over; ${advice}`;
  }

  // Strengths

  /** Error function by its series, whose terms are all positive. */
  function erf(x) {
    if (Math.abs(x) > 6) return Math.sign(x);
    let [term, sum] = [x, 0];
    for (let n = 0; sum + term !== sum; n++) {
      sum += term;
      term *= (2 * x * x) / (2 * n + 3);
    }
    return (2 / Math.sqrt(Math.PI)) * Math.exp(-x * x) * sum;
  }

  function percentCapable(demand, capacity, spread) {
    if (capacity <= 0) return demand > 0 ? 0 : 100;
    const deviation = spread * capacity;
    const x = deviation ? (capacity - demand) / deviation : capacity >= demand ? Infinity : -Infinity;
    return 50 * (1 + erf(x / Math.SQRT2));
  }

  function endurance([factor, exponent], use) {
    if (use < data.least_endurance_use) return null;
    return use > 1 ? 0 : factor * use ** exponent;
  }

  function demandOf(axis, total) {
    const active = total - axis.passive;
    const isOpposite = active < -data.no_moment;
    const sign = isOpposite ? -1 : 1;
    const { name, capacity, spread, origin } = axis.directions[isOpposite ? 1 : 0];
    const own = { joint: axis.joint, direction: name, angle: axis.angle, origin, capacity };
    Object.assign(own, { net: sign * total, passive: sign * axis.passive, active: Math.abs(active) });
    own.isAntagonist = -own.passive > Math.abs(own.net) + data.no_moment;
    own.use = own.percent = own.endurance = null;
    if (capacity === null) return own;
    own.use = capacity > 0 ? own.active / capacity : own.active > data.no_moment ? Infinity : 0;
    own.percent = own.active <= data.no_moment ? 100 : percentCapable(own.active, capacity, spread);
    own.endurance = endurance(axis.endurance, own.use);
    return own;
  }

  /** The mean force of women along a direction at a place: the Arm Force Field. */
  function handForce([forwards, upwards, outwards], [fForwards, fUpwards, fOutwards]) {
    const field = data.field;
    const place = [upwards, forwards, outwards];
    const force = [fUpwards, fForwards, fOutwards];
    const across = place.map((part) => Math.sqrt(dot(place, place) - part * part));
    const arm = cross(place, force);
    const length = norm(arm);
    const inputs = [
      ...place, ...across, ...force, ...arm, length, length ** 2, length ** 3, ...across.map((part, k) => part * force[k]),
    ];
    const scaled = inputs.map((value, k) => field.gain[k] * (value - field.offset[k]) - 1);
    const nodes = field.hidden.map((row, k) => Math.tanh(field.hidden_bias[k] + dot(row, scaled)));
    const found = (field.output_bias + dot(field.output, nodes) + 1) / field.output_gain + field.output_offset;
    const codes = [Math.abs(upwards) <= data.level_band ? 0 : Math.sign(upwards)];
    for (const part of [fForwards, fUpwards, fOutwards]) codes.push(Math.abs(part) < 1e-12 ? 0 : Math.sign(part));
    const index = codes.reduce((sum, code) => 3 * sum + code + 1, 0);
    return Math.min(Math.max(found, field.least_N[index]), field.largest_N[index]);
  }

  function handDemand(hand, loads) {
    const own = loads.filter((load) => load.segment === hand.hand).map(total);
    const force = times(own.reduce(plus, [0, 0, 0]), -1);
    const size = norm(force);
    if (size < data.no_force) return null;
    const along = hand.axes.map((axis) => dot(axis, times(force, 1 / size)));
    const strength = hand.factor * handForce(hand.point, along);
    const assistance = dot(hand.assistance, along);
    const percent = percentCapable(size - assistance, strength, data.field.spread);
    return { hand: hand.hand, force: size, capacity: strength + assistance, percent, origin: hand.origin };
  }

  function spineLoad([extension, lateral, along]) {
    const compression = (arm) =>
      along + Math.hypot(extension >= 0 ? extension / arm : -extension / data.spine.front_arm, lateral / arm);
    const [low, middle, high] = data.spine.arms.map(compression);
    return { moment: extension, lateral: -lateral, low, compression: middle, high };
  }

  const rounded = (value) => Math.round(1e9 * value);

  /** What `mover hold` states of the posture with loads, or the sentence with which it refuses. */
  function judge(loads) {
    let rows = [...data.base];
    const add = (columns, wrench) => {
      columns.forEach((column, k) => (rows = plus(rows, times(column, wrench[k]))));
    };
    let { force, moment } = data.weight;
    for (const load of loads) {
      force = plus(force, total(load));
      moment = plus(moment, cross(load.point, total(load)));
      add(load.columns, total(load));
    }
    let standing = null;
    if (data.supports.length) {
      standing = carry(force, moment);
      if (standing.refusal) return standing;
      if (standing.margin < 0) return { refusal: balanceSentence(standing), centre: standing.centre };
      for (const one of standing.bearings) add(one.support.columns, [...one.force, ...one.moment]);
    }
    const demands = data.axes.map((axis, k) => demandOf(axis, rows[k]));
    const known = demands.filter((one) => one.use !== null);
    const weakest = known.reduce((best, one) => (best && rounded(best.use) >= rounded(one.use) ? best : one), null);
    const used = known.filter((one) => one.use >= data.least_use);
    const least = used.reduce((best, one) => {
      if (!best) return one;
      const difference = rounded(best.percent) - rounded(one.percent);
      return difference < 0 || (difference === 0 && best.use >= one.use) ? best : one;
    }, null) ?? weakest;
    const spine = data.spine ? spineLoad(rows.slice(-3)) : null;
    const hands = data.hands.map((hand) => handDemand(hand, loads)).filter(Boolean);
    return { demands, weakest, least, standing, spine, hands };
  }

  // Texts, as those of the command

  const withoutZero = (value, digits) => (Number(value.toFixed(digits)) + 0).toFixed(digits);
  const capable = (one) => `${one.percent.toFixed(1)} %`;

  function percent(use) {
    if (!Number.isFinite(use)) return "more than all";
    return use <= data.largest_use ? `${(100 * use).toFixed(0)} %` : `over ${(100 * data.largest_use).toFixed(0)} %`;
  }

  function duration(seconds) {
    if (seconds === null) return "long";
    if (seconds === 0) return "none";
    return seconds < 120 ? `${seconds.toFixed(0)} s` : `${(seconds / 60).toFixed(0)} min`;
  }

  function verdict({ weakest, least, hands }, loads) {
    if (data.beyond) return data.beyond;
    if (!weakest) return "no strength of its joints is known";
    if (weakest.active === 0) return `holds without muscles; ${data.who}`;
    const joint = `${weakest.joint} ${weakest.direction}`;
    const largest = Math.max(0, ...loads.map((load) => norm(total(load))));
    if (weakest.use > (largest <= data.largest_force ? data.largest_use : 1)) {
      const many = Number.isFinite(weakest.use) ? `${Number(weakest.use.toPrecision(3))} times` : "it is beyond";
      return `nobody holds this: ${many} the strength of ${joint} of ${data.who}`;
    }
    let [share, where] = [least.percent, `${least.joint} ${least.direction}`];
    for (const one of hands)
      if (rounded(one.percent) < rounded(share)) [share, where] = [one.percent, `${one.hand} by the Arm Force Field`];
    let text = `${share.toFixed(0)} % of ${data.who} are strong enough`;
    if (share < weakest.percent - 0.5) text += ` (${where})`;
    text += `; weakest joint is ${joint} with ${percent(weakest.use)} of its strength`;
    return weakest.endurance ? `${text}, for ${duration(weakest.endurance)}` : text;
  }

  function* lines({ demands, standing, spine, hands }) {
    if (standing) {
      const [x, , z] = times(standing.centre, 100);
      yield `balance: centre of pressure ${Math.abs(x).toFixed(1)} cm to the ${x >= 0 ? "left" : "right"} and ` +
        `${Math.abs(z).toFixed(1)} cm ${z >= 0 ? "forward" : "back"} of the world's origin, ` +
        `${(100 * standing.margin).toFixed(1)} cm inside the edge of the support`;
    }
    if (spine) {
      const [action, largest] = data.spine.limits;
      let limit = `above NIOSH's ${action} N, below ${largest} N`;
      if (spine.high <= action) limit = `below NIOSH's ${action} N`;
      else if (spine.low > largest) limit = `above NIOSH's ${action} and ${largest} N`;
      else if (spine.high > largest) limit = `NIOSH's ${largest} N is within the band`;
      else if (spine.low <= action) limit = `NIOSH's ${action} N is within the band`;
      const [compression, low, high] = [spine.compression, spine.low, spine.high].map((value) => value.toFixed(0));
      const [forward, left] = [spine.moment, spine.lateral].map((value) => Number(value.toFixed(0)));
      yield `L5/S1: bent by ${Math.abs(forward)} N m ${forward >= 0 ? "forward" : "back"} and ` +
        `${Math.abs(left)} N m to the ${left >= 0 ? "left" : "right"}, ` +
        `compression ${compression} N (${low} to ${high}); ${limit}`;
    }
    for (const hand of hands) {
      yield `${hand.hand}: ${hand.force.toFixed(0)} N of ${hand.capacity.toFixed(0)} N by the Arm Force Field, ` +
        `${capable(hand)} capable (${hand.origin})`;
    }
    if (demands.some((one) => one.isAntagonist && one.use !== null && one.use >= data.shown_use))
      yield "* against the passive moment, which is larger than the net one";
  }

  /** Demands by use, the largest first, both sides as one where they are equal. */
  function merged(demands) {
    const ordered = [...demands].sort((one, other) => rounded(other.use ?? 0) - rounded(one.use ?? 0) || 0);
    const done = new Set();
    return ordered.flatMap((one) => {
      if (done.has(one)) return [];
      const [, side, rest] = /^(left|right)_(.*)$/.exec(one.joint) ?? [];
      let name = one.joint;
      for (const twin of side ? ordered : []) {
        if (
          twin.joint === `${side === "left" ? "right" : "left"}_${rest}` && twin.direction === one.direction
          && Math.abs(twin.active - one.active) <= data.same * Math.max(one.active, 0.1)
          && Math.abs(twin.angle - one.angle) < 1e-4
        ) {
          done.add(twin);
          name = `both ${rest.replace(/_joint$/, "")}s`;
        }
      }
      return [[name, one]];
    });
  }

  function cells([name, one]) {
    const known = one.capacity !== null;
    return [
      name,
      one.isAntagonist ? `${one.direction}*` : one.direction,
      known ? percent(one.use) : "",
      withoutZero(one.angle, 0),
      ...[one.net, one.passive, one.active].map((value) => withoutZero(value, 1)),
      known ? withoutZero(one.capacity, 1) : "",
      known ? capable(one) : "",
      known ? duration(one.endurance) : "",
      one.origin,
    ];
  }

  function notes(standing) {
    const found = [...data.notes_before];
    const bearings = standing?.bearings ?? [];
    const outside = bearings.filter((one) => !one.isInside).map((one) => one.support.name);
    if (outside.length) found.push(`${outside.join(" and ")} would have to push outside its own area`);
    if (bearings.length > 1) {
      const parts = bearings.map((one) => `${one.support.name} ${one.force[1].toFixed(0)} N`).join(", ");
      const what = bearings.every((one) => one.support.is_foot) ? "feet" : "supports";
      found.push(`${parts}; ${what} are assumed not to push against each other`);
    }
    return [...found, ...data.notes_after];
  }

  // Page

  const loads = data.loads.map((load) => ({ ...load }));
  const pictures = [...document.querySelectorAll("svg.view")];
  let result = null;

  function fill(parent, tag, texts) {
    parent.replaceChildren();
    for (const text of texts) element(tag, text, parent);
  }

  function colour(use) {
    if (use === null) return "#bbbbbb";
    if (use > 1) return "#7f0000";
    const [low, high] = use < 0.5 ? [[44, 123, 182], [255, 255, 191]] : [[255, 255, 191], [215, 25, 28]];
    const part = use < 0.5 ? 2 * use : 2 * use - 1;
    return `rgb(${low.map((value, k) => Math.round(value + part * (high[k] - value))).join()})`;
  }

  const place = (view, point) => [view.x + data.scale * dot(point, view.right), view.y - data.scale * point[1]];

  const tipOf = (picture, k) => picture.querySelector(`[data-load="${k}"]`);

  function draw() {
    const uses = new Map();
    for (const one of result.demands ?? [])
      if (!uses.has(one.joint) || (one.use ?? 0) > (uses.get(one.joint).use ?? 0)) uses.set(one.joint, one);
    pictures.forEach((picture, k) => {
      const view = data.views[k];
      for (const shape of picture.querySelectorAll("[data-joint]")) {
        const one = uses.get(shape.dataset.joint);
        const use = one?.use ?? null;
        const text = use === null ? "not known" : Number.isFinite(use) ? `${(100 * use).toFixed(0)} %` : "more than all";
        if (shape.tagName === "text") {
          shape.textContent = text;
          shape.setAttribute("visibility", use !== null && use >= 0.2 ? "visible" : "hidden");
        } else {
          shape.setAttribute("fill", colour(use));
          shape.querySelector("title").textContent = one ? `${one.joint} ${one.direction}: ${text}` : shape.dataset.joint;
        }
      }
      loads.forEach((load, n) => {
        const tip = tipOf(picture, n);
        const force = total(load);
        const size = norm(force);
        const length = size ? clamp(size * METRES_PER_NEWTON, ...data.arrow) / size : 0;
        const [x, y] = place(view, plus(load.point, times(force, length)));
        for (const [shape, names] of [[tip.previousElementSibling, ["x2", "y2"]], [tip, ["cx", "cy"]]])
          [x, y].forEach((value, axis) => shape.setAttribute(names[axis], value));
        tip.querySelector("title").textContent = `${load.segment}: ${size.toFixed(0)} N`;
      });
      const centre = result.standing?.centre ?? result.centre;
      for (const mark of picture.querySelectorAll(".pressure")) {
        mark.setAttribute("visibility", centre ? "visible" : "hidden");
        if (centre) mark.setAttribute("d", `M${place(view, centre).join()} l-6,10 h12 z`);
        mark.setAttribute("fill", result.refusal ? "#d7191c" : "#333333");
      }
    });
  }

  function options() {
    const words = [];
    for (const load of loads) {
      if (load.mass) words.push(`--load ${load.option}=${load.mass}kg`);
      if (load.force.some((part) => part !== 0)) words.push(`--load ${load.option}=${load.force.join()}N`);
    }
    return words.join(" ") || "no load";
  }

  const refusal = (sentence) => `The command refuses this: ${sentence}`;

  /** The longest refusal, by whose lines the place of the verdict is reserved. */
  function longestRefusal() {
    if (!data.supports.length) return "";
    const bearings = data.supports.map((support) => ({ support }));
    return refusal(balanceSentence({ bearings, margin: -10, way: [-Math.SQRT1_2, -Math.SQRT1_2], centre: [1e3, 0, 1e3] }));
  }

  function show() {
    result = judge(loads);
    const refused = result.refusal && refusal(result.refusal);
    // A page that grows shorter would be scrolled under the pointer.
    document.body.style.minHeight = refused ? `${document.body.offsetHeight}px` : "";
    byId("verdict").className = refused ? "refused" : "";
    byId("verdict").textContent = refused || verdict(result, loads);
    fill(byId("lines"), "p", refused ? [] : [...lines(result)]);
    byId("rows").replaceChildren();
    for (const row of refused ? [] : merged(result.demands)) {
      const made = element("tr", "", byId("rows"));
      for (const text of cells(row)) element("td", text, made);
    }
    fill(byId("notes"), "li", refused ? [] : notes(result.standing));
    byId("options").textContent = options();
    draw();
  }

  /** Make the controls of a component of a load; returns what shows its value. */
  function control(parent, load, text, [least, largest], reach, get, set) {
    const row = element("p", "", parent);
    const label = `${load.option} ${text}`;
    element("span", text, row);
    const fault = element("span", "", row);
    fault.id = `fault ${label}`.replace(/\W+/g, "-");
    fault.className = "fault";
    fault.setAttribute("role", "status");
    const tell = (input, sentence) => {
      fault.textContent = sentence;
      if (sentence) input.setAttribute("aria-invalid", "true");
      else input.removeAttribute("aria-invalid");
    };
    const made = ["range", "number"].map((type) => {
      const input = element("input", "", row);
      input.setAttribute("aria-label", type === "range" ? `${label}, slider` : label);
      Object.assign(input, { type, min: least, max: largest, step: type === "range" ? reach / 100 : "any" });
      if (type === "range") Object.assign(input, { min: Math.max(least, -reach), max: reach });
      input.addEventListener("input", () => {
        const isValid = input.value !== "" && input.validity.valid;
        tell(input, isValid ? "" : `not a number from ${least} to ${largest}: all numbers are still those of ${get()}`);
        if (!isValid) return;
        set(Number(input.value));
        update(input);
      });
      return input;
    });
    made[1].setAttribute("aria-describedby", fault.id);
    row.append(fault);
    return (except) => {
      for (const input of made) {
        if (input === except) continue;
        input.value = get();
        tell(input, "");
      }
    };
  }

  const updates = [];
  function update(except) {
    for (const each of updates) each(except);
    show();
  }

  function makeControls() {
    for (const load of loads) {
      const group = element("fieldset", "", byId("controls"));
      element("legend", load.option.replaceAll("_", " "), group);
      const reach = 50 * Math.max(1, Math.ceil(load.mass / 50));
      updates.push(control(group, load, "mass [kg]", [0, 1e4], reach, () => load.mass, (value) => (load.mass = value)));
      AXES.forEach((name, k) => {
        const set = (value) => (load.force = load.force.map((old, n) => (n === k ? value : old)));
        const most = 200 * Math.max(1, Math.ceil(Math.abs(load.force[k]) / 200));
        updates.push(control(group, load, `${name} [N]`, [-1e5, 1e5], most, () => load.force[k], set));
      });
    }
  }

  /** A tip of an arrow follows the pointer in the plane of its view, in whole newtons. */
  function drag(picture, view, tip, load) {
    let start = null;
    tip.addEventListener("pointerdown", (event) => {
      tip.setPointerCapture(event.pointerId);
      start = { x: event.clientX, y: event.clientY, force: load.force };
      event.preventDefault();
    });
    tip.addEventListener("pointermove", (event) => {
      if (!start) return;
      const pixels = picture.viewBox.baseVal.width / picture.getBoundingClientRect().width;
      const newtons = pixels / data.scale / METRES_PER_NEWTON;
      const [right, up] = [event.clientX - start.x, start.y - event.clientY].map((value) => value * newtons);
      const moved = plus(times(view.right, right), times(UP, up));
      load.force = plus(start.force, moved).map((part, k) => (moved[k] ? clamp(Math.round(part), -1e5, 1e5) : part));
      update();
    });
    for (const kind of ["pointerup", "pointercancel"]) tip.addEventListener(kind, () => (start = null));
  }

  function reset() {
    loads.forEach((load, k) => Object.assign(load, { mass: data.loads[k].mass, force: data.loads[k].force }));
    update();
  }

  function open() {
    byId("change").hidden = !loads.length;
    byId("reserve").textContent = longestRefusal();
    makeControls();
    pictures.forEach((picture, k) => {
      loads.forEach((load, n) => drag(picture, data.views[k], tipOf(picture, n), load));
    });
    byId("reset").addEventListener("click", reset);
    update();
  }

  /**
   * Handle for scripts and tests: `set(k, load)` changes mass [kg] and force [N] of a load, `result` is what is
   * shown, with moments in N m, forces in N and uses as ratios, or has a `refusal`.
   */
  window.page = {
    loads,
    set(k, { mass, force }) {
      Object.assign(loads[k], { mass: mass ?? loads[k].mass, force: force ?? loads[k].force });
      update();
    },
    get result() { return result; },
    ready: Promise.resolve(open()),
  };
})();
