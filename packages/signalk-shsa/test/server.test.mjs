// The plugin in a real Signal K server: a lying receiver is named, and its path is healed from the others.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { cpSync, mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import test from 'node:test';
import { setTimeout as pause } from 'node:timers/promises';

const { SIGNALK, SHSA_PACKAGE, SHSA_PLUGIN } = process.env;
const PATIENCE_MS = 60_000;

const MODEL = `shsa: 1
variables: { speed: { unit: m/s, range: [0, 30], max_rate: 3 m/s^2 } }
signals:
  log: { variable: speed, source: "navigation.speedThroughWater[source=log.1]", rate: 10 Hz, value_error: 0.3, timeout: 3 s }
  gps: { variable: speed, source: "navigation.speedOverGround[source=gps.1]", rate: 10 Hz, value_error: 0.3, timeout: 3 s }
  dgps: { variable: speed, source: "navigation.speedOverGround[source=dgps.1]", rate: 10 Hz, value_error: 0.3, timeout: 3 s }
needs: { speed: { signal: navigation.healedSpeed, max_age: 3 s } }
`;

async function freePort() {
  const server = createServer().listen(0, '127.0.0.1');
  await new Promise((resolve) => server.once('listening', resolve));
  const { port } = server.address();
  await new Promise((resolve) => server.close(resolve));
  return port;
}

/** A folder of settings with the plugin in it, as the server's app store installs it. */
function configured(port) {
  const folder = mkdtempSync(join(tmpdir(), 'shsa-signalk-'));
  const modules = join(folder, 'node_modules');
  mkdirSync(join(modules, '@shsa'), { recursive: true });
  cpSync(SHSA_PACKAGE, join(modules, '@shsa/engine'), { recursive: true });
  cpSync(SHSA_PLUGIN, join(modules, 'signalk-shsa'), { recursive: true });
  mkdirSync(join(folder, 'plugin-config-data'));
  const write = (name, content) => writeFileSync(join(folder, name), JSON.stringify(content));
  write('package.json', { name: 'boat', dependencies: { 'signalk-shsa': '*' } });
  write('settings.json', { port, interfaces: {}, pipedProviders: [], vessel: { name: 'Test', uuid: 'urn:mrn:signalk:uuid:c0d79334-4e25-4245-8892-54e8ccc8021d' } });
  write('plugin-config-data/signalk-shsa.json', { enabled: true, configuration: { model: MODEL } });
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

test('a lying receiver is named, and its path is healed', { skip: SIGNALK ? false : 'SKIPPED: no Signal K server' }, async () => {
  const port = await freePort();
  const folder = configured(port);
  const server = spawn(process.execPath, [join(SIGNALK, 'bin/signalk-server'), '-c', folder], { env: { ...process.env, PORT: String(port) }, stdio: 'pipe' });
  let printed = '';
  [server.stdout, server.stderr].forEach((stream) => stream.on('data', (data) => { printed += data; }));
  let sending;
  try {
    const get = async (path) => {
      const answer = await fetch(`http://127.0.0.1:${port}${path}`);
      return answer.ok ? answer.text() : null;
    };
    await eventually('the server is up', () => get('/signalk'));
    const { WebSocket: Own } = globalThis;
    const Socket = Own ?? (await import(join(SIGNALK, '../ws/wrapper.mjs'))).default;
    const socket = new Socket(`ws://127.0.0.1:${port}/signalk/v1/stream?subscribe=none`);
    await new Promise((resolve, reject) => { socket.onopen = resolve; socket.onerror = reject; });
    let lie = 0;
    let step = 0;
    sending = setInterval(() => {
      step += 1;
      const timestamp = new Date().toISOString();
      const value = 5 + Math.sin(step / 100);
      const update = ($source, path, of) => ({ $source, timestamp, values: [{ path, value: of }] });
      const updates = [update('log.1', 'navigation.speedThroughWater', value), update('gps.1', 'navigation.speedOverGround', value + lie), update('dgps.1', 'navigation.speedOverGround', value + 0.05)];
      socket.send(JSON.stringify({ context: 'vessels.self', updates }));
    }, 100);
    const self = '/signalk/v1/api/vessels/self';
    const healed = async () => JSON.parse((await get(`${self}/navigation/healedSpeed`)) ?? 'null');
    const first = await eventually('a value is published', healed);
    assert.equal(first.$source, 'shsa');
    lie = 3;
    const told = await eventually('the receiver is named', async () => {
      const notification = JSON.parse((await get(`${self}/notifications/shsa/gps`)) ?? 'null');
      return notification?.value.message.includes('failed') ? notification : null;
    });
    assert.equal(told.value.state, 'alarm');
    const after = await healed();
    assert.ok(Math.abs(after.value - 5) < 1.5, JSON.stringify(after));
    const draft = await eventually('a draft', () => get('/plugins/signalk-shsa/draft'));
    assert.match(draft, /navigation\.speedThroughWater/);
    socket.close();
  } catch (error) {
    error.message += `\n${printed.slice(-4000)}`;
    throw error;
  } finally {
    clearInterval(sending);
    server.kill();
    rmSync(folder, { recursive: true, force: true });
  }
});
