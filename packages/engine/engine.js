// Between JavaScript and WebAssembly: starts it, makes errors of its problems, and gives it files.
import load, * as wasm from './wasm/shsa.js';

export { wasm };

/** Why something cannot be done; `diagnostics` have file, line, column, message and help. */
export class ShsaError extends Error {
  constructor(message, diagnostics = []) {
    super(message);
    this.name = 'ShsaError';
    this.diagnostics = diagnostics;
  }
}

let broken = null;

/** Starts the engine from its bytes or its address, once. */
export async function start(from) {
  await load({ module_or_path: from });
}

/** What `act` returns; what it throws becomes a ShsaError. */
export function call(act) {
  if (broken) throw new ShsaError(broken);
  try {
    return act();
  } catch (thrown) {
    if (typeof thrown === 'string') {
      const { message, diagnostics } = JSON.parse(thrown);
      throw new ShsaError(message, diagnostics);
    }
    if (thrown instanceof WebAssembly.RuntimeError || thrown instanceof RangeError) {
      const why = wasm.last_panic() ?? thrown.message;
      broken = `the engine has a defect and has ended (${why}); start it again in a new worker or process, and report it`;
      throw new ShsaError(broken);
    }
    throw thrown;
  }
}

/** How this platform reads a path; browsers have none. */
export const given = {
  path() {
    throw new ShsaError('there are no paths in a browser: give a File, or { name, data }');
  },
};

/** Gives files to `act` as recordings, and lets go of them after it. */
export function withRecordings(files, options, act) {
  const opened = [];
  try {
    const recordings = call(() => new wasm.Recordings(JSON.stringify(options)));
    for (const file of [files].flat()) {
      // A path may be that of a folder; what a recorder has not written back belongs to the file beside it.
      const own = typeof file === 'string' ? given.path(file) : [file];
      opened.push(...own);
      own.forEach((one) => add(recordings, one));
      const name = typeof file === 'string' ? file : file.name;
      if (!name.endsWith('-wal')) recordings.open(name);
    }
    return act(recordings);
  } finally {
    opened.forEach((file) => file.close?.());
  }
}

function add(recordings, file) {
  if (typeof file.read === 'function') {
    recordings.add_pieces(file.name, file.size, file.read);
  } else if (typeof Blob !== 'undefined' && file instanceof Blob) {
    recordings.add_pieces(file.name, file.size, blobReader(file));
  } else if (file.data !== undefined) {
    recordings.add(file.name, bytes(file.data));
  } else {
    throw new ShsaError('a recording is a path, a File, { name, data } or { name, size, read }');
  }
}

function bytes(data) {
  if (typeof data === 'string') return new TextEncoder().encode(data);
  return ArrayBuffer.isView(data) ? new Uint8Array(data.buffer, data.byteOffset, data.byteLength) : new Uint8Array(data);
}

/** Reads pieces of a file that was dropped; only workers may wait for it. */
function blobReader(blob) {
  if (typeof FileReaderSync === 'undefined') {
    throw new ShsaError('a File is read in pieces only in a Web Worker; elsewhere give { name, data: await file.arrayBuffer() }');
  }
  const reader = new FileReaderSync();
  return (from, length) => new Uint8Array(reader.readAsArrayBuffer(blob.slice(from, from + length)));
}
