// The needs: value, width, quality, source, age, the remaining sources, and the last minutes of each.

import { Drawing, Scale, words } from "./profile.js";
import { age, arrange, drawn, made, number, quality, setText, signed, spread } from "./words.js";

/** The length of the past that is drawn, nanoseconds, and of one point in it: a third of a percent, two units of the drawing. */
const PAST = 180e9;
const EACH = PAST / 300;
/** The most needs that are shown. */
const MOST = 200;
const FACTS = [
  ["source", "source"], ["level", "level"], ["age", "age"], ["next", "next"], ["left", "survives"], ["published", "goes out as"], ["gap", "largest gap"],
];

/** The last minutes of a need. */
class Past {
  constructor() {
    this.points = [];
    this.source = null;
  }

  /** Puts before the first point what the run remembers: the time, the bounds, whether the source changed, whether nothing served before. */
  recall(remembered) {
    const first = this.points[0]?.at ?? Infinity;
    const before = remembered.filter(([at]) => at < first).flatMap(([at, lo, hi, isSwitch, isGap]) => {
      const point = { at, since: at, lo, hi, isSwitch };
      return isGap ? [{ at, isGap, isSwitch: false }, point] : [point];
    });
    this.points.unshift(...before);
  }

  /** Takes in the present state. */
  keep(need, [lo, hi, last], now) {
    const isSwitch = this.source !== null && need.source !== this.source;
    this.source = need.source;
    const before = this.points.at(-1);
    const isServed = quality(need.quality) !== "unserved" && lo != null;
    if (isServed && before && !before.isGap && before.at < last && last - before.since < EACH && !isSwitch) {
      Object.assign(before, { at: last, lo: Math.min(lo, before.lo), hi: Math.max(hi, before.hi) });
    } else if (isServed && (!before || before.isGap || before.at < last)) this.points.push({ at: last, since: last, lo, hi, isSwitch });
    else if (isSwitch || (!isServed && before && !before.isGap)) this.points.push({ at: now, isGap: !isServed, lo, hi, isSwitch });
    while (this.points.length && now - this.points[0].at > PAST) this.points.shift();
  }
}

/** A need on the page. */
class Card {
  constructor(name, show) {
    this.variable = name;
    const link = made("button", { className: "link", text: "its bands" });
    link.type = "button";
    link.setAttribute("aria-label", `its bands: ${name}`);
    link.addEventListener("click", () => show(this.variable));
    this.quality = made("span", { className: "quality" });
    this.number = made("span", { className: "middle" });
    this.width = made("small");
    const value = made("p", { className: "value", children: [this.number, " ", this.width] });
    this.band = drawn("path", { class: "band" });
    this.line = drawn("path", { class: "line" });
    this.switches = drawn("path", { class: "switch" });
    this.spark = drawn("svg", { class: "spark", viewBox: "0 0 600 100", preserveAspectRatio: "none", role: "img" });
    // Of a vector, the latest elements are drawn in place of the last minutes.
    this.profile = new Drawing();
    this.extremes = new Scale();
    this.spark.append(this.band, this.switches, this.line, ...this.profile.elements);
    [this.high, this.low] = [made("span"), made("span")];
    const scale = made("div", { className: "scale", children: [this.high, this.low] });
    scale.setAttribute("aria-hidden", "true");
    this.facts = {};
    const list = made("dl");
    for (const [key, word] of FACTS) {
      this.facts[key] = made("dd");
      list.append(made("dt", { text: word }), this.facts[key]);
    }
    const top = made("div", { className: "top", children: [made("h3", { text: name }), this.quality] });
    const chart = made("div", { className: "chart", children: [this.spark, scale] });
    this.element = made("article", { className: "card", children: [top, value, chart, list, link] });
    this.past = new Past();
    this.isSeen = true;
  }

  show({ need, value, tolerance, profile }, now) {
    const served = quality(need.quality);
    this.variable = need.variable;
    this.element.className = `card ${served}`;
    this.quality.className = `quality ${served}`;
    setText(this.quality, signed(served));
    const [lo, hi, last, published] = value;
    const width = hi - lo;
    const isServed = served !== "unserved" && lo != null;
    const unit = need.unit ?? "";
    const isVector = profile?.known > 0;
    setText(this.number, isVector ? spread(profile.min[0], profile.max[0], "") : isServed ? number((lo + hi) / 2, width) : "–");
    const what = profile ? `${unit}, ${profile.count} elements` : published && lo == null ? "a list of values" : "no value";
    setText(this.width, isServed ? `± ${number(width / 2, width)} ${unit}` : what);
    setText(this.facts.source, served === "unserved" ? "✗ nothing" : need.source + (need.forced ? ", by order" : ""));
    for (const element of [this.facts.level, this.facts.level.previousSibling]) element.hidden = !need.assurance;
    setText(this.facts.level, need.assurance ? level(need.assurance) : "");
    setText(this.facts.age, age(now, last));
    setText(this.facts.next, tolerance ? tolerance.next ?? "✗ nothing" : "…");
    setText(this.facts.left, left(tolerance));
    setText(this.facts.published, need.signal);
    setText(this.facts.gap, `${need.longest_gap_s.toFixed(2)} s`);
    if (profile) this.extremes.keep(profile, now);
    if (this.isSeen) this.draw(profile, now, unit);
  }

