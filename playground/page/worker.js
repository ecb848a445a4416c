// Worker: the program. The page stays free while a step takes long.

// Time for the steps of one picture (ms), and time up to which more steps are taken at once.
const BUDGET = 20;
const SHORT = 3;
const encoder = new TextEncoder();
const decoder = new TextDecoder();
let program = null;

// Sends one request and returns its answer with its numbers.
function ask(request) {
  const bytes = encoder.encode(JSON.stringify(request));
  const { memory, tumble_playground: call } = program.exports;
  // The memory may move during a call.
  const place = call(bytes.length) >>> 0;
  new Uint8Array(memory.buffer, place, bytes.length).set(bytes);
  const answer = call(0) >>> 0;
  const [text, length, numbers, count] = new Uint32Array(memory.buffer, answer, 4);
  const found = JSON.parse(decoder.decode(new Uint8Array(memory.buffer, text, length)));
  return { ...found, numbers: new Float64Array(memory.buffer, numbers, count).slice() };
}

// Takes up to `steps` steps within the time budget.
function advance({ steps, contacts, target }) {
  if (target) ask({ do: "pull", target });
  const start = performance.now();
  let [done, chunk, answer] = [0, 1, {}];
  while (done < steps) {
    const count = Math.min(chunk, steps - done);
    const before = performance.now();
    answer = ask({ do: "step", count, contacts });
    if (answer.error) break;
    done += count;
    const now = performance.now();
    if (now - start > BUDGET) break;
    if (now - before < SHORT) chunk *= 2;
  }
  return { ...answer, done, took: performance.now() - start };
}

onmessage = async ({ data }) => {
  if (data.module) {
    program = await WebAssembly.instantiate(data.module, {});
    return;
  }
  const { id, request } = data;
  let answer = {};
  try {
    answer = request.do === "advance" ? advance(request) : ask(request);
  } catch (error) {
    answer = { trap: String(error) };
  }
  postMessage({ id, answer }, answer.numbers ? [answer.numbers.buffer] : []);
};
