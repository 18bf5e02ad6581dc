// Vectors as profiles: the elements of the latest one, small in a row or a card, and larger with its scale.

import { step } from "./bands.js";
import { drawn, enclosed, made, number, setText } from "./words.js";

/** The length of the past whose extremes make the scale, nanoseconds: a vector that collapses is drawn on the scale of those before it. */
const PAST = 60e9;
const SECOND = 1e9;
const SMALL = { width: 96, height: 24 };
const HEIGHT = 240;
const ROOM = { left: 64, right: 8, top: 24, bottom: 32 };

/** The range of the values of the last minute. */
export class Scale {
  constructor() {
    this.seconds = [];
  }

  keep({ bins }, now) {
    const known = bins.filter(Array.isArray);
    if (known.length === 0) return;
    const low = Math.min(...known.map(([lo]) => lo));
    const high = Math.max(...known.map(([, hi]) => hi));
    const last = this.seconds.at(-1);
    if (last && now - last.at < SECOND) Object.assign(last, { low: Math.min(last.low, low), high: Math.max(last.high, high) });
    else this.seconds.push({ at: now, low, high });
    while (now - this.seconds[0].at > PAST) this.seconds.shift();
  }

  /** The range with further values, and a margin. */
  range(further = []) {
    const low = Math.min(...this.seconds.map((it) => it.low), ...further);
    const high = Math.max(...this.seconds.map((it) => it.high), ...further);
    if (low > high) return { low: 0, high: 1 };
    const margin = (high - low) / 16 || Math.abs(high) / 100 || 1;
    return { low: low - margin, high: high + margin };
  }
}

/** Elements of a drawing that show a profile in a box; each bin is as wide as the elements in it. */
export class Drawing {
  constructor() {
    this.band = drawn("path", { class: "band" });
    this.line = drawn("path", { class: "line" });
    this.beyond = drawn("path", { class: "beyond" });
    this.elements = [this.band, this.line, this.beyond];
  }

  /** Draws a profile, or nothing; `x` gives the place of a share of the elements, `y` that of a value. */
  show(profile, x, y, top, bottom) {
    const { bins = [], count = 0 } = profile ?? {};
    const left = (at) => x(at / bins.length).toFixed(1);
    const level = (at, value) => `${left(at)} ${y(value).toFixed(1)}L${left(at + 1)} ${y(value).toFixed(1)}`;
    const back = (at, value) => `${left(at + 1)} ${y(value).toFixed(1)}L${left(at)} ${y(value).toFixed(1)}`;
    const pieces = [[]];
    bins.forEach((bin, at) => {
      if (Array.isArray(bin)) pieces.at(-1).push({ at, lo: bin[0], hi: bin[1] });
      else pieces.push([]);
    });
    const full = pieces.filter((piece) => piece.length > 0);
    const joined = (piece, of) => piece.map(of).join("L");
    const area = (piece) => `M${joined(piece, ({ at, hi }) => level(at, hi))}L${joined(piece.toReversed(), ({ at, lo }) => back(at, lo))}Z`;
    this.band.setAttribute("d", full.map(area).join(""));
    // The middle of many elements means nothing.
    const isWhole = count === bins.length;
    this.band.setAttribute("class", isWhole ? "band" : "band bins");
    this.line.setAttribute("d", isWhole ? full.map((piece) => `M${joined(piece, ({ at, lo, hi }) => level(at, (lo + hi) / 2))}`).join("") : "");
    const edge = (bin, at) => (bin === 1 || bin === -1 ? `M${left(at)} ${bin === 1 ? top : bottom}H${left(at + 1)}` : "");
    this.beyond.setAttribute("d", bins.map(edge).join(""));
  }
}

/** A small profile, for a row. */
export class Small {
  constructor() {
    this.drawing = new Drawing();
    this.element = drawn("svg", { class: "small", ...SMALL, viewBox: `0 0 ${SMALL.width} ${SMALL.height}`, "aria-hidden": "true" }, this.drawing.elements);
  }

  show(profile, scale) {
    const { low, high } = scale.range();
    // An unchanged drawing costs nothing.
    const shown = [profile, low, high];
    if (shown.every((it, at) => it === this.shown?.[at])) return;
    this.shown = shown;
    const { width, height } = SMALL;
    this.drawing.show(profile, (share) => share * width, (value) => height * (1 - (value - low) / (high - low)), 1, height - 1);
  }
}