  draw(profile, now, unit) {
    const { low, high } = this.extremes.range();
    this.profile.show(profile, (share) => 600 * share, (value) => 100 * (1 - (value - low) / (high - low)), 2, 98);
    if (!profile) return this.drawPast(now, unit);
    for (const path of [this.band, this.line, this.switches]) path.setAttribute("d", "");
    this.label(low, high, `the latest elements: ${words(profile, unit)}`);
  }

  drawPast(now, unit) {
    const { points } = this.past;
    const known = points.filter((point) => !point.isGap && point.lo != null);
    const low = Math.min(...known.map((point) => point.lo));
    const high = Math.max(...known.map((point) => point.hi));
    const x = (point) => (600 * (1 - (now - point.at) / PAST)).toFixed(1);
    const y = (value) => (high > low ? 96 - (92 * (value - low)) / (high - low) : 50).toFixed(1);
    const pieces = [[]];
    for (const point of points) {
      if (point.isGap || point.lo == null) pieces.push([]);
      else pieces.at(-1).push(point);
    }
    const areas = pieces.filter((piece) => piece.length > 1);
    const joined = (piece, of) => piece.map((point) => `${x(point)} ${y(of(point))}`).join("L");
    const area = (piece) => `M${joined(piece, (it) => it.hi)}L${joined(piece.toReversed(), (it) => it.lo)}Z`;
    this.band.setAttribute("d", areas.map(area).join(""));
    this.line.setAttribute("d", areas.map((piece) => `M${joined(piece, (it) => (it.lo + it.hi) / 2)}`).join(""));
    this.switches.setAttribute("d", points.filter((point) => point.isSwitch).map((point) => `M${x(point)} 0V100`).join(""));
    this.label(low, high, known.length ? `last 3 minutes: from ${number(low, high - low)} to ${number(high, high - low)} ${unit}` : "last 3 minutes: no value");
  }

  /** Writes the ends of the scale beside the drawing, and what it shows. */
  label(low, high, told) {
    setText(this.high, low <= high ? number(high, high - low) : "");
    setText(this.low, low <= high ? number(low, high - low) : "");
    if (this.spark.getAttribute("aria-label") !== told) this.spark.setAttribute("aria-label", told);
  }
}

/** The level at which contracts admit the source, and on which ground if not because all is met; or what they lack. */
function level({ admitted, level, verdict, lacking }) {
  if (admitted) return [level ?? "no level", ...(admitted === "met" ? [] : [admitted])].join(", ");
  const sets = lacking.slice(0, 2).map((set) => set.join(", "));
  return `✗ ${verdict ?? "refused"}${sets.length ? `, lacks ${sets.join("; or ")}` : ""}`;
}

/** How many losses a need survives, in words. */
function left(tolerance) {
  if (!tolerance) return "…";
  if (!tolerance.known) return "✗ only by going on from the last value, if at all";
  if (tolerance.survives === null) return "any loss";
  const many = tolerance.survives === 1 ? "1 more loss" : `${tolerance.survives} more losses`;
  const count = tolerance.survives === 0 ? "✗ no more loss" : `${tolerance.exact ? "" : "at least "}${many}`;
  return tolerance.cut.length ? `${count}; not ${tolerance.cut.join(" with ")}` : count;
}

export class Needs {
  /** `show` opens the bands of a variable. */
  constructor({ show }) {
    this.showBands = show;
    this.list = document.getElementById("needs-list");
    this.more = document.getElementById("needs-more");
    this.cards = new Map();
    // Only visible needs are drawn.
    this.sight = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) target.card.isSeen = isIntersecting;
    }, { rootMargin: "200px" });
  }

  /** What the run remembers of the needs. */
  recall(past) {
    for (const [name, card] of this.cards) card.past.recall(past[name] ?? []);
  }

  /** Another model: the needs of the previous one are removed. */
  reset() {
    this.cards.clear();
    this.list.replaceChildren();
  }

  show({ needs = {}, values = {}, tolerance = {}, need_profiles: profiles = {} }, now, isVisible) {
    const names = Object.keys(needs);
    if (names.length && this.cards.size === 0) this.list.replaceChildren();
    arrange(this.list, this.cards, names.slice(0, MOST), (name) => {
      const card = new Card(name, this.showBands);
      card.element.card = card;
      this.sight.observe(card.element);
      return card;
    });
    for (const [name, card] of this.cards) {
      const value = values[name] ?? [null, null, null, 0];
      card.past.keep(needs[name], value, now);
      if (isVisible) card.show({ need: needs[name], value, tolerance: tolerance[name], profile: profiles[name] }, now);
    }
    setText(this.more, names.length > MOST ? `and ${names.length - MOST} more` : "");
  }
}
