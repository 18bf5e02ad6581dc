// Orders: with the token, and only after a confirmation.

import { ask } from "./stream.js";
import { clock, made, setText } from "./words.js";

/** The most names that are offered while one is typed. */
const MOST = 100;
/** The most given orders that are shown. */
const MOST_AUDIT = 20;

/** The subject of each order, and its field. */
const FIELDS = { signal: ["signal"], relation: ["relation"], need: ["need"], force: ["need", "source"] };

export class Orders {
  constructor() {
    const of = (name) => document.getElementById(name);
    this.input = of("order-token");
    this.kind = of("order-kind");
    this.fields = { signal: of("order-signal"), relation: of("order-relation"), need: of("order-need"), source: of("order-source") };
    this.places = { signal: of("of-signal"), relation: of("of-relation"), need: of("of-need"), source: of("of-source") };
    this.offered = { signal: of("signal-names"), relation: of("relation-names") };
    this.told = of("order-answer");
    this.dialog = of("confirm");
    this.words = of("confirm-words");
    this.inForce = of("orders-list");
    this.audit = of("audit");
    this.tokenChanged = () => {};
    this.model = null;
    this.tables = {};
    this.shown = "";
    this.given = [];
    of("order").addEventListener("submit", (event) => {
      event.preventDefault();
      this.confirm();
    });
    of("confirm-no").addEventListener("click", () => this.dialog.close());
    of("confirm-yes").addEventListener("click", () => {
      this.dialog.close();
      this.send();
    });
    this.kind.addEventListener("change", () => this.choose());
    this.input.addEventListener("change", () => this.tokenChanged());
    for (const what of ["signal", "relation"]) this.fields[what].addEventListener("input", () => this.offer(what));
    this.fields.need.addEventListener("change", () => this.offerSources());
    this.take([], true);
  }

  token() {
    return this.input.value.trim();
  }

  reset(model) {
    this.model = model;
    this.shown = "";
  }

  /** The selected order and its fields. */
  chosen() {
    const [order, about] = this.kind.value.split(" ");
    return { order, fields: FIELDS[order] ?? FIELDS[about] };
  }

  /** Shows the fields of the selected order. */
  choose() {
    const { fields } = this.chosen();
    for (const [name, place] of Object.entries(this.places)) place.hidden = !fields.includes(name);
    this.offerSources();
  }

  show(tables, _now, isVisible) {
    this.tables = tables;
    const { needs = {}, orders = {} } = tables;
    const shown = JSON.stringify([Object.keys(needs), orders]);
    if (!isVisible || shown === this.shown) return;
    this.shown = shown;
    const chosen = this.fields.need.value;
    this.fields.need.replaceChildren(...Object.entries(needs).map(([name, { signal }]) => new Option(name, signal)));
    if (chosen) this.fields.need.value = chosen;
    this.choose();
    for (const what of ["signal", "relation"]) this.offer(what);
    const items = Object.values(orders).map((order) => this.standing(order));
    this.inForce.replaceChildren(...(items.length ? items : [made("li", { className: "soft", text: "No order is in force." })]));
  }

  /** An order that is in force, with a button that prepares its end. */
  standing(order) {
    const { order: kind, ...about } = order;
    const end = { forbid: "allow", force: "release" }[kind];
    const item = made("li", { text: `${kind} ${Object.values(about).join(": ")} ` });
    if (!end) return item;
    const button = made("button", { text: `${end} …` });
    button.type = "button";
    button.addEventListener("click", () => {
      const what = ["signal", "relation", "need"].find((name) => name in about);
      if (!what) return;
      this.kind.value = `${end} ${what}`;
      this.fields[what].value = about[what];
      this.choose();
      this.confirm();
    });
    item.append(button);
    return item;
  }

  /** Offers the names that contain the typed text. */
  offer(what) {
    const { ahead = {}, signals = {} } = this.tables;
    const all = what === "signal" ? Object.keys(signals) : [...new Set(Object.values(ahead).flat().flatMap((way) => way.relations))];
    const typed = this.fields[what].value;
    const found = all.filter((name) => name.includes(typed)).slice(0, MOST);
    this.offered[what].replaceChildren(...found.map((name) => new Option(name, name)));
  }

  /** The ways that could serve the selected need. */
  offerSources() {
    const { needs = {}, ahead = {} } = this.tables;
    const name = Object.keys(needs).find((it) => needs[it].signal === this.fields.need.value);
    this.fields.source.replaceChildren(...(ahead[name] ?? []).map(({ words }) => new Option(words, words)));
  }

  confirm() {
    const { fields } = this.chosen();
    if (!this.token()) {
      setText(this.told, "✗ An order needs the token of the instance.");
      return this.input.focus();
    }
    const missing = fields.find((name) => !this.fields[name].value.trim());
    if (missing) {
      setText(this.told, `✗ Say which ${missing}.`);
      return this.fields[missing].focus();
    }
    const about = fields.map((name) => this.fields[name].value.trim()).join(", from ");
    setText(this.words, `Order to ${this.kind.selectedOptions[0].text}: ${about}?`);
    this.dialog.showModal();
  }

  async send() {
    const { order, fields } = this.chosen();
    const about = Object.fromEntries(fields.map((name) => [name, this.fields[name].value.trim()]));
    const body = JSON.stringify({ order, model: this.model, ...about });
    try {
      const response = await ask("/orders", this.token(), { method: "POST", headers: { "Content-Type": "application/json" }, body });
      setText(this.told, `✓ ${(await response.json()).done}`);
    } catch (error) {
      setText(this.told, `✗ ${error.message}`);
    }
  }

  /** Keeps the orders of all users. */
  take(events, areAll) {
    const ordered = events.filter(({ kind }) => kind === "ordered" || kind === "denied");
    if (ordered.length === 0 && !areAll) return;
    this.given = [...(areAll ? [] : this.given), ...ordered].slice(-MOST_AUDIT);
    const items = this.given.toReversed().map(({ time_ns, kind, because }) => made("li", { text: `${clock(time_ns)} ${kind}: ${because}` }));
    this.audit.replaceChildren(...(items.length ? items : [made("li", { className: "soft", text: "Nothing yet." })]));
  }
}
