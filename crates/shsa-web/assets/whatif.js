// What if: the sources that take over after the loss of signals, their utility, and the needs that no source serves.

import { ask } from "./stream.js";
import { arrange, made, setText } from "./words.js";

/** The most signals that are offered. */
const MOST = 100;
/** The most further losses that are shown for each need. */
const MOST_FURTHER = 50;

const utility = (way) => way.utility.toPrecision(3);

/** A change of utility in percent. */
function change(way, before) {
  if (!before || before.refused) return "";
  const percent = Math.round((100 * (way.utility - before.utility)) / before.utility);
  return percent ? ` (${percent > 0 ? "+" : "−"}${Math.abs(percent)} %)` : "";
}

/** Whether a way exists, and contracts let it serve. */
const isServed = (way) => way !== null && !way.refused;

/** What contracts say of a way; empty for a need that demands nothing. */
function contract({ admitted, level }) {
  if (!admitted) return "";
  return `, ${level ?? "no level"}${admitted === "met" ? "" : ` (${admitted})`}`;
}

function served(way, before) {
  if (!way) return "✗ nothing";
  if (way.refused) return `✗ withheld: contracts do not admit ${way.words}`;
  return `${way.words}, utility ${utility(way)}${change(way, before)}${contract(way)}`;
}

/** Losses that end a service come first. */
const worth = (way) => (isServed(way) ? way.utility : -1);

export class WhatIf {
  constructor({ token }) {
    const of = (name) => document.getElementById(name);
    Object.assign(this, { token, model: null, lost: new Set(), boxes: new Map(), tables: {}, asked: null, isFirst: true });
    this.text = of("what-if-text");
    this.list = of("what-if-signals");
    this.told = of("what-if-told");
    this.answers = of("what-if-needs");
    of("what-if-form").addEventListener("submit", (event) => event.preventDefault());
    of("what-if-now").addEventListener("click", () => this.lose(Object.keys(this.tables.lost ?? {})));
    of("what-if-none").addEventListener("click", () => this.lose([]));
  }

  reset(model) {
    Object.assign(this, { model, lost: new Set(), asked: null, isFirst: true });
    this.boxes.clear();
    this.list.replaceChildren();
    this.answers.replaceChildren();
  }

  show(tables, _now, isVisible) {
    this.tables = tables;
    if (!isVisible) return;
    if (this.isFirst) {
      this.lose(Object.keys(tables.lost ?? {}));
    }
    const words = this.text.value.toLowerCase();
    const all = Object.keys(tables.signals ?? {});
    const isOffered = (name) => this.lost.has(name) || name.toLowerCase().includes(words);
    const offered = all.filter(isOffered).slice(0, MOST);
    arrange(this.list, this.boxes, offered, (name) => this.box(name));
    // Another version of the model may give another answer.
    const asked = JSON.stringify([this.model, tables.about?.version, [...this.lost]]);
    if (asked !== this.asked) {
      this.asked = asked;
      this.ask(asked);
    }
  }

  box(name) {
    const input = made("input");
    input.type = "checkbox";
    input.checked = this.lost.has(name);
    input.addEventListener("change", () => {
      if (input.checked) this.lost.add(name);
      else this.lost.delete(name);
    });
    return { input, element: made("label", { className: "box", children: [input, name] }) };
  }

  lose(names) {
    this.isFirst = false;
    this.lost = new Set(names);
    for (const [name, { input }] of this.boxes) input.checked = this.lost.has(name);
  }

  async ask(asked) {
    const query = new URLSearchParams({ model: this.model, lost: JSON.stringify([...this.lost]) });
    try {
      const response = await ask(`/what-if?${query}`, this.token());
      const needs = await response.json();
      if (asked === this.asked) this.answer(needs);
    } catch (error) {
      setText(this.told, `✗ ${error.message}`);
    }
  }

  answer(needs) {
    const all = Object.entries(needs);
    const unhealed = all.filter(([, { now }]) => !isServed(now)).map(([name]) => name);
    const without = { 0: "", 1: " without this signal" }[this.lost.size] ?? ` without these ${this.lost.size} signals`;
    setText(this.told, unhealed.length ? `✗ Nothing serves ${unhealed.join(", ")}${without}.` : `✓ Every need is served${without}.`);
    this.answers.replaceChildren(...all.map(([name, need]) => this.need(name, need)));
  }

  need(name, { whole, now, further }) {
    const isGood = isServed(now);
    const facts = [["with everything", served(whole)], ["without these", served(now, whole)]];
    const list = made("dl", { children: facts.flatMap(([word, value]) => [made("dt", { text: word }), made("dd", { text: value })]) });
    const telling = further.filter(({ changes }) => changes).sort((one, other) => worth(one.then) - worth(other.then));
    const row = ({ signal, then }) => {
      const head = made("th", { text: signal });
      head.scope = "row";
      return made("tr", { children: [head, made("td", { className: isServed(then) ? "words" : "words failed", text: served(then, now) })] });
    };
    const head = made("tr", { children: ["if this is lost, too", "then"].map((text) => Object.assign(made("th", { text }), { scope: "col" })) });
    const table = made("table", { children: [made("thead", { children: [head] }), made("tbody", { children: telling.slice(0, MOST_FURTHER).map(row) })] });
    const rest = further.length - telling.length;
    const end = made("p", { className: "soft", text: rest && isGood ? `${rest === 1 ? "One other signal is" : `${rest} other signals are`} not missed if lost alone.` : "" });
    return made("article", { className: `card ${isGood ? "good" : "unserved"}`, children: [made("h3", { text: name }), list, ...(telling.length && isGood ? [table] : []), end] });
  }
}
