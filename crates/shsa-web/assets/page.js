// Starts the page: passes the data of the stream to the views, and shows the view that the address names.

import { Stream, ask } from "./stream.js";
import { Needs } from "./needs.js";
import { Signals } from "./signals.js";
import { Timeline } from "./timeline.js";
import { Orders } from "./orders.js";
import { Bands } from "./bands.js";
import { Graph } from "./graph.js";
import { WhatIf } from "./whatif.js";
import { made, setText } from "./words.js";

const link = document.getElementById("link");
const choice = document.getElementById("model");
const orders = new Orders();
const token = () => orders.token();
const bands = new Bands({ token });
const timeline = new Timeline({ token, show: showBands });
const views = {
  needs: new Needs({ show: showBands }),
  signals: new Signals({ show: showBands }),
  bands,
  graph: new Graph({ token, show: showBands }),
  "what-if": new WhatIf({ token }),
  orders,
};
let model = null;
let current = "needs";
/** The model whose past is drawn. */
let recalled = null;

/** Shows the view that the address names; a wide page has the timeline beside it. */
function turn(isAsked) {
  const name = location.hash.slice(1);
  const section = document.getElementById(name);
  current = section?.localName === "section" ? name : "needs";
  for (const other of document.querySelectorAll("main > section")) {
    other.hidden = other.id !== current && other.id !== "timeline";
  }
  document.body.classList.toggle("only-timeline", current === "timeline");
  for (const anchor of document.querySelectorAll("nav a")) {
    if (anchor.hash === `#${current}`) anchor.setAttribute("aria-current", "page");
    else anchor.removeAttribute("aria-current");
  }
  scrollTo(0, 0);
  if (isAsked) document.getElementById(current).focus({ preventScroll: true });
}

/** Opens the bands of a variable, or of the variable of a signal, at a moment. */
function showBands(name, moment = null) {
  location.hash = "bands";
  bands.follow(stream.models[model]?.signals?.[name]?.variable ?? name, moment);
}

/** Shows the state of the connection; without one the page looks stale. */
function tell(words, isStale) {
  setText(link, words);
  link.classList.toggle("stale", isStale);
  document.body.classList.toggle("stale-page", isStale);
}

/** Offers the models if there are several, and keeps the selected one. */
function follow(models) {
  const names = Object.keys(models);
  if (names.join("\n") !== [...choice.options].map((option) => option.value).join("\n")) {
    choice.replaceChildren(...names.map((name) => new Option(name, name)));
    document.getElementById("model-choice").hidden = names.length < 2;
    if (names.includes(model)) choice.value = model;
  }
  if (model === choice.value) return;
  model = choice.value;
  for (const view of Object.values(views)) view.reset(model);
  recalled = null;
}

/** Fetches what the run remembers of the needs, once for each model. */
async function recall() {
  if (model === null || recalled === model) return;
  recalled = model;
  const of = model;
  try {
    const past = await (await ask(`/past?${new URLSearchParams({ model })}`, token())).json();
    if (model === of) views.needs.recall(past);
  } catch {
    // The next connection asks again; until then the past begins with this page.
  }
}

/** Leads to the pages of other instances, to the same view. */
function lead(others) {
  const element = document.getElementById("others");
  const known = JSON.stringify([others, location.hash]);
  if (element.dataset.known === known) return;
  element.dataset.known = known;
  element.hidden = others.length === 0;
  element.replaceChildren(...others.map(([name, url]) => {
    if (url === null) return made("span", { className: "soft", text: `${name}: its page is on its own machine only` });
    const link = made("a", { text: `→ ${name}` });
    link.href = url.split("#")[0] + location.hash;
    return link;
  }));
}

const stream = new Stream({
  token,
  heard: ({ head, models, events, isNew }) => {
    document.title = `${head.name} · shsa`;
    setText(document.getElementById("name"), head.name);
    tell(head.link === null ? `live · shsa ${head.version}` : `✗ the bus is not connected: ${head.link}`, head.link !== null);
    lead(head.others ?? []);
    follow(models);
    timeline.take(events, isNew);
    orders.take(events, isNew);
    bands.take(events, isNew);
    for (const [name, view] of Object.entries(views)) view.show(models[model] ?? {}, head.time_ns, name === current);
    if (isNew) recalled = null;
    recall();
  },
  lost: (why, seconds) => tell(`✗ stale for ${seconds} s: ${why}`, true),
});

orders.tokenChanged = () => stream.again();
addEventListener("hashchange", () => turn(true));
turn(false);
stream.run();
