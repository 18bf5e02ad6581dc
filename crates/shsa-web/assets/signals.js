// The signals: verdict and last value of each; those that are not trusted come first. Below them the learned variables.

import { Learned } from "./learned.js";
import { age, arrange, enclosed, made, setText, signed, spread } from "./words.js";

/** The most signals that are listed. */
const MOST = 200;
const ORDER = ["failed", "silent", "suspect", "unknown", "healthy"];

/** A signal on the page. */
class Line {
  constructor(name, show) {
    const link = made("button", { className: "link", text: name });
    link.type = "button";
    link.title = "Its bands";
    link.addEventListener("click", () => show(name));
    const head = made("th", { children: [link] });
    head.scope = "row";
    this.verdict = made("td");
    this.value = made("td", { className: "number" });
    this.age = made("td", { className: "number" });
    this.variable = made("td");
    this.count = made("td", { className: "number" });
    this.element = made("tr", { children: [head, this.verdict, this.value, this.age, this.variable, this.count] });
  }

  show({ verdict, symptom, unit, variable, is_list }, [lo, hi, last, accepted], now) {
    this.verdict.className = verdict;
    setText(this.verdict, signed(verdict) + (symptom ? ` (${symptom})` : ""));
    setText(this.value, is_list ? spread(lo, hi, unit) : enclosed(lo, hi, unit));
    setText(this.age, age(now, last));
    setText(this.variable, variable);
    setText(this.count, String(accepted));
  }
}

export class Signals {
  /** `show` opens the bands of the variable of a signal. */
  constructor({ show }) {
    this.showBands = show;
    this.learned = new Learned({ show });
    this.list = document.getElementById("signals-list");
    this.count = document.getElementById("signals-count");
    this.text = document.getElementById("signals-text");
    this.verdict = document.getElementById("signals-verdict");
    this.lines = new Map();
    document.getElementById("signals-filter").addEventListener("submit", (event) => event.preventDefault());
  }

  reset() {
    this.learned.reset();
    this.lines.clear();
    this.list.replaceChildren();
  }

  show({ signals = {}, readings = {}, learned = {} }, now, isVisible) {
    if (!isVisible) return;
    const words = this.text.value.toLowerCase();
    const isWanted = ([name, { verdict, variable }]) =>
      (!this.verdict.value || verdict === this.verdict.value) && `${name} ${variable}`.toLowerCase().includes(words);
    const found = Object.entries(signals).filter(isWanted);
    const rank = ([, { verdict }]) => ORDER.indexOf(verdict);
    found.sort((one, other) => rank(one) - rank(other));
    const shown = found.slice(0, MOST).map(([name]) => name);
    arrange(this.list, this.lines, shown, (name) => new Line(name, this.showBands));
    for (const [name, line] of this.lines) line.show(signals[name], readings[name] ?? [null, null, null, 0], now);
    const all = Object.keys(signals).length;
    setText(this.count, `${shown.length} of ${all} signals`);
    this.learned.show(learned);
  }
}
