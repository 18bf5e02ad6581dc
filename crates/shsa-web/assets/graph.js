// The knowledge graph around a variable: the sources of its values in columns, and the substitution in use as a path.

import { ask } from "./stream.js";
import { age, clock, drawn, enclosed, made, setText, signed, spread } from "./words.js";

/** The most nodes that are drawn: the nearest ones. */
const MOST = 60;
/** The most names that are offered while one is typed. */
const MOST_OFFERED = 100;
const WIDTH = 176;
const HEIGHT = 40;
const COLUMN = 216;
const ROW = 56;
const MARGIN = 16;
/** The smallest scale at which texts are legible. */
const LEAST = 0.72;
/** The most characters of a name in a node. */
const FITTING = 17;

const shortened = (name) => (name.length > FITTING ? `…${name.slice(1 - FITTING)}` : name);

/** A model, with the elements that refer to each variable. */
export class Structure {
  constructor(model) {
    const byName = (list) => new Map(list.map((it) => [it.name, it]));
    this.variables = byName(model.variables);
    this.relations = byName(model.relations);
    this.signals = byName(model.signals);
    this.needs = byName(model.needs);
    this.carriers = Map.groupBy(model.signals, (signal) => signal.variable);
    this.producers = new Map();
    for (const relation of model.relations) {
      for (const output of relation.outputs) {
        if (!this.producers.has(output)) this.producers.set(output, []);
        this.producers.get(output).push(relation);
      }
    }
  }

  /** The variable of a name: its own, or that of the signal, relation or need of that name. */
  variableOf(name) {
    if (this.variables.has(name)) return name;
    const found = this.signals.get(name) ?? this.needs.get(name);
    return found?.variable ?? this.relations.get(name)?.outputs[0] ?? null;
  }
}

/** The nodes around a variable and their edges: nearest first, each with its column, counted from the variable. */
export function around(structure, focus) {
  const nodes = new Map();
  const edges = [];
  let more = 0;
  const add = (kind, name, column) => {
    const key = `${kind} ${name}`;
    if (nodes.has(key)) return nodes.get(key);
    if (nodes.size >= MOST) {
      more += 1;
      return null;
    }
    const node = { key, kind, name, column };
    nodes.set(key, node);
    return node;
  };
  const queue = [add("variable", focus, 0)];
  const join = (from, to) => from && to && edges.push({ from, to });
  for (const variable of queue) {
    for (const { name } of structure.carriers.get(variable.name) ?? []) join(add("signal", name, variable.column + 1), variable);
    for (const relation of structure.producers.get(variable.name) ?? []) {
      const isNew = !nodes.has(`relation ${relation.name}`);
      const node = add("relation", relation.name, variable.column + 1);
      join(node, variable);
      if (!node || !isNew) continue;
      for (const input of relation.inputs.filter((name) => name !== variable.name)) {
        const isKnown = nodes.has(`variable ${input}`);
        const read = add("variable", input, node.column + 1);
        join(read, node);
        if (read && !isKnown) queue.push(read);
      }
    }
  }
  return { nodes: [...nodes.values()], edges, more };
}

/** Places the nodes: columns from the right, each in an order with few crossings. */
export function place({ nodes, edges }) {
  const columns = [];
  for (const node of nodes) (columns[node.column] ??= []).push(node);
  const neighbours = new Map(nodes.map((node) => [node, []]));
  for (const { from, to } of edges) {
    neighbours.get(from).push(to);
    neighbours.get(to).push(from);
  }
  const number = () => columns.forEach((column) => column.forEach((node, at) => (node.at = at - (column.length - 1) / 2)));
  const sort = (column, beside) => {
    for (const node of column) {
      const others = neighbours.get(node).filter((other) => other.column === beside);
      node.weight = others.length ? others.reduce((sum, other) => sum + other.at, 0) / others.length : node.at;
    }
    column.sort((one, other) => one.weight - other.weight);
  };
  number();
  for (let round = 0; round < 4; round += 1) {
    for (let at = 1; at < columns.length; at += 1) {
      sort(columns[at], at - 1);
      number();
    }
    for (let at = columns.length - 2; at >= 0; at -= 1) {
      sort(columns[at], at + 1);
      number();
    }
  }
  const rows = Math.max(...columns.map((column) => column.length));
  const width = 2 * MARGIN + (columns.length - 1) * COLUMN + WIDTH;
  const height = 2 * MARGIN + (rows - 1) * ROW + HEIGHT;
  for (const node of nodes) {
    node.x = width - MARGIN - WIDTH - node.column * COLUMN;
    node.y = height / 2 - HEIGHT / 2 + node.at * ROW;
  }
  return { width, height };
}

