// The studio: a recording is dropped, its faults are shown, its model is edited, faults are tried.
import { byId, element, keep } from './dom.js';
import { example } from './example.js';
import * as kept from './kept.js';
import { showContent, showDiagnostics, showFindings, showReplay } from './shown.js';
import { Work } from './work.js';

const SECTIONS = ['views', 'wrong', 'content', 'model', 'what-if', 'take'];
/** How long after the last key a model is checked, and kept. */
const PAUSE_MS = 300;

const state = { files: [], name: '', found: null, text: '', valid: '', inject: [] };
const work = new Work(hear);

function hear({ progress, content }) {
  if (content) tell('Looking for what contradicts itself …');
  if (!progress) return;
  const bar = byId('progress');
  bar.hidden = false;
  [bar.max, bar.value] = [Math.max(progress.count, 1), progress.done];
  tell(`${progress.done} of ${progress.count} ${progress.what}`);
}

function tell(text, problem = '') {
  byId('told').textContent = text;
  byId('problem').textContent = problem;
}

/** Does something that takes a while; tells why where it fails. */
async function during(words, act) {
  tell(words);
  try {
    await act();
    tell('');
  } catch (error) {
    tell('', error.message);
  }
  byId('progress').hidden = true;
}

/** Looks at files, and shows what was found; `before` is what was kept of them. */
async function open(files, before = {}) {
  if (files.length === 0) return;
  work.restart();
  Object.assign(state, { files, found: null, text: '', valid: '', inject: before.inject ?? [] });
  SECTIONS.forEach((id) => { byId(id).hidden = true; });
  const began = performance.now();
  delete document.documentElement.dataset.done;
  await during(`Reading ${files.map((file) => file.name).join(', ')} …`, async () => {
    const found = await work.ask('examine', { files });
    state.found = found;
    SECTIONS.forEach((id) => { byId(id).hidden = false; });
    showFindings(found);
    showContent(found);
    document.body.classList.add('small-dropped');
    byId('forget').hidden = false;
    await setModel(before.text ?? found.model);
    showCommand();
    if (state.inject.length > 0) await replay();
    else clearReplay();
  });
  const took = Math.round(performance.now() - began);
  if (state.found) tell(`${files.map((file) => file.name).join(', ')}: examined in ${(took / 1000).toFixed(1)} s`);
  Object.assign(document.documentElement.dataset, { done: files[0].name, took });
  if (state.found && !before.text) byId('wrong').focus();
}

async function setModel(text) {
  byId('model-text').value = text;
  await edited();
}

/** Checks what was written, and keeps it. */
async function edited() {
  const text = byId('model-text').value;
  state.text = text;
  await kept.put('text', text);
  const checked = await work.ask('check', { text });
  if (text !== byId('model-text').value) return;
  showDiagnostics(checked, turnTo);
  if (!checked.ok) return;
  state.valid = text;
  const { svg, signals } = await work.ask('model', { text });
  draw(svg);
  const chosen = byId('fault-signal').value;
  byId('fault-signal').replaceChildren(...signals.map(({ name, unit }) => element('option', { value: name }, unit ? `${name}, ${unit}` : name)));
  if (signals.some(({ name }) => name === chosen)) byId('fault-signal').value = chosen;
}

function draw(svg) {
  const [before] = byId('graph-drawing').children;
  if (before?.src) URL.revokeObjectURL(before.src);
  const drawing = typeof svg === 'string'
    ? element('img', { alt: 'Variables, the relations between them, and the signals that measure them', src: URL.createObjectURL(new Blob([svg], { type: 'image/svg+xml' })) })
    : element('p', {}, svg.why);
  byId('graph-drawing').replaceChildren(drawing);
}

/** Puts the cursor of the text to a place. */
function turnTo(line, column) {
  const text = byId('model-text');
  const lines = text.value.split('\n');
  const at = lines.slice(0, line - 1).reduce((sum, it) => sum + it.length + 1, 0) + column - 1;
  text.focus();
  text.setSelectionRange(at, at);
  text.scrollTop = Math.max(0, line - 5) * 20;
}

