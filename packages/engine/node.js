// The entry for Node.js: reads the engine from the package, and recordings from paths.
import { closeSync, existsSync, fstatSync, openSync, readSync, readdirSync, statSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { join } from 'node:path';
import { start, given } from './engine.js';

await start(await readFile(new URL('./wasm/shsa_bg.wasm', import.meta.url)));

/** A file, or the files of a folder, which are read in pieces; a database of SQLite with the newest pages beside it. */
given.path = (path) => {
  const all = statSync(path).isDirectory() ? readdirSync(path).map((name) => join(path, name)) : [path, `${path}-wal`].filter(existsSync);
  return all.filter((file) => statSync(file).isFile()).map(onDisk);
};

function onDisk(path) {
  const descriptor = openSync(path, 'r');
  const { size } = fstatSync(descriptor);
  const read = (from, length) => {
    const bytes = new Uint8Array(length);
    const count = readSync(descriptor, bytes, 0, length, from);
    return bytes.subarray(0, count);
  };
  return { name: path, size, read, close: () => closeSync(descriptor) };
}

export * from './api.js';