/** The line of an edge: from the right side of a node to the left side of the next; around both if the next one is not to the right. */
function line({ from, to }) {
  const [y, end] = [from.y + HEIGHT / 2, to.y + HEIGHT / 2];
  if (from.x >= to.x) {
    const x = from.x + WIDTH / 2;
    return `M${x} ${from.y + HEIGHT}C${x} ${y + ROW} ${to.x + WIDTH / 2} ${end + ROW} ${to.x + WIDTH / 2} ${to.y + HEIGHT}`;
  }
  const [x, last] = [from.x + WIDTH, to.x];
  const middle = (x + last) / 2;
  return `M${x} ${y}C${middle} ${y} ${middle} ${end} ${last - 8} ${end}`;
}

/** The curve of a conflict between two signals. */
function arc(one, other) {
  const [x, y] = [one.x, one.y + HEIGHT / 2];
  const [lastX, lastY] = [other.x, other.y + HEIGHT / 2];
  const bend = Math.min(56, x - 2, lastX - 2);
  return `M${x} ${y}C${x - bend} ${y} ${lastX - bend} ${lastY} ${lastX} ${lastY}`;
}

const SHAPES = {
  variable: () => drawn("rect", { width: WIDTH, height: HEIGHT, rx: 20 }),
  relation: () => drawn("rect", { width: WIDTH, height: HEIGHT, rx: 0 }),
  signal: () => drawn("path", { d: `M0 0H${WIDTH - 16}L${WIDTH} ${HEIGHT / 2}L${WIDTH - 16} ${HEIGHT}H0Z` }),
};