/** The fault of the form, as the command writes it. */
function fault() {
  const value = (id) => byId(id).value.trim();
  const kind = value('fault-kind');
  const amount = { drop: '', stuck: '', delay: `=${value('fault-amount')}s` }[kind] ?? `=${value('fault-amount')}`;
  const [from, to] = [value('fault-from'), value('fault-to')].map((time) => (time === '' ? '' : `${time}s`));
  const stretch = from || to ? `@${from || '0s'}..${to}` : '';
  return `${kind}${amount}:${value('fault-signal')}${stretch}`;
}

async function replay() {
  await during('Replaying …', async () => {
    const played = await work.ask('replay', { text: state.valid, inject: state.inject });
    showReplay(played, state.inject);
    byId('take-replay').disabled = false;
    showCommand();
  });
}

function clearReplay() {
  byId('replay-told').textContent = '';
  byId('take-replay').disabled = true;
  byId('decisions-head').hidden = true;
  byId('needs').replaceChildren();
  byId('decisions').replaceChildren();
}

/** A word as a shell takes it. */
function quoted(word) {
  return /^[\w./:=,@+%-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
}

function showCommand() {
  const files = state.files.map((file) => quoted(file.name)).join(' ');
  const faults = state.inject.map((it) => ` --inject ${quoted(it)}`).join('');
  byId('command').textContent = `shsa doctor ${files} --html report.html -o model.yaml\nshsa replay model.yaml ${files}${faults} --report replay.html`;
}

async function forget() {
  await kept.clear();
  history.replaceState(null, '', location.pathname);
  location.reload();
}

/** Files that a person gave: kept for the next time. */
async function given(files) {
  if (files.length === 0) return;
  history.replaceState(null, '', location.pathname);
  await kept.clear();
  await kept.put('files', files);
  await open(files);
}

async function openExample() {
  let files = [];
  await during('Loading the example …', async () => { files = await example(); });
  const isSame = (await kept.take('example')) === true;
  const before = isSame ? { text: await kept.take('text'), inject: await kept.take('inject') } : {};
  if (!isSame) await kept.clear();
  await kept.put('example', true);
  await open(files, before);
}

/** What was being done when the page was left. */
async function begin() {
  if (location.hash === '#example=car') return openExample();
  const files = await kept.take('files');
  if (files) return open(files, { text: await kept.take('text'), inject: await kept.take('inject') });
  if (await kept.take('example')) return openExample();
  return undefined;
}

function listen() {
  const zone = byId('zone');
  const over = (is) => (event) => {
    event.preventDefault();
    zone.classList.toggle('over', is);
  };
  ['dragenter', 'dragover'].forEach((name) => document.addEventListener(name, over(true)));
  ['dragleave', 'drop'].forEach((name) => document.addEventListener(name, over(false)));
  document.addEventListener('drop', (event) => given([...event.dataTransfer.files]));
  let width = innerWidth;
  addEventListener('resize', () => {
    if (state.found && innerWidth !== width) showFindings(state.found);
    width = innerWidth;
  });
  byId('files').addEventListener('change', (event) => given([...event.target.files]));
  byId('forget').addEventListener('click', forget);
  addEventListener('hashchange', () => location.hash === '#example=car' && openExample());
  let pause;
  byId('model-text').addEventListener('input', () => {
    clearTimeout(pause);
    pause = setTimeout(() => edited().catch((error) => tell('', error.message)), PAUSE_MS);
  });
  byId('model-own').addEventListener('click', () => setModel(state.found.model));
  byId('model-tidy').addEventListener('click', async () => setModel(await work.ask('tidy', { text: state.valid })));
  byId('fault-kind').addEventListener('change', ({ target }) => {
    byId('fault-amount-label').hidden = ['drop', 'stuck'].includes(target.value);
  });
  byId('fault').addEventListener('submit', (event) => {
    event.preventDefault();
    tryFaults([fault()]);
  });
  byId('fault-none').addEventListener('click', () => tryFaults([]));
  byId('take-model').addEventListener('click', () => keep('model.yaml', state.text, 'text/yaml'));
  byId('take-report').addEventListener('click', async () => keep('report.html', await work.ask('report'), 'text/html'));
  byId('take-replay').addEventListener('click', async () => keep('replay.html', await work.ask('replayReport'), 'text/html'));
}

async function tryFaults(inject) {
  state.inject = inject;
  await kept.put('inject', inject);
  await replay();
}

listen();
begin().catch((error) => tell('', error.message));
