// The timeline: every decision with its reasons, the newest first.

import { clock, made, signed } from "./words.js";

/** The most decisions that are kept and shown. */
const MOST = 200;

export class Timeline {
  /** `show` opens the bands of the subject of a decision, at its moment. */
  constructor({ show }) {
    this.show = show;
    this.list = document.getElementById("timeline-list");
    this.kind = document.getElementById("filter-kind");
    this.text = document.getElementById("filter-text");
    this.events = [];
    document.getElementById("filter").addEventListener("submit", (event) => event.preventDefault());
    this.kind.addEventListener("change", () => this.draw());
    this.text.addEventListener("input", () => this.draw());
    this.draw();
  }

  /** Takes in decisions; a complete list replaces the previous ones. */
  take(events, areAll) {
    if (events.length === 0 && !areAll) return;
    this.events = [...(areAll ? [] : this.events), ...events].slice(-MOST);
    const known = new Set([...this.kind.options].map((option) => option.value));
    for (const kind of new Set(events.map((event) => event.kind))) {
      if (!known.has(kind)) this.kind.append(new Option(kind, kind));
    }
    this.draw();
  }

  draw() {
    const words = this.text.value.toLowerCase();
    const isWanted = (event) => (!this.kind.value || event.kind === this.kind.value) && told(event).toLowerCase().includes(words);
    const items = this.events.filter(isWanted).reverse().map((event) => item(event, this.show));
    this.list.replaceChildren(...(items.length ? items : [made("li", { className: "soft", text: "No decision." })]));
  }
}

function told(event) {
  return [event.model, event.signal, event.relation, event.variable, event.need, event.because, event.substitution].filter(Boolean).join(" ");
}

function item(event, show) {
  const time = made("time", { text: clock(event.time_ns) });
  time.dateTime = new Date(event.time_ns / 1e6).toISOString();
  const subject = event.signal ?? event.relation ?? event.need ?? event.variable;
  const lines = [subject && made("strong", { text: subject }), made("p", { text: event.because })];
  if (event.substitution) lines.push(made("p", { className: "soft", text: `served by ${event.substitution}` }));
  const about = event.variable ?? event.signal;
  if (about) {
    const button = made("button", { className: "link", text: "in the bands" });
    button.type = "button";
    button.setAttribute("aria-label", `in the bands: ${about} at ${clock(event.time_ns)}`);
    button.addEventListener("click", () => show(about, event.time_ns));
    lines.push(button);
  }
  const what = made("div", { className: "what", children: lines.filter(Boolean) });
  const kind = made("span", { className: `kind ${event.kind}`, text: signed(event.kind) });
  return made("li", { children: [time, kind, what] });
}
