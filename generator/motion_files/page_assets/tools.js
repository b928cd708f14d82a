// Small functions of all scripts of a page; the scripts share the object `mover`.
"use strict";
const mover = {};
(() => {
  const byId = (id) => document.getElementById(id);

  function bytesOf(text) {
    const letters = atob(text);
    const bytes = new Uint8Array(letters.length);
    for (let k = 0; k < bytes.length; k++) bytes[k] = letters.charCodeAt(k);
    return bytes;
  }

  const decoded = new Map();
  /** Numbers of 32 bits in base64, decoded once. */
  function floats(text) {
    if (!decoded.has(text)) decoded.set(text, new Float32Array(bytesOf(text).buffer));
    return decoded.get(text);
  }
  const doubles = (text) => new Float64Array(bytesOf(text).buffer);

  const withGaps = (values) => Array.from(values, (value) => (Number.isFinite(value) ? value : null));
  const extremes = (values) =>
    values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  const fixed = (value, digits) => (Math.abs(value) < 0.5 * 10 ** -digits ? 0 : value).toFixed(digits);

  /** Value at a position of the time: frame before, frame after, and the fraction of the way. */
  const between = (values, [low, next, part]) => values[low] + part * (values[next] - values[low]);

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const series = (k) => colour(`--series-${1 + (k % 8)}`);

  function element(tag, text, parent) {
    const made = document.createElement(tag);
    made.textContent = text;
    parent.append(made);
    return made;
  }

  Object.assign(mover, {
    byId, bytesOf, floats, doubles, withGaps, extremes, clamp, fixed, between, colour, series, element,
  });
})();
