// The nodes in a real Node-RED: a lying sensor is named and replaced, silence is found, and models are checked by line.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { cpSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import test from 'node:test';
import { setTimeout as pause } from 'node:timers/promises';

const { NODE_RED, SHSA_PACKAGE, SHSA_NODES } = process.env;
const PATIENCE_MS = 60_000;
const skip = NODE_RED ? false : 'SKIPPED: no Node-RED';

const MODEL = `shsa: 1
variables: { speed: { unit: m/s, range: [0, 30], max_rate: 3 m/s^2 } }
signals:
  log: { variable: speed, source: boat/log, rate: 10 Hz, value_error: 0.3, timeout: 2 s }
  gps: { variable: speed, rate: 10 Hz, value_error: 0.3, timeout: 2 s }
  dgps: { variable: speed, rate: 10 Hz, value_error: 0.3, timeout: 2 s }
needs: { speed: { signal: healed, max_age: 2 s } }
`;

/** What comes out of a node is kept under a name, and answered at /kept. */
function keeping(id, name) {
  const func = `global.set('${name}', [...(global.get('${name}') ?? []), msg.status ? { ...msg.status } : msg].slice(-200));`;
  return { id, type: 'function', z: 'tab', name, func, outputs: 0, wires: [] };
}

const FLOWS = [
  { id: 'tab', type: 'tab', label: 'boat' },
  { id: 'model', type: 'shsa-model', name: '', model: MODEL },
  { id: 'broken', type: 'shsa-model', name: '', model: MODEL.replace('variable: speed, rate', 'variable: spede, rate') },
  { id: 'in', type: 'http in', z: 'tab', url: '/reading', method: 'post', wires: [['open']] },
  { id: 'open', type: 'function', z: 'tab', func: 'return [{ ...msg.payload }, { ...msg, payload: "" }];', outputs: 2, wires: [['heal'], ['answer']] },
  { id: 'heal', type: 'shsa', z: 'tab', model: 'model', wires: [['values'], ['events']] },
  { id: 'lost', type: 'shsa', z: 'tab', model: 'broken', wires: [[], []] },
  keeping('values', 'values'),
  keeping('events', 'events'),
  { id: 'status', type: 'status', z: 'tab', scope: ['heal'], wires: [['rings']] },
  keeping('rings', 'rings'),
  { id: 'catch', type: 'catch', z: 'tab', scope: ['heal'], wires: [['errors']] },
  { id: 'errors', type: 'function', z: 'tab', func: "global.set('errors', [...(global.get('errors') ?? []), msg.error.message]);", outputs: 0, wires: [] },
  { id: 'kept', type: 'http in', z: 'tab', url: '/kept', method: 'get', wires: [['tell']] },
  { id: 'tell', type: 'function', z: 'tab', func: "return { ...msg, payload: Object.fromEntries(['values', 'events', 'rings', 'errors'].map((name) => [name, global.get(name) ?? []])) };", outputs: 1, wires: [['answer']] },
  { id: 'answer', type: 'http response', z: 'tab', wires: [] },
].map((node) => (node.z ? { x: 100, y: 100, ...node } : node)); // Without a place it would be a configuration node.

async function freePort() {
  const server = createServer().listen(0, '127.0.0.1');
  await new Promise((resolve) => server.once('listening', resolve));
  const { port } = server.address();
  await new Promise((resolve) => server.close(resolve));
  return port;
}

/** A folder of settings with the packages in it, as the palette installs them. */
function configured(port, flows) {
  const folder = mkdtempSync(join(tmpdir(), 'shsa-node-red-'));
  const modules = join(folder, 'node_modules');
  mkdirSync(join(modules, '@shsa'), { recursive: true });
  cpSync(SHSA_PACKAGE, join(modules, '@shsa/engine'), { recursive: true });
  cpSync(SHSA_NODES, join(modules, 'node-red-contrib-shsa'), { recursive: true });
  writeFileSync(join(folder, 'package.json'), JSON.stringify({ name: 'home', dependencies: { 'node-red-contrib-shsa': '*' } }));
  writeFileSync(join(folder, 'flows.json'), JSON.stringify(flows));
  const settings = { uiHost: '127.0.0.1', uiPort: port, flowFile: 'flows.json', telemetry: { enabled: false, updateNotification: false } };
  writeFileSync(join(folder, 'settings.js'), `module.exports = ${JSON.stringify(settings)};`);
  return folder;
}

async function eventually(what, act) {
  const until = Date.now() + PATIENCE_MS;
  let last;
  while (Date.now() < until) {
    last = await act().catch((error) => error);
    if (last && !(last instanceof Error)) return last;
    await pause(100);
  }
  throw new Error(`${what}: ${last}`);
}

/** What the editor shows under a node. */
async function shownUnder(id, port) {
  // The library of the editor's own connection.
  const Socket = createRequire(createRequire(join(NODE_RED, 'red.js')).resolve('@node-red/editor-api'))('ws');
  const socket = new Socket(`ws://127.0.0.1:${port}/comms`);
  try {
    return await new Promise((resolve, reject) => {
      setTimeout(() => reject(new Error(`nothing is shown under ${id}`)), 2_000);
      socket.on('error', reject);
      socket.on('open', () => socket.send(JSON.stringify({ subscribe: 'status/#' })));
      socket.on('message', (text) => {
        [JSON.parse(text)].flat().filter(({ topic }) => topic === `status/${id}`).forEach(({ data }) => resolve(data));
      });
    });
  } finally {
    socket.close();
  }
}

