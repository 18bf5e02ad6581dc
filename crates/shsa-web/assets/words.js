// Words, signs and numbers that all views share, and functions that make elements.

const SIGNS = {
  good: "✓", healthy: "✓", restored: "✓",
  substitute: "⇄", substituted: "⇄", ageing: "↗",
  uncertain: "?", suspect: "?", suspected: "?",
  old: "…",
  unserved: "✗", failed: "✗", unhealable: "✗", refused: "✗",
  silent: "○", absent: "○",
  frozen: "‖", "out of range": "✗", learning: "…",
  unknown: "·", outlier: "·", restarted: "·",
};

/** A verdict, quality or kind with its sign: colour is never the only difference. */
export function signed(word) {
  return SIGNS[word] ? `${SIGNS[word]} ${word}` : word;
}

/** The quality of a need, by its name on the bus. */
const QUALITIES = {
  Good: "good",
  UncertainSubstituteValue: "substitute",
  UncertainSubNormal: "uncertain",
  UncertainLastUsableValue: "old",
};

export function quality(name) {
  return QUALITIES[name] ?? "unserved";
}

/** An element with a class, a text and children. */
export function made(name, { className = "", text = null, children = [] } = {}) {
  const element = document.createElement(name);
  if (className) element.className = className;
  if (text !== null) element.textContent = text;
  element.append(...children);
  return element;
}

const SVG = "http://www.w3.org/2000/svg";

/** An element of a drawing with its attributes and children. */
export function drawn(name, attributes = {}, children = []) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** Sets a text only if it has changed: an unchanged one does not flicker. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** A number with the decimals that its width makes significant. */
export function number(value, width) {
  const size = width > 0 ? width : Math.abs(value) / 1000;
  const decimals = size > 0 ? Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(size)))) : 3;
  return value.toFixed(decimals);
}

/** Bounds with their unit, as a middle and its largest error. */
export function enclosed(lo, hi, unit) {
  if (lo == null || hi == null) return "–";
  const width = hi - lo;
  const shown = width > 0 ? `${number((lo + hi) / 2, width)} ± ${number(width / 2, width)}` : number(lo, 0);
  return unit ? `${shown} ${unit}` : shown;
}

/** The minimum and the maximum of several values, with their unit. */
export function spread(lo, hi, unit) {
  if (lo == null || hi == null) return "–";
  const shown = `${number(lo, hi - lo)} to ${number(hi, hi - lo)}`;
  return unit ? `${shown} ${unit}` : shown;
}

/** An age in words of constant width. */
export function age(now, then) {
  return then == null ? "never" : lasting(Math.max(0, (now - then) / 1e9));
}

/** A time in words of constant width. */
export function lasting(seconds) {
  if (seconds < 100) return `${seconds.toFixed(1)} s`;
  if (seconds < 6000) return `${Math.floor(seconds / 60)} min`;
  if (seconds < 360_000) return `${Math.floor(seconds / 3600)} h`;
  return `${Math.floor(seconds / 86_400)} days`;
}

/** A time in nanoseconds since 1970 as local time. */
export function clock(nanoseconds) {
  const date = new Date(nanoseconds / 1e6);
  return `${date.toLocaleTimeString("en-GB")}.${String(date.getMilliseconds()).padStart(3, "0")}`;
}

/** Makes a list show exactly these entries, in order. Elements are kept by their key; new ones are made. */
export function arrange(list, known, keys, make) {
  const wanted = new Set(keys);
  for (const [key, entry] of known) {
    if (wanted.has(key)) continue;
    entry.element.remove();
    known.delete(key);
  }
  keys.forEach((key, at) => {
    let entry = known.get(key);
    if (!entry) {
      entry = make(key);
      known.set(key, entry);
    }
    if (list.children[at] !== entry.element) list.insertBefore(entry.element, list.children[at] ?? null);
  });
}
