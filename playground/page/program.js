// The program in its worker, one request after the other.

class Program {
  // `module` is compiled WebAssembly.
  constructor(module) {
    this.module = module;
    this.start();
  }

  start() {
    const text = document.getElementById("worker").textContent;
    const place = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
    this.worker = new Worker(place);
    URL.revokeObjectURL(place);
    this.waiting = new Map();
    this.count = 0;
    this.worker.onmessage = ({ data }) => {
      const { resolve } = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      resolve(data.answer);
    };
    this.worker.onerror = (event) => {
      event.preventDefault();
      this.end("the worker stopped");
    };
    this.worker.postMessage({ module: this.module });
  }

  // True while an answer is due.
  get isBusy() {
    return this.waiting.size > 0;
  }

  ask(request) {
    const id = this.count;
    this.count += 1;
    return new Promise((resolve) => {
      this.waiting.set(id, { resolve });
      this.worker.postMessage({ id, request });
    });
  }

  // Ends whatever it does and starts anew, without a scene.
  restart() {
    this.end("ended");
    this.start();
  }

  end(why) {
    this.worker.terminate();
    const waiting = [...this.waiting.values()];
    this.waiting = new Map();
    for (const { resolve } of waiting) resolve({ trap: why });
  }
}

// Characters of packed bytes; `packed.rs` has the same.
const ALPHABET = Array.from({ length: 94 }, (_, i) => i + 33)
  .filter((code) => !"\"&'<>\\`".includes(String.fromCharCode(code)))
  .slice(0, 85);
const DIGITS = new Uint8Array(128);
ALPHABET.forEach((code, digit) => (DIGITS[code] = digit));

// Bytes of packed text: four of five digits in base 85, compressed by deflate.
async function unpacked(text) {
  const count = Math.floor(text.length / 5) * 4 + Math.max(0, (text.length % 5) - 1);
  const all = new Uint8Array(count + 4);
  const view = new DataView(all.buffer);
  for (let from = 0, to = 0; from < text.length; from += 5, to += 4) {
    let value = 0;
    for (let k = 0; k < 5; k += 1) {
      value = 85 * value + (from + k < text.length ? DIGITS[text.charCodeAt(from + k)] : 84);
    }
    view.setUint32(to, value);
  }
  return new Uint8Array(await inflated(all.subarray(0, count), Infinity));
}

// Runs a packed script, which has no module.
async function load(text) {
  document.head.append(element("script", {}, new TextDecoder().decode(await unpacked(text))));
}

// Decompressed bytes; null if there are more than `most`.
async function inflated(packed, most) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  const reader = stream.getReader();
  const parts = [];
  let size = 0;
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return new Blob(parts).arrayBuffer();
    size += value.length;
    if (size > most) {
      await reader.cancel();
      return null;
    }
    parts.push(value);
  }
}