export class Graph {
  /** `token` returns the present token, `show` opens the bands of a variable. */
  constructor({ token, show }) {
    const of = (name) => document.getElementById(name);
    Object.assign(this, { token, showBands: show, model: null, version: null, structure: null, focus: null, chosen: null, tables: {} });
    this.need = of("graph-need");
    this.search = of("graph-search");
    this.offered = of("graph-names");
    this.drawing = of("graph-drawing");
    this.about = of("graph-about");
    this.more = of("graph-more");
    of("graph-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.find(this.search.value.trim());
    });
    this.search.addEventListener("input", () => this.offer());
    this.need.addEventListener("change", () => this.find(this.need.value));
  }

  reset(model) {
    Object.assign(this, { model, version: null, structure: null, focus: null, chosen: null });
    this.drawing.replaceChildren();
    this.about.replaceChildren();
  }

  show(tables, now, isVisible) {
    Object.assign(this, { tables, now });
    if (!isVisible) return;
    const version = tables.about?.version;
    if (this.version !== version) {
      this.version = version;
      this.fetch();
    }
    if (this.structure) this.refresh();
  }

  async fetch() {
    try {
      const response = await ask(`/model?model=${encodeURIComponent(this.model)}`, this.token());
      this.structure = new Structure(await response.json());
    } catch (error) {
      return setText(this.more, `✗ ${error.message}`);
    }
    const needs = [...this.structure.needs.values()];
    this.need.replaceChildren(...needs.map(({ name, signal }) => new Option(signal, name)));
    this.offer();
    const known = this.focus && this.structure.variables.has(this.focus);
    this.draw(known ? this.focus : needs[0]?.variable ?? this.structure.variables.keys().next().value);
  }

  offer() {
    if (!this.structure) return;
    const { variables, signals, relations } = this.structure;
    const names = [...variables.keys(), ...signals.keys(), ...relations.keys()];
    const found = names.filter((name) => name.includes(this.search.value)).slice(0, MOST_OFFERED);
    this.offered.replaceChildren(...found.map((name) => new Option(name, name)));
  }

  find(name) {
    const variable = this.structure?.variableOf(name);
    if (!variable) return setText(this.more, `✗ The model has nothing of the name ${name}.`);
    this.draw(variable);
  }

  /** Lays out and draws the surroundings of a variable. */
  draw(focus) {
    if (!focus) return;
    this.focus = focus;
    const found = around(this.structure, focus);
    const { width, height } = place(found);
    this.nodes = found.nodes;
    this.edges = found.edges.map((edge) => ({ ...edge, line: drawn("path", { class: "edge", d: line(edge) }) }));
    for (const node of this.nodes) {
      node.text = drawn("text", { x: 16, y: 26 });
      node.element = drawn("g", { class: `node ${node.kind}`, transform: `translate(${node.x} ${node.y})`, tabindex: 0, role: "button" });
      node.element.append(drawn("title", {}, [node.name]), SHAPES[node.kind](), node.text);
      node.element.addEventListener("click", () => this.choose(node));
      node.element.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        this.choose(node);
      });
    }
    this.conflicts = drawn("g", { class: "conflicts" });
    this.drawn = "";
    // A large graph is drawn smaller, down to the smallest legible scale; beyond that it is scrolled.
    const scale = Math.min(1, Math.max(LEAST, this.drawing.clientWidth / width));
    const svg = drawn("svg", { viewBox: `0 0 ${width} ${height}`, width: width * scale, height: height * scale, role: "group", "aria-label": `What ${focus} can be known from` });
    const tip = drawn("marker", { id: "tip", viewBox: "0 0 8 8", refX: 0, refY: 4, markerWidth: 8, markerHeight: 8, markerUnits: "userSpaceOnUse", orient: "auto" });
    tip.append(drawn("path", { d: "M0 0L8 4L0 8Z" }));
    svg.append(drawn("defs", {}, [tip]), ...this.edges.map((edge) => edge.line), this.conflicts, ...this.nodes.map((node) => node.element));
    this.drawing.replaceChildren(svg);
    this.drawing.scrollLeft = width;
    setText(this.more, found.more ? `The nearest ${MOST} of them; a name leads to others.` : "");
    this.choose(this.nodes[0]);
    this.refresh();
  }

  /** The drawn nodes of the way in use. */
  inUse() {
    const { needs = {}, ahead = {} } = this.tables;
    const used = { signals: new Set(), relations: new Set(), variables: new Set() };
    for (const [name, { variable, way }] of Object.entries(needs)) {
      const serving = (ahead[name] ?? []).find(({ words }) => words === way);
      if (variable !== this.focus || !serving) continue;
      serving.signals.forEach((signal) => used.signals.add(signal));
      serving.relations.forEach((relation) => used.relations.add(relation));
      used.variables.add(variable);
    }
    for (const signal of used.signals) used.variables.add(this.structure.signals.get(signal)?.variable);
    return used;
  }

  /** Marks the verdicts of the signals, and the way in use. */
  refresh() {
    const { signals = {}, conflicts = {} } = this.tables;
    const used = this.inUse();
    const isUsed = ({ kind, name }) => used[`${kind}s`].has(name);
    // Intermediate variables belong to the way.
    for (const { from, to } of this.edges) if (from.kind === "relation" && isUsed(from) && this.isRead(to, used)) used.variables.add(to.name);
    for (const node of this.nodes) {
      const verdict = node.kind === "signal" ? signals[node.name]?.verdict ?? "unknown" : "";
      const sign = verdict ? `${signed(verdict).split(" ")[0]} ` : "";
      setText(node.text, sign + shortened(node.name));
      const classes = ["node", node.kind, verdict, isUsed(node) ? "used" : "", node.key === this.chosen ? "chosen" : ""];
      const name = classes.filter(Boolean).join(" ");
      if (node.element.getAttribute("class") !== name) {
        node.element.setAttribute("class", name);
        node.element.setAttribute("aria-label", `${node.kind} ${node.name}${verdict ? `, ${verdict}` : ""}${isUsed(node) ? ", in use" : ""}`);
      }
    }
    for (const { from, to, line } of this.edges) {
      const isPath = isUsed(from) && isUsed(to) && (from.kind !== "signal" || used.signals.has(from.name));
      line.setAttribute("class", isPath ? "edge used" : "edge");
    }
    const shown = JSON.stringify(conflicts);
    if (shown !== this.drawn) {
      this.drawn = shown;
      this.conflicts.replaceChildren(...Object.values(conflicts).flatMap((conflict) => this.links(conflict)));
    }
    this.tell();
  }

  /** Whether the way in use reads a variable. */
  isRead(variable, used) {
    return variable.name === this.focus || this.edges.some(({ from, to }) => from === variable && to.kind === "relation" && used.relations.has(to.name));
  }

  /** The conflicts between the signals of two ways. */
  links({ variable, one, other }) {
    const node = (name) => this.nodes.find(({ key }) => key === `signal ${name}`);
    const only = (these, those) => these.filter((name) => !those.includes(name)).map(node).filter(Boolean);
    const pairs = only(one, other).flatMap((from) => only(other, one).map((to) => [from, to]));
    return pairs.map(([from, to]) => drawn("path", { class: "conflict", d: arc(from, to) }, [drawn("title", {}, [`${from.name} and ${to.name} contradict each other about ${variable}`])]));
  }

  choose(node) {
    this.chosen = node.key;
    this.told = "";
    this.refresh();
  }

  /** The details of the selected node. */
  tell() {
    const node = this.nodes.find(({ key }) => key === this.chosen);
    if (!node) return;
    const facts = this.facts(node);
    const told = JSON.stringify([node.key, facts]);
    if (told === this.told) return;
    const isSame = this.told && JSON.parse(this.told)[0] === node.key;
    this.told = told;
    const values = this.about.querySelectorAll("dd");
    if (isSame && values.length === facts.length) return facts.forEach(([, value], at) => setText(values[at], value));
    const list = made("dl", { children: facts.flatMap(([word, value]) => [made("dt", { text: word }), made("dd", { text: value })]) });
    const buttons = made("div", { className: "row" });
    const button = (text, act) => {
      const element = made("button", { text });
      element.type = "button";
      element.addEventListener("click", act);
      buttons.append(element);
    };
    const variable = this.structure.variableOf(node.name);
    if (variable && variable !== this.focus) button("Around it", () => this.draw(variable));
    if (node.kind !== "relation") button("Its bands", () => this.showBands(variable));
    this.about.replaceChildren(made("h3", { text: `${node.kind} ${node.name}` }), list, buttons);
  }

  facts({ kind, name }) {
    const { signals = {}, readings = {} } = this.tables;
    const { variables, relations, carriers, producers } = this.structure;
    const names = (list) => list.map((it) => it.name ?? it).join(", ") || "none";
    if (kind === "variable") {
      return [["unit", variables.get(name).unit ?? "none"], ["signals", names(carriers.get(name) ?? [])], ["computed by", names(producers.get(name) ?? [])]];
    }
    if (kind === "relation") {
      const { text, inputs, outputs } = relations.get(name);
      return [["equation", text || "structure only"], ["reads", names(inputs)], ["gives", names(outputs)]];
    }
    const { source, rate_hz: rate, derived_from: origins } = this.structure.signals.get(name);
    const { verdict = "unknown", symptom, unit, is_list: isList } = signals[name] ?? {};
    const [lo, hi, last] = readings[name] ?? [];
    return [
      ["verdict", signed(verdict) + (symptom ? ` (${symptom})` : "")],
      ["value", isList ? spread(lo, hi, unit) : enclosed(lo, hi, unit)],
      ["age", last == null ? "never" : `${age(this.now, last)}, ${clock(last)}`],
      ["source", source || "its name"],
      ["rate", rate ? `${rate} Hz` : "when it comes"],
      ...(origins.length ? [["derived from", origins.join(", ")]] : []),
    ];
  }
}
