// The time of a page: its controls and keys, playback, and the frames around a time.
"use strict";
(() => {
  const { byId, clamp } = mover;

  /**
   * The time line of frames at increasing times [s]. It calls `show` with the position of each time: the frame
   * before, the frame after, and the fraction of the way.
   */
  mover.timeLine = (times, show) => {
    const start = times[0];
    const stop = times[times.length - 1];
    let time = start;
    let playing = false;
    let lastTick = null;

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
      show(position(time));
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

    const toggle = () => (playing ? pause() : play());

    byId("transport").addEventListener("submit", (event) => event.preventDefault());
    byId("play").addEventListener("click", toggle);
    byId("first").addEventListener("click", () => step(-times.length));
    byId("back").addEventListener("click", () => step(-1));
    byId("forward").addEventListener("click", () => step(1));
    byId("time").addEventListener("input", () => {
      pause();
      seek(Number(byId("time").value));
    });
    Object.assign(byId("time"), { min: start, max: stop });
    document.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      const { tagName } = event.target;
      const many = event.shiftKey ? 10 : 1;
      const actions = {
        " ": toggle,
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

    return {
      start, stop, position, nearestFrame, seek, step, play, pause,
      get time() { return time; },
      get playing() { return playing; },
    };
  };
})();