/** Runs a test in a Node-RED of its own. */
async function inNodeRed(flows, act) {
  const port = await freePort();
  const folder = configured(port, flows);
  const server = spawn(process.execPath, [join(NODE_RED, 'red.js'), '--userDir', folder, '--settings', join(folder, 'settings.js')], { stdio: 'pipe' });
  let printed = '';
  [server.stdout, server.stderr].forEach((stream) => stream.on('data', (data) => { printed += data; }));
  const ask = async (path, body) => {
    const post = { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body) };
    const answer = await fetch(`http://127.0.0.1:${port}${path}`, body ? post : { headers: { Accept: 'application/json' } });
    assert.ok(answer.ok, `${path}: ${answer.status}`);
    return answer;
  };
  try {
    ask.port = port;
    await eventually('it is up', () => ask('/nodes'));
    await act(ask);
  } catch (error) {
    error.message += `\n${printed.slice(-4000)}`;
    throw error;
  } finally {
    server.kill();
    rmSync(folder, { recursive: true, force: true });
  }
}

test('a lying sensor is named and replaced, silence is found, and it ends', { skip }, () => inNodeRed(FLOWS, async (ask) => {
  const kept = async () => (await ask('/kept')).json();
  const ring = async () => (await kept()).rings.at(-1) ?? {};
  let lie = 0;
  const measure = async () => {
    // A number, the text of one with its time, and bounds; by the source, and by the names.
    await ask('/reading', { topic: 'boat/log', payload: '5.0', timestamp: new Date().toISOString() });
    await ask('/reading', { topic: 'gps', payload: 5.05 + lie, timestamp: Date.now() });
    await ask('/reading', { topic: 'dgps', payload: { lo: 4.9, hi: 5.2 } });
  };
  const measuring = (what, act) => eventually(what, async () => {
    await measure();
    return act();
  });
  await measuring('the need is served', async () => (await ring()).fill === 'green');
  const first = (await kept()).values.at(-1);
  assert.equal(first.topic, 'healed');
  assert.equal(first.quality, 'good');
  assert.ok(first.bounds.lo <= first.payload && first.payload <= first.bounds.hi, JSON.stringify(first));
  assert.match((await ring()).text, new RegExp(`^healed: good from ${first.source}$`));

  lie = 4;
  const failed = await measuring('the receiver is named', async () => (await kept()).events.find(({ payload }) => payload.kind === 'failed'));
  assert.equal(failed.topic, 'gps');
  assert.ok(failed.payload.because.length > 0);
  await measuring('others go on', async () => Math.abs((await kept()).values.at(-1).payload - 5) < 0.5);

  lie = 0;
  await eventually('silence is found', async () => (await ring()).fill === 'red');
  assert.equal((await ring()).text, 'healed: unserved');
  assert.ok((await kept()).events.some(({ payload }) => payload.kind === 'silent'));
  await measuring('it is served again', async () => ['green', 'yellow'].includes((await ring()).fill));

  await ask('/reading', { topic: 'gps', payload: 'fast' });
  const { errors } = await eventually('a text is no value', async () => ((await kept()).errors.length > 0 ? kept() : null));
  assert.match(errors[0], /gps: msg\.payload is a number/);
}));

test('a substitute is yellow', { skip }, () => inNodeRed(FLOWS, async (ask) => {
  const kept = async () => (await ask('/kept')).json();
  const measure = (names) => Promise.all(names.map((topic) => ask('/reading', { topic, payload: 5 })));
  await eventually('the need is served', async () => {
    await measure(['log', 'gps', 'dgps']);
    return (await kept()).rings.at(-1)?.fill === 'green';
  });
  const own = (await kept()).values.at(-1).source;
  const others = ['log', 'gps', 'dgps'].filter((name) => name !== own);
  await eventually('another one stands in', async () => {
    await measure(others);
    return (await kept()).rings.at(-1)?.fill === 'yellow';
  });
  const { text } = (await kept()).rings.at(-1);
  assert.ok(others.some((name) => text === `healed: substitute from ${name}`), text);
}));

test('a model is checked by line, and a wrong one is told under its nodes', { skip }, () => inNodeRed(FLOWS, async (ask) => {
  const { diagnostics } = await (await ask('/shsa/check', { model: FLOWS[2].model })).json();
  assert.deepEqual(diagnostics.filter(({ severity }) => severity === 'error').map(({ line }) => line), [5]);
  const right = await (await ask('/shsa/check', { model: MODEL })).json();
  assert.equal(right.ok, true);
  const shown = await eventually('it is told', () => shownUnder('lost', ask.port));
  assert.equal(shown.fill, 'red');
  assert.match(shown.text, /^line 5, column \d+: error: .*spede/);
}));

test('the example is a flow that works', { skip }, () => {
  const example = JSON.parse(readFileSync(join(SHSA_NODES, 'examples/thermometers.json'), 'utf8'));
  const watched = example.map((node) => (node.id === 'shsaheal' ? { ...node, wires: [['values'], ['events']] } : node));
  return inNodeRed([...watched, ...FLOWS.filter(({ id }) => ['tab', 'values', 'events', 'kept', 'tell', 'answer'].includes(id))], async (ask) => {
    const kept = async () => (await ask('/kept')).json();
    await eventually('the room is served', async () => (await kept()).values.length > 3);
    // As the button in the editor.
    await ask('/inject/shsabegin', {});
    await eventually('left is named', async () => (await kept()).events.some(({ payload }) => payload.kind === 'failed' && payload.signal === 'left'));
    const { payload } = (await kept()).values.at(-1);
    assert.ok(Math.abs(payload - 20) < 1, String(payload));
  });
});
