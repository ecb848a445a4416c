// tumble's native solver as an ES module. Types and units: index.d.ts.

// Layout of the numbers of an answer: playground/src/frame.rs.
const HEAD = 20;
const NUMBERS_OF_BODY = 7;
const NUMBERS_OF_CONTACT = 15;
const NUMBERS_OF_STATE = 13;
const PARTS = ["dynamics", "penetration", "normalLaw", "frictionLaw", "cone", "joint", "jointLaw"];

const encoder = new TextEncoder();
const decoder = new TextDecoder();
let compiled = null;

// Compiles the WebAssembly. Without `source` it is the file beside this one, compiled once.
export async function init(source) {
  if (source === undefined && compiled !== null) return;
  let found = await (source ?? new URL("./tumble.wasm", import.meta.url));
  if (typeof found === "string" || found instanceof URL) found = await fetch(found);
  if (found instanceof Response) {
    if (!found.ok) throw new Error(`${found.url} was not loaded: status ${found.status}`);
    found = await found.arrayBuffer();
  }
  compiled = found instanceof WebAssembly.Module ? found : await WebAssembly.compile(found);
}

// Function from a request to its answer with its numbers. It has a memory of its own.
function newProgram() {
  if (compiled === null) throw new Error("tumble is not loaded; call `await init()` first");
  const { memory, tumble_playground: call } = new WebAssembly.Instance(compiled).exports;
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

const vector = (numbers, start) => [numbers[start], numbers[start + 1], numbers[start + 2]];

function contactAt(numbers, start) {
  const partner = numbers[start + 1];
  return {
    body: numbers[start],
    partner: partner >= 0 ? "body" : partner === -1 ? "ground" : "fixed",
    partnerIndex: partner >= 0 ? partner : Math.max(0, -2 - partner),
    point: vector(numbers, start + 2),
    normal: vector(numbers, start + 5),
    force: vector(numbers, start + 8),
    slip: vector(numbers, start + 11),
    friction: numbers[start + 14],
  };
}

const drawn = ({ name, colour, points, pieces }) => ({ name, colour, points, pieces });

export class Simulation {
  #program;
  #scene;
  // Head of the present moment.
  #head;
  // Full states and contacts of the present moment, once they were asked for.
  #states = null;
  #contacts = null;

  constructor(text) {
    if (typeof text !== "string") throw new TypeError("the scene must be a string of TOML");
    this.#program = newProgram();
    this.#scene = this.#move({ do: "open", text });
  }

  // Answer to a request. A program that trapped is not used again.
  #ask(request) {
    if (this.#program === null) throw new Error("the simulation was freed");
    let answer;
    try {
      answer = this.#program(request);
    } catch (cause) {
      this.free();
      throw new Error(`the solver stopped and the simulation was freed: ${cause.message}`, { cause });
    }
    // The program gives each text this name.
    if (answer.error !== undefined) throw new Error(answer.error.replace("scenarios/scene.toml", "scene"));
    return answer;
  }

  // Answer to a request that changes the moment.
  #move(request) {
    // A request that fails may have moved too.
    [this.#states, this.#contacts] = [null, null];
    const answer = this.#ask(request);
    this.#head = answer.numbers.subarray(0, HEAD);
    return answer;
  }

  #present() {
    this.#states ??= this.#ask({ do: "states" });
    return this.#states;
  }

  step(count = 1) {
    if (!Number.isInteger(count) || count < 0 || count >= 2 ** 32) {
      throw new RangeError(`count is ${count}; it must be an integer from 0 to 4294967295`);
    }
    try {
      this.#move({ do: "step", count, contacts: false });
    } catch (error) {
      // Steps before the one that failed were taken.
      if (this.#program !== null) this.#move({ do: "step", count: 0, contacts: false });
      throw error;
    }
    return this;
  }

  back() {
    this.#move({ do: "back", contacts: false });
    return this;
  }

  free() {
    this.#program = null;
    [this.#states, this.#contacts] = [null, null];
  }

  get name() {
    return this.#scene.name;
  }

  get notes() {
    return this.#scene.notes;
  }

  get bodies() {
    return this.#scene.bodies;
  }

  get fixed() {
    return this.#scene.fixed;
  }

  get timeStep() {
    return this.#scene.timeStep;
  }

  get index() {
    return this.#head[0];
  }

  get time() {
    return this.#head[1];
  }

  get energy() {
    return this.#head[5];
  }

  get unsolved() {
    const [failed, wild, first] = this.#head.subarray(7, 10);
    return { failed, wild, first: first < 0 ? null : first };
  }

  get states() {
    const { numbers } = this.#present();
    return numbers.subarray(0, NUMBERS_OF_STATE * this.bodies.length);
  }

  state(body) {
    const index = typeof body === "string" ? this.bodies.indexOf(body) : body;
    if (!(index in this.bodies)) throw new RangeError(`the scene has no body ${body}`);
    const start = NUMBERS_OF_STATE * index;
    const { states } = this;
    return {
      position: vector(states, start),
      attitude: [states[start + 3], ...vector(states, start + 4)],
      velocity: vector(states, start + 7),
      spin: vector(states, start + 10),
    };
  }

  get certificate() {
    const { numbers, status, isSolved, iterations } = this.#present();
    if (status === undefined) return null;
    const parts = numbers.subarray(NUMBERS_OF_STATE * this.bodies.length);
    const named = Object.fromEntries(PARTS.map((name, place) => [name, parts[place]]));
    return { residual: Math.max(...parts), ...named, status, converged: isSolved, iterations };
  }

  get contacts() {
    if (this.#contacts === null) {
      const { numbers } = this.#ask({ do: "step", count: 0, contacts: true });
      const contacts = [];
      const start = HEAD + NUMBERS_OF_BODY * this.bodies.length;
      for (let place = start; place < numbers.length; place += NUMBERS_OF_CONTACT) {
        contacts.push(contactAt(numbers, place));
      }
      this.#contacts = contacts;
    }
    return this.#contacts;
  }

  get drawing() {
    const { bodies, fixed, ground } = this.#scene.film;
    return { bodies: bodies.map(drawn), fixed: fixed.map(drawn), ground };
  }
}