/** What a profile holds, in words; elements are counted from 0, as in formulas. */
export function words({ count, known, beyond, min, max }, unit) {
  const missing = count - known - beyond;
  const parts = [[known, "with a value"], [beyond, "infinite"], [missing, "missing"]].filter(([many]) => many > 0);
  const said = parts.length > 1 ? `: ${parts.map(([many, what]) => `${many} ${what}`).join(", ")}` : ` ${parts[0][1]}`;
  const elements = `${count} ${count === 1 ? "element" : "elements"}${said}`;
  if (!min) return elements;
  const width = max[0] - min[0];
  const shown = (value) => [width > 0 ? number(value, width / 10) : value, unit].filter((part) => part !== "").join(" ");
  if (width === 0) return `${elements}; ${known > 1 ? "each" : "it is"} ${shown(min[0])}`;
  return `${elements}; minimum ${shown(min[0])} at element ${min[1]}, maximum ${shown(max[0])} at element ${max[1]}`;
}

/** A large profile with its scale, the served values that are derived from the vector, and words. */
export class Large {
  constructor() {
    this.drawing = new Drawing();
    this.svg = drawn("svg", { height: HEIGHT, "aria-hidden": "true" });
    this.told = made("p", { className: "soft steady" });
    this.element = made("div", { className: "profile-large", children: [this.svg, this.told] });
  }

  /** `served` are needs that a relation derives from the vector, each with its name and bounds; `why` says why there is no vector. */
  show({ profile, scale, unit, served, why }, width) {
    Object.assign(this, { width, inner: width - ROOM.left - ROOM.right });
    const { low, high } = scale.range(served.flatMap(({ lo, hi }) => [lo, hi]));
    const x = (share) => ROOM.left + share * this.inner;
    const y = (value) => ROOM.top + (1 - (value - low) / (high - low)) * (HEIGHT - ROOM.top - ROOM.bottom);
    // Its text shall not widen the table.
    this.element.style.width = `${width}px`;
    this.svg.setAttribute("width", width);
    this.svg.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
    this.drawing.show(profile, x, y, ROOM.top, HEIGHT - ROOM.bottom);
    const lines = served.flatMap((it) => this.line(it, y));
    this.svg.replaceChildren(...this.grid(x, y, low, high, unit, profile?.count ?? 0), ...this.drawing.elements, ...lines);
    setText(this.told, profile ? this.say(profile, unit, served) : why);
  }

  say(profile, unit, served) {
    const isThinned = profile.bins.length < profile.count;
    const thinned = isThinned ? ` Drawn in ${profile.bins.length} bins, each from its minimum to its maximum.` : "";
    const lines = served.map(({ name, lo, hi }) => ` Dashed: ${name} is served as ${enclosed(lo, hi, unit)}.`);
    return `${words(profile, unit)}.${thinned}${lines.join("")}`;
  }

  line({ name, lo, hi }, y) {
    const place = y((lo + hi) / 2);
    const isHigh = place < ROOM.top + 24;
    return [
      drawn("path", { class: "served", d: `M${ROOM.left} ${place.toFixed(1)}H${this.width - ROOM.right}` }),
      drawn("text", { class: "tick end name", x: this.width - ROOM.right - 4, y: place + (isHigh ? 18 : -6) }, [name]),
    ];
  }

  grid(x, y, low, high, unit, count) {
    const marks = [drawn("text", { class: "tick", x: 0, y: 16 }, [unit])];
    const size = step(high - low, 6);
    for (let value = Math.ceil(low / size) * size; value <= high; value += size) {
      marks.push(drawn("path", { class: "grid", d: `M${ROOM.left} ${y(value)}H${this.width - ROOM.right}` }));
      marks.push(drawn("text", { class: "tick end", x: ROOM.left - 8, y: y(value) + 5 }, [number(value, size)]));
    }
    const elements = Math.max(1, step(count, Math.max(2, this.inner / 80)));
    for (let at = 0; at < count; at += elements) {
      // The middle of the element.
      const place = x((at + 0.5) / count);
      if (place < this.width - 24) marks.push(drawn("text", { class: "tick middle", x: place, y: HEIGHT - 8 }, [String(at)]));
    }
    return marks;
  }
}
