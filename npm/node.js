// Entry for Node.js: the WebAssembly is read from the disk.

import { readFile } from "node:fs/promises";
import { init as compile } from "./index.js";

export { Simulation } from "./index.js";

let loaded = null;

export function init(source) {
  if (source !== undefined) return compile(source);
  loaded ??= compile(readFile(new URL("./tumble.wasm", import.meta.url)));
  return loaded;
}
