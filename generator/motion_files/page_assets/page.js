// The page of a motion: the body in three dimensions, its curves, and the time that moves both. The rows of a page of
// inverse dynamics have `net`: the moment that the motion needs, over time, in place of the curve of a passive moment.
// Text of the file is inserted as text only, never as markup. Other scripts may use `window.page`.
"use strict";
(() => {
  const {
    axis, between, byId, bytesOf, clamp, colour, doubles, element, extremes, fitPlot, fixed, floats, legendEntry,
    makePlot, marker, scrub, series, withGaps,
  } = mover;
  const MAX_FORCE_LINES = 7;
  const motion = JSON.parse(byId("motion").textContent);
  const times = doubles(motion.times);
  const timeLine = mover.timeLine(times, (position) => {
    stage.move(position);
    movePoints();
  });

  const parts = motion.forces.map((row) => mover.forcesOf(row, times.length));
  const largest = (some) => [...some].sort((one, other) => other.peak - one.peak).slice(0, MAX_FORCE_LINES);

  // Body, props and forces

  const canvas = byId("body");
  const views = [...byId("views").children];
  const nothing = {
    move() {}, highlight() {}, recolour() {}, view() {}, showForces() {},
    pose: () => null, triangles: () => 0, props: () => [], forces: () => [],
  };
  let stage = nothing;

  function notice(text) {
    byId("notice").textContent = text;
    byId("notice").hidden = false;
    canvas.hidden = byId("camera").hidden = true;
  }

  async function loadBody() {
    if (!mover.canDraw()) {
      notice("This browser has no WebGL 2 here, so the body is not drawn. The curves and the time are shown.");
      return;
    }
    const { body, props } = await mover.readBody(bytesOf(byId("glb").textContent), times.length);
    stage = makeStage(body, props);
  }

  function makeStage(body, props) {
    const made = mover.stage(canvas, byId("stage"));
    const scene = mover.addSurroundings(made, props, body);
    const arrows = parts.length ? mover.addArrows(made, parts, motion.arrows, body.size) : null;
    const follow = byId("follow");
    follow.checked = body.isFar;
    byId("forces-choice").hidden = !arrows;
    made.add(body.figure);
    made.light(body.isFar ? body.first : body.whole, body.size);

    function move(position) {
      body.move(position);
      arrows?.move(position);
      if (follow.checked) made.shift(body.centre());
      made.draw();
    }

    function highlight(joint) {
      body.highlight(joint, colour("--series-1"));
      made.draw();
    }

    function showForces() {
      arrows?.show(byId("forces").checked);
      byId("scale").textContent = [scene.text, ...(arrows && byId("forces").checked ? [motion.arrows.text] : [])].join(". ");
      made.draw();
    }

    /** Frame the body and the props near it from a direction, over the whole motion or as it is followed. */
    function view(direction) {
      if (follow.checked) made.frame(direction, body.corners, body.centre());
      else made.frame(direction, [...body.places, ...scene.corners]);
    }

    made.listenToClicks(body.meshes, (mesh) => {
      const joint = mesh?.userData.joint;
      if (joint !== motion.rows[selected].joint && motion.rows.some((row) => row.joint === joint)) select(liveliest(joint));
    });
    made.controls.addEventListener("start", () => press(views[0]));
    made.recolour();
    showForces();
    const names = props.map(({ name, userData }) => [name, userData.prop]);
    return {
      move, highlight, showForces, view, recolour: made.recolour, pose: body.pose, triangles: made.triangles,
      props: () => names, forces: () => arrows?.visible() ?? [],
    };
  }

  // Plots

  let selected = 0;
  let momentPlot = null;
  let timePlot = null;
  let momentPoint = null;
  let momentCursor = null;
  let recordedPoint = null;
  let timeCursor = null;
  let strip = null;
  let fits = [];

  function showMoment(row) {
    momentPlot?.destroy();
    momentPlot = momentPoint = recordedPoint = momentCursor = null;
    byId("moment-legend").replaceChildren();
    byId("moment").hidden = !row.curve && !row.net;
    byId("no-moment").hidden = Boolean(row.curve || row.net);
    if (row.net) {
      showNet(row);
      return;
    }
    if (!row.curve) {
      byId("no-moment").textContent = motion.no_curve;
      return;
    }
    const { angles, law, published, limits, held } = row.curve;
    // A browser draws no dashes of a line that goes out of the plot by millions.
    const reach = 10 * (limits[1] - limits[0]);
    const near = (value) => (value === null ? null : clamp(value, limits[0] - reach, limits[1] + reach));
    const data = [Array.from(floats(angles)), withGaps(floats(law))];
    const lines = [{}, { stroke: () => colour("--ink"), width: 2.5, points: { show: false } }];
    const bands = [];
    published.forEach((one, k) => {
      data.push(withGaps(floats(one.values)).map(near));
      const dash = one.measured ? undefined : [6, 4];
      lines.push({ stroke: () => series(k), width: 1.5, dash, points: { show: false } });
      if (!one.low) return;
      data.push(withGaps(floats(one.high)), withGaps(floats(one.low)));
      const edge = { stroke: "transparent", points: { show: false } };
      lines.push(edge, edge);
      bands.push({ series: [lines.length - 2, lines.length - 1], fill: () => `${series(k)}33` });
    });
    momentPlot = makePlot(
      byId("moment-plot"),
      {
        scales: { x: { time: false }, y: { range: limits } },
        axes: [axis(`${row.label} [deg]`, 28), axis("Passive moment [N m]")],
        series: lines,
        bands,
        hooks: { draw: [movePoints] },
      },
      data,
    );
    byId("moment-plot").setAttribute("aria-label", `${row.label}: passive moment [N m] over the angle`);
    momentPoint = marker(momentPlot, "point");
    if (row.recorded) recordedPoint = marker(momentPlot, "point recorded");
    const legend = byId("moment-legend");
    legendEntry(legend, colour("--ink"), `this figure${held ? `, ${held}` : ""}`);
    legendEntry(legend, colour("--accent"), "at this time", "disc");
    if (row.recorded) legendEntry(legend, colour("--accent"), "whole joint in the run, with damping", "ring");
    published.forEach((one, k) => legendEntry(legend, series(k), one.label, one.measured ? "" : "model"));
    const sources = emptySources();
    element("li", "Bands are the published scatter; dashed curves cannot be compared with joints.", sources);
    element("li", `this figure: ${motion.springs}; ${row.curve.source}`, sources);
    for (const one of published) element("li", `${one.label}: ${one.text}`, sources);
  }

  function emptySources() {
    const sources = byId("sources").querySelector("ul");
    sources.replaceChildren();
    return sources;
  }

  /** Moment that the motion needs with the passive ones, over time. */
  function showNet({ label, net }) {
    const lines = [[`net ${net.noun}`, floats(net.moments), net.lower && [floats(net.lower), floats(net.upper)]]];
    momentPlot = plotOverTime("moment", `${label}: net ${net.noun} [${net.unit}]`, lines);
    momentCursor = marker(momentPlot, "cursor");
    momentPoint = marker(momentPlot, "point");
    byId("sources").hidden = !net.lower;
    const sources = emptySources();
    element("li", "The band is absent at angles at which no law was measured.", sources);
    for (const source of motion.net.sources) element("li", source, sources);
  }

  /** Power of the net moment and of the ends of the passive ones. */
  function powers({ net }) {
    const rates = floats(net.rates);
    const power = (values) => values.map((value, k) => value * rates[k]);
    if (!net.lower) return [["net power", power(floats(net.moments))]];
    const [one, other] = [power(floats(net.lower)), power(floats(net.upper))];
    const ends = [Math.min, Math.max].map((end) => one.map((value, k) => end(value, other[k])));
    return [["net power", power(floats(net.moments)), ends]];
  }

  /**
   * A plot over time in place of that of `moment` or `time`. Lines are `[name, values]`, and with a third the lower and
   * the upper end of a band. Times at which accelerations are unsure are grey.
   */
  function plotOverTime(place, label, lines) {
    const list = byId(`${place}-legend`);
    list.replaceChildren();
    const data = [Array.from(times)];
    const [drawn, bands] = [[{}], []];
    const hasBand = lines.some(([, , band]) => band);
    lines.forEach(([, values, band], k) => {
      for (const end of band ? [band[1], band[0]] : []) {
        data.push(withGaps(end));
        drawn.push({ stroke: () => series(k), width: 0.5, points: { show: false } });
      }
      if (band) bands.push({ series: [drawn.length - 2, drawn.length - 1], fill: () => `${series(k)}55` });
      data.push(withGaps(values));
      const stroke = () => (band ? colour("--ink") : series(k));
      drawn.push({ stroke, width: band ? 2.5 : 1.5, points: { show: false } });
    });
    const plot = makePlot(
      byId(`${place}-plot`),
      {
        scales: { x: { time: false } },
        axes: [axis("Time [s]", 28), axis(label.slice(label.lastIndexOf("[")))],
        series: drawn,
        bands,
        hooks: { drawClear: [shadeUnsure], draw: [movePoints] },
      },
      data,
    );
    byId(`${place}-plot`).setAttribute("aria-label", label);
    lines.forEach(([name, , band], k) => {
      if (lines.length > 1 || motion.net) legendEntry(list, band ? colour("--ink") : series(k), name);
      if (band) legendEntry(list, series(k), motion.net.band);
    });
    if (motion.net) legendEntry(list, colour("--line"), "unsure: near the ends of the motion");
    scrub(plot, timeLine);
    return plot;
  }

  function shadeUnsure(plot) {
    if (!motion.net) return;
    const { left, top, width, height } = plot.bbox;
    const place = (at) => clamp(plot.valToPos(at, "x", true), left, left + width);
    const sure = motion.net.sure ?? [timeLine.stop, timeLine.stop];
    plot.ctx.fillStyle = `${colour("--line")}99`;
    for (const [from, to] of [[timeLine.start, sure[0]], [sure[1], timeLine.stop]])
      plot.ctx.fillRect(place(from), top, place(to) - place(from), height);
  }

  function quantities(row) {
    const found = [[`${row.label} [${row.unit}]`, [[row.label, floats(row.values)]]]];
    if (row.net) found.unshift([`${row.label}: power [W]`, powers(row)]);
    if (row.recorded) found.push([`${row.label}: moment of the run [N m]`, [[row.label, floats(row.recorded)]]]);
    if (parts.length)
      found.push([motion.net ? "External forces [N]" : "Contact forces [N]", largest(parts).map((part) => [part.name, part.sizes])]);
    if (motion.energy.length)
      found.push(["Energy of the figure [J]", motion.energy.map((one) => [one.name, floats(one.values)])]);
    return found;
  }

  function showOverTime() {
    const [label, lines] = quantities(motion.rows[selected])[byId("quantity").selectedIndex];
    timePlot?.destroy();
    timePlot = plotOverTime("time", label, lines);
    timeCursor = marker(timePlot, "cursor");
  }

  /**
   * Angle [deg], moment of the law and moment of the run [N m] at the present time; of inverse dynamics the angle, the
   * net moment and its power [W].
   */
  function point() {
    const { values, curve, recorded, net } = motion.rows[selected];
    const at = timeLine.position(timeLine.time);
    const value = (text) => (text ? between(floats(text), at) : null);
    if (net) return [value(values), value(net.moments), value(net.moments) * value(net.rates)];
    return [value(values), value(curve?.moments), value(recorded)];
  }

  function put(mark, x, moment) {
    const { min, max } = momentPlot.scales.y;
    mark.classList.toggle("beyond", moment < min || moment > max);
    mark.style.left = `${momentPlot.valToPos(x, "x")}px`;
    mark.style.top = `${momentPlot.valToPos(clamp(moment, min, max), "y")}px`;
  }

  function movePoints() {
    const [angle, moment, recorded] = point();
    const { unit, net } = motion.rows[selected];
    if (momentPoint && net && momentPlot.scales.y.max !== null) {
      put(momentPoint, timeLine.time, moment);
      const power = `${fixed(recorded, 1)} W`;
      byId("moment-reading").textContent = `${fixed(angle, 1)} ${unit}: net ${fixed(moment, 1)} ${net.unit}, ${power}${passive(net)}`;
      momentCursor.style.left = momentPoint.style.left;
    } else if (momentPoint && momentPlot.scales.y.max !== null) {
      put(momentPoint, angle, moment);
      if (recordedPoint) put(recordedPoint, angle, recorded);
      byId("moment-reading").textContent =
        `${fixed(angle, 1)} deg: ${fixed(moment, 2)} N m` +
        (recorded === null ? "" : `; whole joint in the run ${fixed(recorded, 2)} N m`);
    }
    if (timeCursor) timeCursor.style.left = `${timePlot.valToPos(timeLine.time, "x")}px`;
    strip?.move(timeLine.position(timeLine.time));
  }

  /** Passive moments at the present time, in words; not known at angles that no law was measured at. */
  function passive({ lower, upper }) {
    if (!lower) return "";
    const ends = [lower, upper].map((end) => between(floats(end), timeLine.position(timeLine.time)));
    return Number.isFinite(ends[0]) ? `; passive ${fixed(ends[0], 1)} to ${fixed(ends[1], 1)} N m` : "; passive not known at this angle";
  }

  function select(k) {
    selected = k;
    const row = motion.rows[k];
    byId("row").selectedIndex = k;
    showMoment(row);
    const chosen = byId("quantity").selectedIndex;
    byId("quantity").replaceChildren();
    const names = quantities(row).map(([label]) => label);
    for (const name of names) element("option", name, byId("quantity"));
    byId("quantity").selectedIndex = chosen === 0 || chosen >= names.length || chosen < 0 ? 0 : chosen;
    showOverTime();
    for (const fit of fits) fit(); // legends have changed the room of the plots
    stage.highlight(row.joint);
    movePoints();
  }

  /** The row of a joint, or of all, over which the motion goes furthest; one with measured curves if there is any. */
  function liveliest(joint = null) {
    const rank = (row) => {
      if (joint !== null && row.joint !== joint) return -1;
      const [low, high] = extremes(Array.from(floats(row.values)));
      if (row.net && !row.net.residual) {
        const [least, most] = extremes(Array.from(floats(row.net.moments)));
        return (row.net.lower ? 1e12 : 1e6) + (most - least);
      }
      const merit = row.curve ? (row.curve.published.some((one) => one.measured) ? 2 : 1) : 0;
      return 1e6 * merit + (row.curve ? high - low : 0);
    };
    const ranks = motion.rows.map(rank);
    return ranks.indexOf(Math.max(...ranks));
  }

  // Page

  /** Mark the button of the view; the first one is the free view. */
  function press(button) {
    for (const each of views) each.setAttribute("aria-pressed", String(each === button));
  }

  function look(button) {
    press(button);
    stage.view(button.dataset.view.split(" ").map(Number));
  }

  function setTheme(name) {
    document.documentElement.dataset.theme = name;
    byId("theme").textContent = name === "dark" ? "Light" : "Dark";
    stage.recolour();
    strip?.redraw();
    if (timePlot) select(selected);
  }

  function fill() {
    byId("title").textContent = motion.title;
    byId("outcome").textContent = motion.outcome;
    byId("outcome").classList.toggle("failed", !motion.succeeded);
    for (const [name, value] of motion.facts) {
      element("dt", name, byId("facts"));
      element("dd", value, byId("facts"));
    }
    for (const loss of motion.losses) element("li", loss, byId("losses"));
    let group = null;
    for (const row of motion.rows) {
      if (!group || group.label !== row.joint) {
        group = document.createElement("optgroup");
        group.label = row.joint;
        byId("row").append(group);
      }
      element("option", row.label, group);
    }
  }

  function listen() {
    byId("row").addEventListener("change", () => select(byId("row").selectedIndex));
    byId("quantity").addEventListener("change", () => {
      showOverTime();
      movePoints();
    });
    for (const button of views) button.addEventListener("click", () => look(button));
    byId("follow").addEventListener("change", () => timeLine.seek(timeLine.time));
    byId("forces").addEventListener("change", () => stage.showForces());
    byId("about").addEventListener("toggle", () => {
      if (byId("about").open) byId("about").scrollIntoView();
    });
    byId("theme").addEventListener("click", () =>
      setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
    fits = [fitPlot(byId("moment-plot"), () => momentPlot, movePoints), fitPlot(byId("time-plot"), () => timePlot, movePoints)];
  }

  async function open() {
    const dark = window.matchMedia("(prefers-color-scheme: dark)");
    setTheme(dark.matches ? "dark" : "light");
    dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
    fill();
    strip = mover.forceStrip(motion, times, timeLine);
    listen();
    try {
      await loadBody();
    } catch (failure) {
      notice(`The body could not be drawn: ${failure.message}`);
      throw failure;
    }
    look(views[0]);
    select(liveliest());
    timeLine.seek(timeLine.start);
  }

  /**
   * Handle for scripts and tests: `ready` is a promise; times are in s; `pose` is the column-major matrix in
   * the world of a node of the body (`SEGMENT.SITE` for a site); `point` is the angle [deg] and the moments of
   * the law and of the run [N m] on the selected row; `props` has name and shape of each prop, `forces` the parts
   * whose arrows are seen. Of inverse dynamics `point` is the angle, the net moment and its power [W].
   */
  window.page = {
    motion,
    times,
    seek: timeLine.seek,
    play: timeLine.play,
    pause: timeLine.pause,
    select,
    point,
    pose: (segment) => stage.pose(segment),
    triangles: () => stage.triangles(),
    props: () => stage.props(),
    forces: () => stage.forces(),
    get time() { return timeLine.time; },
    get frame() { return timeLine.nearestFrame(); },
    get playing() { return timeLine.playing; },
    ready: open(),
  };
})();
