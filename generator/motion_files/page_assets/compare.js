// The page of a comparison: bodies over one another, curves over one another, and what differs most.
// Text of the file is inserted as text only, never as markup. Other scripts may use `window.page`.
"use strict";
(() => {
  const {
    axis, between, byId, bytesOf, colour, doubles, element, fitPlot, fixed, floats, legendEntry, makePlot, marker,
    scrub, series, withGaps,
  } = mover;
  const comparison = JSON.parse(byId("comparison").textContent);
  const { motions, columns } = comparison;
  const times = doubles(comparison.times);
  const timeLine = mover.timeLine(times, (position) => {
    stage.move(position);
    showValues(position);
  });

  // Bodies

  const canvas = byId("body");
  const views = [...byId("views").children];
  const nothing = { move() {}, recolour() {}, show() {}, place() {}, view() {}, showForces() {}, pose: () => null, props: () => [], triangles: () => 0, forces: () => [], forceColour: () => null };
  const forces = motions.map((motion) => motion.forces.map((row) => mover.forcesOf(row, times.length)));
  let stage = nothing;

  function notice(text) {
    byId("notice").textContent = text;
    byId("notice").hidden = false;
    canvas.hidden = byId("camera").hidden = true;
  }

  async function loadBodies() {
    if (!mover.canDraw()) {
      notice("This browser has no WebGL 2 here, so the bodies are not drawn. The curves and the time are shown.");
      return;
    }
    const read = await Promise.all(motions.map(({ glb }) => mover.readBody(bytesOf(glb), times.length)));
    stage = makeStage(read.map(({ body }) => body), read.flatMap(({ props }) => props));
  }

  function makeStage(bodies, props) {
    const made = mover.stage(canvas, byId("stage"));
    const size = Math.max(...bodies.map((body) => body.size));
    const whole = bodies.reduce((box, body) => box.union(body.whole), new THREE.Box3());
    const start = bodies.reduce((box, body) => box.union(body.first), new THREE.Box3());
    const surroundings = mover.addSurroundings(made, props, { size, whole });
    const isFar = bodies.some((body) => body.isFar);
    const follow = byId("follow");
    follow.checked = isFar;
    // A shade of the body's colour, which is seen before the body.
    const shade = (k) => new THREE.Color(series(k)).lerp(new THREE.Color(colour("--ink")), 0.4);
    const arrows = bodies.map((body, k) => mover.addArrows(made, forces[k], comparison.arrows, size, () => shade(k)));
    const areTouched = forces.some((parts) => parts.length);
    byId("forces-choice").hidden = !areTouched;
    bodies.forEach((body, k) => {
      for (const { material } of body.meshes) {
        material.transparent = k > 0;
        // Where bodies coincide the first one is in front, without flicker.
        Object.assign(material, { polygonOffset: true, polygonOffsetFactor: k, polygonOffsetUnits: k });
      }
      made.add(body.figure, () => {
        for (const { material } of body.meshes) material.color.set(series(k));
      });
      body.figure.add(arrows[k].group); // hidden and put apart with its body
    });
    made.light(isFar ? start : whole, size);
    place();

    /** Put the bodies in their places in the world, where all but the first are translucent, or side by side. */
    function place() {
      const isApart = byId("apart").checked;
      const gap = isApart ? 1.1 * (whole.max.x - whole.min.x) : 0;
      bodies.forEach((body, k) => {
        body.figure.position.x = gap * (k - (bodies.length - 1) / 2);
        for (const { material } of body.meshes) material.opacity = k === 0 || isApart ? 1 : 0.7;
      });
    }

    function move(position) {
      bodies.forEach((body, k) => {
        body.move(position);
        arrows[k].move(position);
      });
      if (follow.checked) made.shift(middle());
      made.draw();
    }

    const middle = () =>
      bodies.reduce((sum, body) => sum.add(body.centre()), new THREE.Vector3()).divideScalar(bodies.length);

    /** Frame all bodies from a direction, over the whole motion or as they are followed. */
    function view(direction) {
      const shifted = (points, body) => points.map((point) => point.clone().add(body.figure.position));
      if (follow.checked) {
        const points = bodies.flatMap((body) => shifted(body.corners, body));
        made.frame(direction, points, middle());
      } else {
        const points = bodies.flatMap((body) => shifted(body.places, body));
        made.frame(direction, [...points, ...surroundings.corners]);
      }
    }

    function showForces() {
      const areShown = areTouched && byId("forces").checked;
      for (const each of arrows) each.show(areShown);
      byId("scale").textContent = [surroundings.text, ...(areShown ? [comparison.arrows.text] : [])].join(". ");
      made.draw();
    }

    function show(k, isShown) {
      bodies[k].figure.visible = isShown;
      made.draw();
    }

    made.controls.addEventListener("start", () => press(views[0]));
    made.recolour();
    showForces();
    return {
      move, view, show, place, showForces, forces: (k) => arrows[k].visible(), forceColour: (k) => arrows[k].colour(), recolour: made.recolour, triangles: made.triangles,
      pose: (k, name) => bodies[k].pose(name),
      props: () => props.map(({ name, userData }) => [name, userData.prop]),
    };
  }

  function press(pressed) {
    for (const button of views) button.setAttribute("aria-pressed", String(button === pressed));
  }

  function look(button) {
    press(button);
    stage.view(button.dataset.view.split(" ").map(Number));
  }

  // Curves

  let selected = 0;
  let plot = null;
  let cursor = null;
  let marks = [];

  function select(k) {
    selected = k;
    byId("column").selectedIndex = k;
    const { unit, values } = columns[k];
    const known = values.flatMap((text, index) => (text ? [index] : []));
    plot?.destroy();
    plot = makePlot(
      byId("time-plot"),
      {
        scales: { x: { time: false } },
        axes: [axis("Time [s]", 28), axis(`[${unit}]`)],
        series: [{}, ...known.map((index) => ({ stroke: () => series(index), width: 2, points: { show: false } }))],
      },
      [Array.from(times), ...known.map((index) => withGaps(floats(values[index])))],
    );
    marks = comparison.tables.map(({ divergence }, k) => {
      const mark = marker(plot, "divergence");
      mark.hidden = !divergence;
      mark.style.borderColor = series(k + 1);
      return mark;
    });
    cursor = marker(plot, "cursor");
    scrub(plot, timeLine);
    queueMicrotask(() => showValues(timeLine.position(timeLine.time))); // when the plot has its scales
  }

  /** Value of the selected column of each motion at a position of the time; null where it has none. */
  const valuesAt = (position) => columns[selected].values.map((text) => (text ? between(floats(text), position) : null));

  function showValues(position) {
    if (!plot) return;
    cursor.style.left = `${plot.valToPos(timeLine.time, "x")}px`;
    comparison.tables.forEach(({ divergence }, k) => {
      if (divergence) marks[k].style.left = `${plot.valToPos(divergence.time, "x")}px`;
    });
    const legend = byId("time-legend");
    legend.replaceChildren();
    valuesAt(position).forEach((value, k) => {
      const text = value === null || Number.isNaN(value) ? "-" : `${fixed(value, 2)} ${columns[selected].unit}`;
      legendEntry(legend, series(k), `${motions[k].name} ${text}`);
    });
  }

  // Differences

  function addTable({ head, rows }, host) {
    if (!rows.length) return;
    const table = element("table", "", host);
    const top = element("tr", "", element("thead", "", table));
    for (const title of head) element("th", title, top).scope = "col";
    const body = element("tbody", "", table);
    for (const { cells: [name, ...cells], column, time } of rows) {
      const row = element("tr", "", body);
      const heading = element("th", "", row);
      heading.scope = "row";
      const [first, ...rest] = name.split(" ");
      const button = element("button", first, heading);
      button.type = "button";
      if (rest.length) {
        button.append(" ");
        element("span", rest.join(" "), button); // stays on one line where it can
      }
      button.addEventListener("click", () => {
        const k = columns.findIndex((one) => one.name === column);
        if (k >= 0) select(k);
        timeLine.pause();
        if (time !== null) timeLine.seek(time);
        for (const old of document.querySelectorAll("tr.selected")) old.classList.remove("selected");
        row.classList.add("selected");
      });
      for (const cell of cells) element("td", cell, row);
    }
  }

  // Page

  function setTheme(name) {
    document.documentElement.dataset.theme = name;
    byId("theme").textContent = name === "dark" ? "Light" : "Dark";
    stage.recolour();
    for (const [k, swatch] of byId("bodies").querySelectorAll("i").entries()) swatch.style.background = series(k);
    if (plot) select(selected);
  }

  function fill() {
    byId("title").textContent = comparison.title;
    motions.forEach(({ name, facts }, k) => {
      const label = element("label", "", element("li", "", byId("bodies")));
      const box = element("input", "", label);
      Object.assign(box, { type: "checkbox", checked: true });
      box.addEventListener("change", () => stage.show(k, box.checked));
      label.append(" ");
      element("i", "", label);
      label.append(` ${name}`);
      for (const [title, value] of facts) {
        element("dt", `${name}: ${title.toLowerCase()}`, byId("facts"));
        element("dd", value, byId("facts"));
      }
    });
    let group = null;
    for (const { label, group: title, unit } of columns) {
      if (!group || group.label !== title) {
        group = document.createElement("optgroup");
        group.label = title;
        byId("column").append(group);
      }
      element("option", `${label} [${unit}]`, group);
    }
    for (const { text, parts } of comparison.tables) {
      element("h2", text, byId("tables"));
      for (const part of parts) addTable(part, byId("tables"));
    }
    motions.forEach(({ name, touches }, k) => {
      if (!touches.length) return;
      const lane = element("div", "", byId("lanes"));
      lane.className = "touches";
      lane.style.setProperty("--touch", `var(--series-${k + 1})`);
      lane.setAttribute("role", "group");
      lane.setAttribute("aria-label", `First touches of ${name}`);
      mover.touchLane(lane, touches, timeLine, `${name}, `);
    });
    byId("lanes").classList.toggle("low", byId("lanes").children.length > 2);
    for (const note of comparison.notes) element("li", note, byId("notes"));
  }

  function listen() {
    byId("column").addEventListener("change", () => select(byId("column").selectedIndex));
    for (const button of views) button.addEventListener("click", () => look(button));
    byId("follow").addEventListener("change", () => timeLine.seek(timeLine.time));
    byId("forces").addEventListener("change", () => stage.showForces());
    byId("apart").addEventListener("change", () => {
      stage.place();
      timeLine.seek(timeLine.time);
      look(views.find((button) => button.getAttribute("aria-pressed") === "true"));
    });
    byId("theme").addEventListener("click", () =>
      setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
    fitPlot(byId("time-plot"), () => plot, () => showValues(timeLine.position(timeLine.time)));
  }

  /** The column of the joint that diverges first, else of the first row of the tables. */
  function mostDifferent() {
    const divergences = comparison.tables.flatMap(({ divergence }) => divergence ?? []);
    const rows = comparison.tables.flatMap(({ parts }) => parts.flatMap((part) => part.rows));
    const [first] = [...divergences.sort((one, other) => one.time - other.time), ...rows.filter((row) => row.column)];
    return Math.max(0, columns.findIndex(({ name }) => name === first?.column));
  }

  async function open() {
    const dark = window.matchMedia("(prefers-color-scheme: dark)");
    fill();
    setTheme(dark.matches ? "dark" : "light");
    dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
    listen();
    try {
      await loadBodies();
    } catch (failure) {
      notice(`The bodies could not be drawn: ${failure.message}`);
      throw failure;
    }
    look(views[0]);
    select(mostDifferent());
    timeLine.seek(timeLine.start);
  }

  /**
   * Handle for scripts and tests: `ready` is a promise; times are in s; `pose(k, name)` is the column-major matrix
   * in the world of a node of body k; `values` are those of the selected column at the present time, `forces(k)` the names of
   * the parts of body k whose arrows are seen, in the colour `forceColour(k)`.
   */
  window.page = {
    comparison,
    times,
    seek: timeLine.seek,
    play: timeLine.play,
    pause: timeLine.pause,
    select: (name) => select(columns.findIndex((column) => column.name === name)),
    values: () => valuesAt(timeLine.position(timeLine.time)),
    pose: (k, name) => stage.pose(k, name),
    props: () => stage.props(),
    forces: (k) => stage.forces(k),
    forceColour: (k) => stage.forceColour(k),
    triangles: () => stage.triangles(),
    get column() { return columns[selected].name; },
    get time() { return timeLine.time; },
    get frame() { return timeLine.nearestFrame(); },
    get playing() { return timeLine.playing; },
    ready: open(),
  };
})();
