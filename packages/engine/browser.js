// The entry for browsers: loads the engine from beside this file.
import { start } from './engine.js';

await start(new URL('./wasm/shsa_bg.wasm', import.meta.url));

export * from './api.js';
