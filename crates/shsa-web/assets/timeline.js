// The timeline: every decision with its reasons, the newest first.

import { ask } from "./stream.js";
import { arrange, clock, made, setText, signed } from "./words.js";

/** Decisions with evidence about a signal. */
const ACCUSES = new Set(["suspected", "failed", "silent"]);
/** The most decisions that are kept and shown. */
const MOST = 200;

export class Timeline {
  /** `show` opens the bands of the subject of a decision, at its moment. */
  constructor({ token, show }) {
    Object.assign(this, { token, show, items: new Map() });
    this.none = made("p", { className: "soft", text: "No decision." });
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
    if (areAll) {
      this.items.clear();
      this.list.replaceChildren();
    }
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
    const wanted = new Map(this.events.filter(isWanted).reverse().map((event) => [event.number, event]));
    // Those that stay are kept as they are: an opened explanation stays open.
    arrange(this.list, this.items, [...wanted.keys()], (number) => ({ element: item(wanted.get(number), this) }));
    if (wanted.size) this.none.remove();
    else this.list.after(this.none);
  }

  /** The evidence for a decision, asked for when it is opened. */
  why(event) {
    const answer = made("div", { className: "why", text: "…" });
    const details = made("details", { children: [made("summary", { text: "why" }), answer] });
    details.firstChild.setAttribute("aria-label", `why: ${event.signal}, ${event.kind} at ${clock(event.time_ns)}`);
    details.addEventListener("toggle", async () => {
      if (!details.open) return;
      try {
        const response = await ask(`/evidence?number=${event.number}`, this.token());
        const sections = await response.json();
        if (sections) answer.replaceChildren(...sections.flatMap((it) => section(it, event)), made("p", { className: "soft", text: "Times count from the beginning of the run." }));
        else setText(answer, "The evidence is not kept any more.");
      } catch (error) {
        setText(answer, `✗ ${error.message}`);
      }
    });
    return details;
  }
}

function told(event) {
  return [event.model, event.signal, event.relation, event.variable, event.need, event.because, event.substitution].filter(Boolean).join(" ");
}

/** A part of the evidence, without what only repeats the reasons of the decision. */
function section({ title, items }, { because }) {
  const entries = items.filter(({ text }) => !text.includes(because)).map(({ text, notes }) => made("li", { children: [text, ...notes.map((note) => made("div", { className: "soft", text: note }))] }));
  return [made("h3", { text: title }), made("ul", { children: entries })];
}

function item(event, timeline) {
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
    button.addEventListener("click", () => timeline.show(about, event.time_ns));
    lines.push(button);
  }
  if (event.signal && ACCUSES.has(event.kind)) lines.push(timeline.why(event));
  const what = made("div", { className: "what", children: lines.filter(Boolean) });
  const kind = made("span", { className: `kind ${event.kind}`, text: signed(event.kind) });
  return made("li", { children: [time, kind, what] });
}
