// Time of a step in WebAssembly: `node playground/measure/steps.mjs PROGRAM.wasm SCENE.toml STEPS`.
//
// The program runs in Node's engine, which is Chromium's. It prints the least and the median time of
// a step over at least eight runs and three seconds.

import { readFileSync } from "node:fs";

// Least number of runs, and least time of all (ms): the engine compiles what is hot.
const RUNS = 8;
const TIME = 3000;
// Steps of one request, as in a fast page.
const CHUNK = 32;
const [, , program, scene, steps] = process.argv;
const module = new WebAssembly.Module(readFileSync(program));
const { memory, tumble_playground: call } = new WebAssembly.Instance(module, {}).exports;

function ask(request) {
  const bytes = new TextEncoder().encode(JSON.stringify(request));
  const place = call(bytes.length) >>> 0;
  new Uint8Array(memory.buffer, place, bytes.length).set(bytes);
  const answer = call(0) >>> 0;
  const [text, length] = new Uint32Array(memory.buffer, answer, 2);
  const found = JSON.parse(new TextDecoder().decode(new Uint8Array(memory.buffer, text, length)));
  if (found.error) throw new Error(found.error);
}

ask({ do: "open", text: readFileSync(scene, "utf8") });
const times = [];
const begin = performance.now();
while (times.length < RUNS || performance.now() - begin < TIME) {
  ask({ do: "restart" });
  const start = performance.now();
  for (let left = Number(steps); left > 0; left -= CHUNK) {
    ask({ do: "step", count: Math.min(CHUNK, left), contacts: false });
  }
  times.push(((performance.now() - start) / Number(steps)) * 1000);
}
times.sort((a, b) => a - b);
console.log(`least ${times[0].toFixed(2)} µs, median ${times[times.length >> 1].toFixed(2)} µs a step`);
