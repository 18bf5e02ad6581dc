// The package as it is installed: what it offers, and what the command prints of the same inputs, byte for byte.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { existsSync, readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { Engine, Model, ShsaError, check, doctor, draft, info, replay } from '@shsa/engine';

const ROOT = process.env.SHSA_ROOT;
const COMMAND = process.env.SHSA_COMMAND;
const DATA = join(ROOT, '..', 'shared', 'data', 'formats');
process.chdir(ROOT);

/** What the command prints, without its line end. */
function command(...words) {
  const { stdout } = spawnSync(COMMAND, words, { encoding: 'utf8', maxBuffer: 1 << 28 });
  return stdout.trimEnd();
}

const untimed = (json) => json.replace(/"elapsed_s":[^,]*/, '"elapsed_s":0.0');
const car = () => new Model(readFileSync('examples/car.yaml', 'utf8'), { name: 'examples/car.yaml' });
const needed = { skip: COMMAND ? false : 'SKIPPED: no command to compare with' };

test('the example is read, examined and drafted as by the command', needed, () => {
  for (const folder of ['examples/monday', 'examples/tuesday', 'examples/boiler']) {
    const files = readdirSync(folder).filter((name) => name.endsWith('.csv')).sort().map((name) => join(folder, name));
    assert.equal(JSON.stringify(info(files)), JSON.stringify(JSON.parse(command('info', '--json', ...files))));
    assert.equal(doctor(files).json, command('doctor', '--json', ...files), folder);
    assert.equal(draft(files).trimEnd(), command('draft', ...files), folder);
  }
});

test('a replay decides as the command does, with and without faults', needed, () => {
  const faults = [[], ['bias=3:/gnss/speed@20s..'], ['noise=2:/radar/speed@5s..', 'drop:/wheel/turns@30s..40s'], ['stuck:/gnss/speed@10s..', 'delay=600ms:/radar/speed']];
  for (const inject of faults) {
    const words = inject.flatMap((fault) => ['--inject', fault]);
    const played = replay(car(), 'examples/monday', { inject });
    assert.equal(untimed(played.json), untimed(command('replay', 'examples/car.yaml', 'examples/monday', '--json', ...words)));
  }
});

test('an analysis and an explanation are those of the command', needed, () => {
  assert.equal(JSON.stringify(car().analyze()), JSON.stringify(JSON.parse(command('analyze', '--json', 'examples/car.yaml'))));
  const inject = 'bias=3:/gnss/speed@20s..';
  const told = command('explain', '--json', 'examples/car.yaml', 'examples/monday', '/gnss/speed', '--inject', inject);
  const explained = replay(car(), 'examples/monday', { inject }).explain('/gnss/speed');
  assert.equal(JSON.stringify(explained), JSON.stringify(JSON.parse(told)));
  const model = readFileSync('models/quad.yaml', 'utf8');
  assert.equal(JSON.stringify(check(model, 'models/quad.yaml')), JSON.stringify(JSON.parse(command('check', '--json', 'models/quad.yaml'))));
});

test('each sample of a format is read as by the command', { skip: existsSync(DATA) && COMMAND ? false : `SKIPPED: no samples at ${DATA}` }, () => {
  for (const family of readdirSync(DATA)) {
    const folder = join(DATA, family);
    if (!existsSync(join(folder, 'expected.json'))) continue;
    for (const name of readdirSync(folder).filter((it) => !/\.(json|md|py|dbc)$/.test(it))) {
      const file = join(folder, name);
      let own;
      try {
        own = JSON.stringify(info(file));
      } catch (error) {
        assert.ok(error instanceof ShsaError, `${file}: ${error.stack}`);
        own = '';
      }
      const told = command('info', '--json', file);
      assert.equal(own, told && JSON.stringify(JSON.parse(told)), file);
    }
  }
});

test('files come as paths, text, bytes and pieces', () => {
  const data = readFileSync('examples/monday/wheel.csv');
  const piece = { name: 'wheel.csv', size: data.length, read: (from, length) => data.subarray(from, from + length) };
  const forms = [{ name: 'wheel.csv', data: data.toString() }, { name: 'wheel.csv', data }, { name: 'wheel.csv', data: data.buffer.slice(data.byteOffset, data.byteOffset + data.length) }, piece];
  const [first, ...others] = forms.map((form) => JSON.stringify(info(form)));
  others.forEach((other) => assert.equal(other, first));
  assert.throws(() => info({ ...piece, read: () => { throw new Error('gone'); } }), (error) => error instanceof ShsaError && error.message.includes('wheel.csv'));
});

test('errors are values with their places and with help', () => {
  const wrong = 'shsa: 1\nvariables: {}\nsignals: { a: { variable: b } }\n';
  assert.throws(() => new Model(wrong, { name: 'car.yaml' }), (error) => error instanceof ShsaError && error.diagnostics[0].line === 3);
  assert.equal(check(wrong).diagnostics[0].column, 27);
  assert.throws(() => replay(car(), 'examples/monday', { inject: 'bias=3:/gnss/sped' }), /did you mean '\/gnss\/speed'/);
  assert.throws(() => replay(car(), 'examples/monday', { inject: 'lies' }), ShsaError);
  assert.throws(() => info({ name: 'x.pdf', data: 'no recording' }), ShsaError);
  assert.throws(() => new Engine(car()).handle('nobody', 1), /the model has no signal 'nobody'/);
});

test('progress is told', () => {
  const told = [];
  doctor('examples/monday', { onProgress: (done, count, what) => told.push([done, count, what]) });
  assert.ok(told.length > 3 && told.every(([done, count, what]) => done <= count && what.length > 0));
});

test('an engine goes on from its snapshot', () => {
  const engine = new Engine(car());
  for (let step = 0; step < 400; step += 1) {
    engine.handle('/gnss/speed', 13 + (step < 200 ? 0 : 4), { time: step * 100 });
    engine.handle('/radar/speed', 13, { time: step * 100 + 10 });
    engine.handle('/wheel/turns', { lo: 12.9 / (0.3 * 2 * Math.PI), hi: 13.1 / (0.3 * 2 * Math.PI) }, { time: BigInt(step * 100 + 20) * 1_000_000n });
  }
  const { values, events } = engine.outputs();
  assert.ok(values.length > 100 && events.length > 0 && values[0].signal === '/car/speed', JSON.stringify(events));
  const again = new Engine(car());
  again.restore(engine.snapshot(), 40_000);
  assert.equal(again.verdict('/gnss/speed'), engine.verdict('/gnss/speed'));
  engine.advance(60_000);
  assert.equal(engine.verdict('/radar/speed'), 'silent');
});

test('the examples run', () => {
  const run = (name) => execFileSync(process.execPath, [`${process.env.SHSA_PACKAGE}/examples/${name}`], { encoding: 'utf8' });
  assert.match(run('findings.js'), /middle reads 1\.98 too much/);
  assert.match(run('live.js'), /10\.\d s: failed gnss[^]*gnss is failed/);
});
