// Above the slider of the time: the total contact force as a small chart, and lanes with marks of first touches.
"use strict";
(() => {
  const { axis, between, byId, colour, element, fixed, fitPlot, floats, makePlot, marker, scrub, withGaps } = mover;

  const newtons = (force) => (force >= 1000 ? `${(force / 1000).toPrecision(3)} kN` : `${fixed(force, 0)} N`);
  const [ROW, GAP] = [16, 14]; // pixels of a row of words, and those below which touches have one mark
  const SIDES = /^(left|right) /;

  /** Names of touches in words; of both sides at once "both hands". */
  function inWords(names) {
    const words = new Map();
    for (const name of names) {
      const noun = name.replace(SIDES, "");
      words.set(noun, words.has(noun) && SIDES.test(name) ? `both ${noun === "foot" ? "feet" : `${noun}s`}` : name);
    }
    return [...words.values()].join(", ");
  }

  /** Touches that are nearer to the first of their group than a share of the duration, as groups. */
  function grouped(touches, gap) {
    const groups = [];
    for (const touch of touches) {
      const last = groups[groups.length - 1];
      if (last && touch.time - last[0].time <= gap) last.push(touch);
      else groups.push([touch]);
    }
    return groups;
  }

  const describe = ({ time, name, speed, force }) =>
    `${name}: ${fixed(time, 3)} s, at ${fixed(speed, 1)} m/s; at most ${newtons(force)}`;

  /**
   * Fill a lane with marks of touches: each a tick, with words beside it where neither words nor ticks of others are.
   * `owner` is what the words begin with for those who do not see the lane.
   */
  mover.touchLane = (lane, touches, timeLine, owner = "") => {
    const duration = timeLine.stop - timeLine.start;

    function place() {
      lane.replaceChildren();
      const width = lane.clientWidth;
      if (!width) return;
      const rows = Math.floor(lane.clientHeight / ROW);
      const taken = Array.from({ length: rows }, () => []);
      const isFree = (row, low, high) => taken[row].every(([from, to]) => high < from || to < low);

      /** Put words into the first row that has room for them, whole or only the first, right or left of their tick. */
      function findPlace(text, words, left) {
        const [first] = words.split(",");
        for (const shown of first === words ? [words] : [words, `${first}, ...`]) {
          text.textContent = shown;
          const size = text.offsetWidth + 6;
          for (const [low, high] of [[left - 2, left + size], [left - size, left + 2]]) {
            if (low < -20 || high > width + 12) continue;
            for (let row = 0; row < rows; row++) {
              const below = taken.map((_, k) => k).filter((k) => k > row);
              if (!isFree(row, low, high) || !below.every((k) => isFree(k, left - 2, left + 2))) continue;
              taken[row].push([low, high]);
              for (const k of below) taken[k].push([left - 2, left + 2]);
              return [row, low < left - 2];
            }
          }
        }
        return null;
      }

      for (const group of grouped(touches, (GAP / width) * duration)) {
        const left = (width * (group[0].time - timeLine.start)) / (duration || 1);
        const words = inWords(group.map(({ name }) => name));
        const button = element("button", "", lane);
        const text = element("span", "", button);
        button.type = "button";
        button.title = group.map((each) => describe(each)).join("\n");
        button.setAttribute("aria-label", `${owner}${words}: first touch at ${fixed(group[0].time, 3)} s`);
        const [row, isLeft] = findPlace(text, words, left) ?? [rows, false];
        if (row === rows) text.remove();
        button.classList.toggle("before", isLeft);
        button.style.left = `${left}px`;
        button.style.top = `${row * ROW}px`;
        button.addEventListener("click", () => {
          timeLine.pause();
          timeLine.seek(group[0].time);
        });
      }
    }

    place();
    new ResizeObserver(place).observe(lane);
  };

  /**
   * Fill the strip with the total force and the touches of a motion; both are hidden where there are none. Return
   * how to move the mark of the time, and how to draw the strip in another theme.
   */
  mover.forceStrip = ({ total_force: total, touches }, times, timeLine) => {
    const host = byId("force-plot");
    const values = total ? floats(total.values) : [];
    let plot = null;
    let cursor = null;
    let peak = null;

    function redraw() {
      if (!total) return;
      const largest = Math.max(total.peak, 1);
      // The axes are as wide as the margins of the slider, so that times are above each other.
      const left = parseFloat(getComputedStyle(byId("strip")).getPropertyValue("--strip-left")) * 16;
      const right = parseFloat(getComputedStyle(byId("strip")).getPropertyValue("--strip-right")) * 16;
      plot?.destroy();
      plot = makePlot(
        host,
        {
          padding: [6, right, 6, 0],
          scales: { x: { time: false, range: [timeLine.start, timeLine.stop] }, y: { range: [0, 1.2 * largest] } },
          axes: [
            { show: false },
            {
              ...axis(undefined, left),
              font: "11px system-ui, sans-serif",
              splits: [0, largest],
              values: (_, splits) => splits.map((split) => (split ? newtons(split) : "0")),
            },
          ],
          hooks: { draw: [mark] },
          series: [{}, { stroke: () => colour("--force"), fill: () => `${colour("--force")}33`, width: 1.5, points: { show: false } }],
        },
        [Array.from(times), withGaps(values)],
      );
      peak = marker(plot, "point peak");
      cursor = marker(plot, "cursor");
      scrub(plot, timeLine);
    }

    function mark() {
      if (!cursor) return;
      cursor.style.left = `${plot.valToPos(timeLine.time, "x")}px`;
      peak.style.left = `${plot.valToPos(total.peak_time, "x")}px`;
      peak.style.top = `${plot.valToPos(total.peak, "y")}px`;
    }

    byId("force").hidden = !total;
    byId("touches").hidden = byId("touch-list").hidden = !touches.length;
    if (total) {
      const words = `at most ${newtons(total.peak)} at ${fixed(total.peak_time, 3)} s`;
      host.setAttribute("aria-label", `Total ${total.noun} over time, ${words}`);
      host.title = `Total ${total.noun}, ${words}${total.note}`;
    }
    for (const touch of touches) element("li", describe(touch), byId("touch-list").querySelector("ol"));
    redraw();
    mover.touchLane(byId("touches"), touches, timeLine);
    fitPlot(host, () => plot, redraw);

    function move(position) {
      mark();
      if (total) byId("force-reading").textContent = `Total ${total.noun} ${newtons(between(values, position))}`;
    }
    return { move, redraw };
  };
})();
