// Charts of a page, drawn by uPlot, which is loaded before: axes, legends, and marks that move with the time.
"use strict";
(() => {
  const { colour, element } = mover;

  const MIN_HEIGHT = 40;

  mover.axis = (label, size = 46) => ({
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

  mover.makePlot = (host, options, data) => {
    host.replaceChildren();
    const plot = new uPlot(
      {
        width: Math.max(host.clientWidth, 100),
        height: Math.max(host.clientHeight, MIN_HEIGHT),
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
  };

  /** Keep a plot as large as its host; `plot` returns the present one or null. Return how to do it at once. */
  mover.fitPlot = (host, plot, resized) => {
    function fit() {
      if (plot() && host.clientWidth) {
        plot().setSize({ width: host.clientWidth, height: Math.max(host.clientHeight, MIN_HEIGHT) });
        resized();
      }
    }
    new ResizeObserver(fit).observe(host);
    return fit;
  };

  mover.marker = (plot, className) => {
    const made = document.createElement("div");
    made.className = className;
    plot.over.append(made);
    return made;
  };

  mover.legendEntry = (list, paint, text, kind = "") => {
    const swatch = document.createElement("i");
    swatch.style.background = paint;
    swatch.style.setProperty("--swatch", paint);
    swatch.className = kind;
    element("li", text, list).prepend(swatch);
  };

  /** Set the time by clicks and drags on a plot over time. */
  mover.scrub = (plot, timeLine) => {
    const seek = (event) =>
      timeLine.seek(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
    plot.over.addEventListener("pointerdown", (event) => {
      timeLine.pause();
      plot.over.setPointerCapture(event.pointerId);
      seek(event);
    });
    plot.over.addEventListener("pointermove", (event) => event.buttons && seek(event));
  };
})();
