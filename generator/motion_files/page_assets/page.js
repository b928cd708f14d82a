// The page of a motion: the body in three dimensions, its curves, and the time that moves both.
// Text of the file is inserted as text only, never as markup. Other scripts may use `window.page`.
"use strict";
(() => {
  const byId = (id) => document.getElementById(id);
  const motion = JSON.parse(byId("motion").textContent);

  function bytesOf(text) {
    const letters = atob(text);
    const bytes = new Uint8Array(letters.length);
    for (let k = 0; k < bytes.length; k++) bytes[k] = letters.charCodeAt(k);
    return bytes;
  }
  const floats = (text) => new Float32Array(bytesOf(text).buffer);
  const doubles = (text) => new Float64Array(bytesOf(text).buffer);
  const withGaps = (values) => Array.from(values, (value) => (Number.isFinite(value) ? value : null));
  const extremes = (values) =>
    values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  const fixed = (value, digits) => (Math.abs(value) < 0.5 * 10 ** -digits ? 0 : value).toFixed(digits);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const series = (k) => colour(`--series-${1 + (k % 8)}`);

  function element(tag, text, parent) {
    const made = document.createElement(tag);
    made.textContent = text;
    parent.append(made);
    return made;
  }

  // Time

  const times = doubles(motion.times);
  const start = times[0];
  const stop = times[times.length - 1];
  let time = start;
  let playing = false;
  let lastTick = null;

  /** Frame at or before a time, and the fraction of the way to the next one. */
  function position(at) {
    let low = 0;
    let high = times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= at) low = middle;
      else high = middle - 1;
    }
    const next = Math.min(low + 1, times.length - 1);
    const gap = times[next] - times[low];
    return [low, next, gap > 0 ? clamp((at - times[low]) / gap, 0, 1) : 0];
  }

  const between = (values, [low, next, part]) => values[low] + part * (values[next] - values[low]);

  function nearestFrame() {
    const [low, next, part] = position(time);
    return part > 0.5 ? next : low;
  }

  function seek(to) {
    if (Number.isNaN(to)) return;
    time = clamp(to, start, stop);
    byId("time").value = time;
    const frame = nearestFrame();
    const digits = stop - start < 0.1 ? 5 : 3;
    byId("reading").textContent =
      `${time.toFixed(digits)} s of ${stop.toFixed(digits)} s, frame ${frame + 1} of ${times.length}`;
    body.move(position(time));
    movePoints();
  }

  function step(frames) {
    pause();
    seek(times[clamp(nearestFrame() + frames, 0, times.length - 1)]);
  }

  function play() {
    if (time >= stop) seek(start);
    playing = true;
    lastTick = null;
    byId("play").classList.add("playing");
    byId("play").setAttribute("aria-label", "Pause");
    requestAnimationFrame(tick);
  }

  function pause() {
    playing = false;
    byId("play").classList.remove("playing");
    byId("play").setAttribute("aria-label", "Play");
  }

  function tick(now) {
    if (!playing) return;
    const elapsed = lastTick === null ? 0 : (Number(byId("speed").value) * (now - lastTick)) / 1000;
    lastTick = now;
    let to = time + elapsed;
    if (to >= stop && byId("loop").checked && stop > start) to = start + ((to - start) % (stop - start));
    seek(to);
    if (time >= stop && !byId("loop").checked) pause();
    else requestAnimationFrame(tick);
  }

  // Body

  const canvas = byId("body");
  const nothing = { move() {}, highlight() {}, recolour() {}, view() {}, pose: () => null, triangles: () => 0 };
  let body = nothing;

  function notice(text) {
    byId("notice").textContent = text;
    byId("notice").hidden = false;
    canvas.hidden = byId("camera").hidden = true;
  }

  async function loadBody() {
    if (!document.createElement("canvas").getContext("webgl2")) {
      notice("This browser has no WebGL 2 here, so the body is not drawn. The curves and the time are shown.");
      return;
    }
    const gltf = await new THREE.GLTFLoader().parseAsync(bytesOf(byId("glb").textContent).buffer, "");
    const channels = await animationChannels(gltf);
    body = makeBody(gltf.scene, channels, nodesOf(gltf));
  }

  /** Nodes by the names in the file; the loader's own names have no special characters. */
  function nodesOf(gltf) {
    const nodes = new Map();
    for (const [object, { nodes: index }] of gltf.parser.associations)
      if (index !== undefined) nodes.set(gltf.parser.json.nodes[index].name, object);
    return nodes;
  }

  async function animationChannels({ parser }) {
    const { channels, samplers } = parser.json.animations?.[0] ?? { channels: [], samplers: [] }; // a pose has none
    return Promise.all(
      channels.map(async ({ sampler, target }) => ({
        node: await parser.getDependency("node", target.node),
        path: target.path,
        values: (await parser.getDependency("accessor", samplers[sampler].output)).array,
      })),
    );
  }

  function makeBody(figure, channels, nodes) {
    const renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = THREE.PCFShadowMap;
    const scene = new THREE.Scene();
    const camera = new THREE.PerspectiveCamera(32, 1, 0.01, 1000);
    const controls = new THREE.OrbitControls(camera, canvas);
    const meshes = [];
    const [from, to] = [new THREE.Quaternion(), new THREE.Quaternion()];
    scene.add(figure);
    figure.traverse((object) => {
      if (!object.isMesh) return;
      object.material = object.material.clone(); // to highlight one segment only
      object.userData.joint ??= object.parent.userData.joint; // a mesh stands within its bone
      object.userData.colour = object.material.color.clone();
      object.castShadow = object.receiveShadow = true;
      object.geometry.computeBoundingBox();
      meshes.push(object);
    });

    function move([low, next, part]) {
      for (const { node, path, values } of channels) {
        if (path === "rotation") {
          from.fromArray(values, 4 * low);
          to.fromArray(values, 4 * next);
          node.quaternion.slerpQuaternions(from, to, part);
        } else {
          const at = (k) => between(values, [3 * low + k, 3 * next + k, part]);
          node.position.set(at(0), at(1), at(2));
        }
      }
      figure.updateMatrixWorld();
      if (byId("follow").checked) shift(centre());
      draw();
    }

    const box = new THREE.Box3();
    const grow = (bounds) => {
      for (const mesh of meshes) bounds.union(box.copy(mesh.geometry.boundingBox).applyMatrix4(mesh.matrixWorld));
      return bounds;
    };
    const centre = () => grow(new THREE.Box3()).getCenter(new THREE.Vector3());

    function shift(target) {
      camera.position.add(target).sub(controls.target);
      controls.target.copy(target);
      aim(target);
    }

    // The body over the whole motion, from some of its frames: boxes, and the corners of the
    // segments' boxes, in the world and relative to the middle of the body.
    const whole = new THREE.Box3();
    const first = new THREE.Box3();
    const places = [];
    const corners = [];
    const cornersOf = ({ geometry: { boundingBox: { min, max } }, matrixWorld }) =>
      Array.from({ length: 8 }, (_, k) =>
        new THREE.Vector3((k & 1 ? min : max).x, (k & 2 ? min : max).y, (k & 4 ? min : max).z).applyMatrix4(matrixWorld));
    const count = Math.min(times.length, 80);
    for (let k = count - 1; k >= 0; k--) {
      const frame = Math.round((k * (times.length - 1)) / Math.max(count - 1, 1));
      for (const { node, path, values } of channels)
        node[path === "rotation" ? "quaternion" : "position"].fromArray(values, (path === "rotation" ? 4 : 3) * frame);
      figure.updateMatrixWorld();
      grow(whole);
      const middle = centre();
      for (const corner of meshes.flatMap(cornersOf)) {
        places.push(corner);
        corners.push(corner.clone().sub(middle));
      }
      if (k === 0) grow(first);
    }
    const size = Math.max(first.getSize(new THREE.Vector3()).length(), 1e-3);
    const isFar = whole.getSize(new THREE.Vector3()).length() > 4 * size;
    byId("follow").checked = isFar;
    const framed = isFar ? first : whole;

    // Light from above the left shoulder, with a shadow that covers what is framed.
    const radius = framed.getSize(new THREE.Vector3()).length();
    const sun = new THREE.DirectionalLight(0xffffff, 2.2);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    Object.assign(sun.shadow.camera, {
      left: -radius, right: radius, top: radius, bottom: -radius, near: 0.1 * radius, far: 8 * radius,
    });
    sun.shadow.normalBias = 0.01 * size;
    sun.shadow.bias = -0.0005;
    const sky = new THREE.HemisphereLight(0xffffff, 0x8a8378, 1.6);
    scene.add(sun, sun.target, sky);
    function aim(target) {
      sun.target.position.copy(target);
      sun.position.copy(target).addScaledVector(new THREE.Vector3(0.45, 1, 0.55), 3 * radius);
    }

    // The plane y = 0: a grid, and the shadow on it.
    const cell = 10 ** Math.round(Math.log10(size / 2));
    const reach = Math.max(Math.abs(whole.min.x), whole.max.x, Math.abs(whole.min.z), whole.max.z) + 1.5 * size;
    const cells = 2 * Math.min(Math.ceil(reach / cell), 60);
    const ground = new THREE.Group();
    const plane = new THREE.Mesh(new THREE.PlaneGeometry(cells * cell, cells * cell), new THREE.ShadowMaterial({ opacity: 0.22 }));
    plane.rotation.x = -Math.PI / 2;
    plane.position.y = -0.002 * size;
    plane.receiveShadow = true;
    scene.add(ground, plane);
    byId("scale").textContent = `Grid: ${cell >= 1 ? `${cell} m` : `${Number((100 * cell).toPrecision(1))} cm`}, at y = 0`;

    function recolour() {
      scene.background = new THREE.Color(colour("--stage"));
      for (const old of ground.children) old.dispose();
      ground.clear();
      const strong = new THREE.Color(colour("--grid"));
      const fine = new THREE.Color(colour("--fine-grid"));
      if (cells <= 24) ground.add(new THREE.GridHelper(cells * cell, 5 * cells, fine, fine));
      ground.add(new THREE.GridHelper(cells * cell, cells, strong, strong));
      ground.children.forEach((grid, k) => (grid.position.y = -0.001 * size * (2 - k)));
      draw();
    }

    /** Frame the body from a direction: all corners of its segments' boxes are inside the picture. */
    function view(direction) {
      const back = new THREE.Vector3(...direction).normalize();
      const right = new THREE.Vector3(0, 1, 0).cross(back).normalize();
      const up = back.clone().cross(right);
      const tangent = Math.tan((camera.fov * Math.PI) / 360);
      const isFollowing = byId("follow").checked;
      const middle = isFollowing ? new THREE.Vector3() : whole.getCenter(new THREE.Vector3());
      const points = isFollowing ? corners : places;
      for (const along of isFollowing ? [] : [right, up]) {
        const [low, high] = extremes(points.map((point) => point.dot(along)));
        middle.addScaledVector(along, (low + high) / 2 - middle.dot(along));
      }
      let distance = 1e-3;
      for (const point of points) {
        const seen = point.clone().sub(middle);
        const across = Math.max(Math.abs(seen.dot(up)), Math.abs(seen.dot(right)) / camera.aspect);
        distance = Math.max(distance, seen.dot(back) + (1.12 * across) / tangent);
      }
      if (isFollowing) middle.copy(centre());
      controls.target.copy(middle);
      camera.position.copy(middle).addScaledVector(back, distance);
      camera.near = distance / 100;
      camera.far = distance * 100;
      camera.updateProjectionMatrix();
      aim(middle);
      controls.update();
      draw();
    }

    let waiting = false;
    function draw() {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        renderer.render(scene, camera);
      });
    }

    function highlight(joint) {
      for (const mesh of meshes) {
        mesh.material.color.copy(mesh.userData.colour);
        if (mesh.userData.joint === joint) mesh.material.color.lerp(new THREE.Color(colour("--series-1")), 0.75);
      }
      draw();
    }

    function resize() {
      const { clientWidth: width, clientHeight: height } = byId("stage");
      if (!width || !height) return;
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
      draw();
    }

    // A click, which is not a drag, selects the joint that carries a segment.
    let down = null;
    canvas.addEventListener("pointerdown", (event) => (down = [event.clientX, event.clientY]));
    canvas.addEventListener("pointerup", (event) => {
      if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
      const area = canvas.getBoundingClientRect();
      const place = new THREE.Vector2(
        (2 * (event.clientX - area.left)) / area.width - 1,
        1 - (2 * (event.clientY - area.top)) / area.height,
      );
      const ray = new THREE.Raycaster();
      ray.setFromCamera(place, camera);
      const [hit] = ray.intersectObjects(meshes, false);
      const joint = hit?.object.userData.joint;
      if (joint !== motion.rows[selected].joint && motion.rows.some((row) => row.joint === joint)) select(liveliest(joint));
    });

    controls.addEventListener("change", draw);
    new ResizeObserver(resize).observe(byId("stage"));
    resize();
    recolour();
    view(byId("view").value.split(" ").map(Number));
    const pose = (name) => (nodes.has(name) ? nodes.get(name).matrixWorld.toArray() : null);
    return { move, highlight, recolour, view, pose, triangles: () => renderer.info.render.triangles };
  }

  // Plots

  let selected = 0;
  let momentPlot = null;
  let timePlot = null;
  let momentPoint = null;
  let recordedPoint = null;
  let timeCursor = null;

  const axis = (label, size = 46) => ({
    label,
    labelSize: 18,
    labelGap: 0,
    size,
    gap: 4,
    stroke: () => colour("--soft"),
    grid: { stroke: () => colour("--line"), width: 1 },
    ticks: { stroke: () => colour("--line"), width: 1, size: 4 },
    font: "12px system-ui, sans-serif",
    labelFont: "12px system-ui, sans-serif",
  });

  function makePlot(host, options, data) {
    host.replaceChildren();
    const plot = new uPlot(
      {
        width: Math.max(host.clientWidth, 100),
        height: Math.max(host.clientHeight, 80),
        legend: { show: false },
        cursor: { show: false },
        padding: [8, 10, 0, 0],
        ...options,
      },
      data,
      host,
    );
    plot.over.style.overflow = "hidden";
    return plot;
  }

  function marker(plot, className) {
    const made = document.createElement("div");
    made.className = className;
    plot.over.append(made);
    return made;
  }

  function legendEntry(list, paint, text, kind = "") {
    const swatch = document.createElement("i");
    swatch.style.background = paint;
    swatch.style.setProperty("--swatch", paint);
    swatch.className = kind;
    element("li", text, list).prepend(swatch);
  }

  function showMoment(row) {
    momentPlot?.destroy();
    momentPlot = momentPoint = recordedPoint = null;
    byId("moment-legend").replaceChildren();
    byId("moment").hidden = !row.curve;
    byId("no-moment").hidden = Boolean(row.curve);
    if (!row.curve) {
      byId("no-moment").textContent = motion.no_curve;
      return;
    }
    const { angles, law, published, limits, held } = row.curve;
    const data = [Array.from(floats(angles)), withGaps(floats(law))];
    const lines = [{}, { stroke: () => colour("--ink"), width: 2.5, points: { show: false } }];
    const bands = [];
    published.forEach((one, k) => {
      data.push(withGaps(floats(one.values)));
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
      },
      data,
    );
    momentPoint = marker(momentPlot, "point");
    if (row.recorded) recordedPoint = marker(momentPlot, "point recorded");
    const legend = byId("moment-legend");
    legendEntry(legend, colour("--ink"), `this figure${held ? `, ${held}` : ""}`);
    legendEntry(legend, colour("--accent"), "at this time", "disc");
    if (row.recorded) legendEntry(legend, colour("--accent"), "whole joint in the run, with damping", "ring");
    published.forEach((one, k) => legendEntry(legend, series(k), one.label, one.measured ? "" : "model"));
    const sources = byId("sources").querySelector("ul");
    sources.replaceChildren();
    element("li", "Bands are the published scatter; dashed curves cannot be compared with joints.", sources);
    element("li", `this figure: ${motion.springs}; ${row.curve.source}`, sources);
    for (const one of published) element("li", `${one.label}: ${one.text}`, sources);
  }

  function quantities(row) {
    const found = [[`${row.label} [${row.unit}]`, [[row.label, floats(row.values)]]]];
    if (row.recorded) found.push([`${row.label}: moment of the run [N m]`, [[row.label, floats(row.recorded)]]]);
    if (motion.energy.length)
      found.push(["Energy of the figure [J]", motion.energy.map((one) => [one.name, floats(one.values)])]);
    return found;
  }

  function showOverTime() {
    const [label, lines] = quantities(motion.rows[selected])[byId("quantity").selectedIndex];
    timePlot?.destroy();
    byId("time-legend").replaceChildren();
    timePlot = makePlot(
      byId("time-plot"),
      {
        scales: { x: { time: false } },
        axes: [axis("Time [s]", 28), axis(label.slice(label.lastIndexOf("[")))],
        series: [{}, ...lines.map((_, k) => ({ stroke: () => series(k), width: 1.5, points: { show: false } }))],
      },
      [Array.from(times), ...lines.map(([, values]) => withGaps(values))],
    );
    timeCursor = marker(timePlot, "cursor");
    if (lines.length > 1) lines.forEach(([name], k) => legendEntry(byId("time-legend"), series(k), name));
    const scrub = (event) => seek(timePlot.posToVal(event.clientX - timePlot.over.getBoundingClientRect().left, "x"));
    timePlot.over.addEventListener("pointerdown", (event) => {
      pause();
      timePlot.over.setPointerCapture(event.pointerId);
      scrub(event);
    });
    timePlot.over.addEventListener("pointermove", (event) => event.buttons && scrub(event));
  }

  /** Angle [deg], moment of the law and moment of the run [N m] at the present time. */
  function point() {
    const row = motion.rows[selected];
    const at = position(time);
    const value = (text) => (text ? between(floatsOf(text), at) : null);
    return [value(row.values), value(row.curve?.moments), value(row.recorded)];
  }

  const decoded = new Map();
  function floatsOf(text) {
    if (!decoded.has(text)) decoded.set(text, floats(text));
    return decoded.get(text);
  }

  function put(mark, angle, moment) {
    const { min, max } = momentPlot.scales.y;
    mark.classList.toggle("beyond", moment < min || moment > max);
    mark.style.left = `${momentPlot.valToPos(angle, "x")}px`;
    mark.style.top = `${momentPlot.valToPos(clamp(moment, min, max), "y")}px`;
  }

  function movePoints() {
    const [angle, moment, recorded] = point();
    if (momentPlot) {
      put(momentPoint, angle, moment);
      if (recordedPoint) put(recordedPoint, angle, recorded);
      byId("moment-reading").textContent =
        `${fixed(angle, 1)} deg: ${fixed(moment, 2)} N m` +
        (recorded === null ? "" : `; whole joint in the run ${fixed(recorded, 2)} N m`);
    }
    if (timePlot) timeCursor.style.left = `${timePlot.valToPos(time, "x")}px`;
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
    body.highlight(row.joint);
    movePoints();
  }

  /** The row of a joint, or of all, over which the motion goes furthest; one with measured curves if there is any. */
  function liveliest(joint = null) {
    const rank = (row) => {
      if (joint !== null && row.joint !== joint) return -1;
      const [low, high] = extremes(Array.from(floatsOf(row.values)));
      const merit = row.curve ? (row.curve.published.some((one) => one.measured) ? 2 : 1) : 0;
      return 1e6 * merit + (row.curve ? high - low : 0);
    };
    const ranks = motion.rows.map(rank);
    return ranks.indexOf(Math.max(...ranks));
  }

  // Page

  function setTheme(name) {
    document.documentElement.dataset.theme = name;
    byId("theme").textContent = name === "dark" ? "Light" : "Dark";
    body.recolour();
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
    Object.assign(byId("time"), { min: start, max: stop });
  }

  function listen() {
    byId("transport").addEventListener("submit", (event) => event.preventDefault());
    byId("play").addEventListener("click", () => (playing ? pause() : play()));
    byId("first").addEventListener("click", () => step(-times.length));
    byId("back").addEventListener("click", () => step(-1));
    byId("forward").addEventListener("click", () => step(1));
    byId("time").addEventListener("input", () => {
      pause();
      seek(Number(byId("time").value));
    });
    byId("row").addEventListener("change", () => select(byId("row").selectedIndex));
    byId("quantity").addEventListener("change", () => {
      showOverTime();
      movePoints();
    });
    byId("view").addEventListener("change", () => body.view(byId("view").value.split(" ").map(Number)));
    byId("follow").addEventListener("change", () => seek(time));
    byId("theme").addEventListener("click", () =>
      setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
    document.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      const { tagName } = event.target;
      const many = event.shiftKey ? 10 : 1;
      const actions = {
        " ": () => (playing ? pause() : play()),
        ArrowLeft: () => step(-many),
        ArrowRight: () => step(many),
        Home: () => step(-times.length),
        End: () => step(times.length),
      };
      const isOwn = tagName === "SELECT" || (event.key === " " && /^(BUTTON|SUMMARY)$/.test(tagName)) ||
        (event.key === " " && event.target.type === "checkbox");
      if (isOwn || !actions[event.key]) return;
      event.preventDefault();
      actions[event.key]();
    });
    const observer = new ResizeObserver(() => {
      for (const [plot, host] of [[momentPlot, byId("moment-plot")], [timePlot, byId("time-plot")]])
        if (plot && host.clientWidth) plot.setSize({ width: host.clientWidth, height: Math.max(host.clientHeight, 80) });
      movePoints();
    });
    observer.observe(byId("moment-plot"));
    observer.observe(byId("time-plot"));
  }

  async function open() {
    const dark = window.matchMedia("(prefers-color-scheme: dark)");
    setTheme(dark.matches ? "dark" : "light");
    dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
    fill();
    listen();
    try {
      await loadBody();
    } catch (failure) {
      notice(`The body could not be drawn: ${failure.message}`);
      throw failure;
    }
    select(liveliest());
    seek(start);
  }

  /**
   * Handle for scripts and tests: `ready` is a promise; times are in s; `pose` is the column-major matrix in
   * the world of a node of the body (`SEGMENT.SITE` for a site); `point` is the angle [deg] and the moments of
   * the law and of the run [N m] on the selected row.
   */
  window.page = {
    motion,
    times,
    seek,
    play,
    pause,
    select,
    point,
    pose: (segment) => body.pose(segment),
    triangles: () => body.triangles(),
    get time() { return time; },
    get frame() { return nearestFrame(); },
    get playing() { return playing; },
    ready: open(),
  };
})();
