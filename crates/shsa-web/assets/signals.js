// The signals: verdict and last value of each; those that are not trusted come first. A vector has a small profile, which opens a
// larger one below its row. Below them the learned variables.

import { Learned } from "./learned.js";
import { Large, Scale, Small } from "./profile.js";
import { age, arrange, enclosed, made, quality, setText, signed, spread } from "./words.js";

/** The most signals that are listed. */
const MOST = 200;
const ORDER = ["failed", "silent", "suspect", "unknown", "healthy"];
/** Ends the key of the row below that of a signal; no name has it. */
const BELOW = "\nbelow";
const COLUMNS = 6;

/** The row of a signal. */
class Line {
  /** `show` opens its bands, `turn` opens or closes the row below. */
  constructor(name, { show, turn }) {
    this.name = name;
    const link = made("button", { className: "link", text: name });
    link.type = "button";
    link.title = "Its bands";
    link.addEventListener("click", () => show(name));
    const head = made("th", { children: [link] });
    head.scope = "row";
    this.small = new Small();
    this.profile = made("button", { className: "profile", children: [this.small.element] });
    this.profile.type = "button";
    this.profile.title = "Its profile";
    this.profile.setAttribute("aria-label", `profile of ${name}`);
    this.profile.addEventListener("click", () => turn(name));
    this.text = made("span");
    this.verdict = made("td");
    this.value = made("td", { className: "number", children: [this.profile, this.text] });
    this.age = made("td", { className: "number" });
    this.variable = made("td");
    this.count = made("td", { className: "number" });
    this.element = made("tr", { children: [head, this.verdict, this.value, this.age, this.variable, this.count] });
  }

  show({ signal, reading, profile, scale, isOpen, now }) {
    const { verdict, symptom, unit, variable, is_list } = signal;
    const [lo, hi, last, accepted] = reading;
    this.verdict.className = verdict;
    setText(this.verdict, signed(verdict) + (symptom ? ` (${symptom})` : ""));
    this.profile.hidden = !is_list;
    // A vector with infinite elements has no bounds, but a minimum and a maximum of the others.
    const extreme = (bound, of) => bound ?? of?.[0];
    setText(this.text, is_list ? spread(extreme(lo, profile?.min), extreme(hi, profile?.max), unit) : enclosed(lo, hi, unit));
    if (is_list) {
      this.small.show(profile, scale);
      this.profile.setAttribute("aria-expanded", String(isOpen));
    }
    setText(this.age, age(now, last));
    setText(this.variable, variable);
    setText(this.count, String(accepted));
  }
}

/** The row below that of a vector: its profile, large. */
class Below {
  constructor(name) {
    this.name = name;
    this.large = new Large();
    const cell = made("td", { className: "below", children: [this.large.element] });
    cell.colSpan = COLUMNS;
    this.element = made("tr", { children: [cell] });
  }

  show({ signal, profile, scale, served, width }) {
    const why = signal.verdict === "silent" ? "No vector: the signal is silent." : "No vector.";
    this.large.show({ profile, scale, served, why, unit: signal.unit ?? "" }, width);
  }
}

/** The needs that one relation computes from the variable of a signal alone, in the same unit, with their served values. */
function derived({ variable, unit }, { needs = {}, values = {}, derived: vectors = {} }) {
  const found = Object.keys(needs).filter((need) => vectors[need]?.includes(variable) && needs[need].unit === unit);
  const bounds = found.map((name) => ({ name, lo: values[name]?.[0], hi: values[name]?.[1] }));
  return bounds.filter(({ name, lo, hi }) => lo != null && hi != null && quality(needs[name].quality) !== "unserved");
}

export class Signals {
  /** `show` opens the bands of the variable of a signal. */
  constructor({ show }) {
    this.actions = { show, turn: (name) => this.turn(name) };
    this.learned = new Learned({ show });
    this.list = document.getElementById("signals-list");
    this.wide = document.getElementById("signals-wide");
    this.count = document.getElementById("signals-count");
    this.text = document.getElementById("signals-text");
    this.verdict = document.getElementById("signals-verdict");
    Object.assign(this, { lines: new Map(), scales: new Map(), opened: new Set(), latest: null });
    document.getElementById("signals-filter").addEventListener("submit", (event) => event.preventDefault());
  }

  reset() {
    this.learned.reset();
    this.lines.clear();
    this.scales.clear();
    this.opened.clear();
    this.list.replaceChildren();
  }

  /** Opens or closes the profile of a signal. */
  turn(name) {
    if (!this.opened.delete(name)) this.opened.add(name);
    this.draw();
  }

  show(tables, now, isVisible) {
    for (const [name, profile] of Object.entries(tables.signal_profiles ?? {})) {
      this.scale(name).keep(profile, now);
    }
    this.latest = { tables, now };
    if (isVisible) this.draw();
  }

  scale(name) {
    if (!this.scales.has(name)) this.scales.set(name, new Scale());
    return this.scales.get(name);
  }

  draw() {
    const { tables, now } = this.latest;
    const { signals = {}, readings = {}, signal_profiles: profiles = {}, learned = {} } = tables;
    const words = this.text.value.toLowerCase();
    const isWanted = ([name, { verdict, variable }]) =>
      (!this.verdict.value || verdict === this.verdict.value) && `${name} ${variable}`.toLowerCase().includes(words);
    const found = Object.entries(signals).filter(isWanted);
    const rank = ([, { verdict }]) => ORDER.indexOf(verdict);
    found.sort((one, other) => rank(one) - rank(other));
    const shown = found.slice(0, MOST).map(([name]) => name);
    const keys = shown.flatMap((name) => (this.opened.has(name) ? [name, name + BELOW] : [name]));
    arrange(this.list, this.lines, keys, (key) => (key.endsWith(BELOW) ? new Below(key.slice(0, -BELOW.length)) : new Line(key, this.actions)));
    const width = Math.max(280, this.wide.clientWidth);
    for (const line of this.lines.values()) {
      const { name } = line;
      const isOpen = this.opened.has(name);
      const served = isOpen ? derived(signals[name], tables) : [];
      line.show({ signal: signals[name], reading: readings[name] ?? [null, null, null, 0], profile: profiles[name], scale: this.scale(name), served, isOpen, width, now });
    }
    const all = Object.keys(signals).length;
    setText(this.count, `${shown.length} of ${all} signals`);
    this.learned.show(learned);
  }
}
