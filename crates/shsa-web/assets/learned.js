// The learned variables: what each can be now, its range, and when it leaves the range if it goes on as it does.

import { arrange, enclosed, lasting, made, setText, signed, spread } from "./words.js";

/** A learned variable on the page. */
class Line {
  constructor(name, show) {
    const link = made("button", { className: "link", text: name });
    link.type = "button";
    link.title = "Its bands";
    link.addEventListener("click", () => show(name));
    const head = made("th", { children: [link] });
    head.scope = "row";
    this.state = made("td");
    this.value = made("td", { className: "number" });
    this.range = made("td", { className: "number" });
    this.limit = made("td", { className: "number" });
    this.element = made("tr", { children: [head, this.state, this.value, this.range, this.limit] });
  }

  show({ lo, hi, range, unit, state, limit_in_s }) {
    this.state.className = { frozen: "suspect", "out of range": "failed" }[state] ?? "";
    setText(this.state, signed(state));
    setText(this.value, enclosed(lo, hi, unit));
    setText(this.range, spread(range[0], range[1], unit));
    setText(this.limit, limit_in_s === null ? "–" : lasting(limit_in_s));
  }
}

export class Learned {
  /** `show` opens the bands of a variable. */
  constructor({ show }) {
    this.showBands = show;
    this.whole = document.getElementById("learned");
    this.list = document.getElementById("learned-list");
    this.lines = new Map();
  }

  reset() {
    this.lines.clear();
    this.list.replaceChildren();
  }

  show(learned) {
    const names = Object.keys(learned);
    this.whole.hidden = names.length === 0;
    arrange(this.list, this.lines, names, (name) => new Line(name, this.showBands));
    for (const [name, line] of this.lines) line.show(learned[name]);
  }
}
