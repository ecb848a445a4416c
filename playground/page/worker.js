// Worker: the program, or the connection to it. The page stays free while a step takes long.

// Time for the steps of one picture (ms), and time up to which more steps are taken at once.
const BUDGET = 20;
const SHORT = 3;
const encoder = new TextEncoder();
const decoder = new TextDecoder();
// Function from a request to its answer with its numbers, or to a promise of it.
let ask = null;

// Program in WebAssembly.
async function programOf(module) {
  const program = await WebAssembly.instantiate(module, {});
  const { memory, tumble_playground: call } = program.exports;
  return (request) => {
    const bytes = encoder.encode(JSON.stringify(request));
    // The memory may move during a call.
    const place = call(bytes.length) >>> 0;
    new Uint8Array(memory.buffer, place, bytes.length).set(bytes);
    const answer = call(0) >>> 0;
    const [text, length, numbers, count] = new Uint32Array(memory.buffer, answer, 4);
    const found = JSON.parse(decoder.decode(new Uint8Array(memory.buffer, text, length)));
    return { ...found, numbers: new Float64Array(memory.buffer, numbers, count).slice() };
  };
}

// Program behind a server. It connects with the first request, and once only: a window that lost
// its place to another does not take it back by itself.
function serverAt(address) {
  let socket = null;
  let ended = null;
  let receive = null;
  let fail = null;
  return (request) =>
    new Promise((resolve, reject) => {
      if (ended !== null) throw new Error(ended);
      [receive, fail] = [resolve, reject];
      const text = JSON.stringify(request);
      if (socket !== null) {
        socket.send(text);
        return;
      }
      socket = new WebSocket(address);
      socket.binaryType = "arraybuffer";
      socket.onopen = () => socket.send(text);
      socket.onmessage = ({ data }) => receive(answerOf(data));
      socket.onclose = ({ reason }) => {
        ended = reason || "the server has ended";
        fail(new Error(ended));
      };
    });
}

// Answer in a message (`socket.rs`): length of the text, text, spaces up to a multiple of 8, numbers.
function answerOf(data) {
  const [length] = new Uint32Array(data, 0, 1);
  const found = JSON.parse(decoder.decode(new Uint8Array(data, 4, length)));
  return { ...found, numbers: new Float64Array(data, Math.ceil((4 + length) / 8) * 8) };
}

// Takes up to `steps` steps within the time budget.
async function advance({ steps, contacts, target }) {
  if (target) await ask({ do: "pull", target });
  const start = performance.now();
  let [done, chunk, answer] = [0, 1, {}];
  while (done < steps) {
    const count = Math.min(chunk, steps - done);
    const before = performance.now();
    answer = await ask({ do: "step", count, contacts });
    if (answer.error) break;
    done += count;
    const now = performance.now();
    if (now - start > BUDGET) break;
    if (now - before < SHORT) chunk *= 2;
  }
  return { ...answer, done, took: performance.now() - start };
}

async function handle(data) {
  if (data.module) {
    ask = await programOf(data.module);
    return;
  }
  if (data.address) {
    ask = serverAt(data.address);
    return;
  }
  const { id, request } = data;
  let answer = {};
  try {
    answer = request.do === "advance" ? await advance(request) : await ask(request);
  } catch (error) {
    answer = { trap: error.message };
  }
  postMessage({ id, answer }, answer.numbers ? [answer.numbers.buffer] : []);
}

// Requests are answered one after the other.
let last = Promise.resolve();
onmessage = ({ data }) => {
  last = last.then(() => handle(data));
};
