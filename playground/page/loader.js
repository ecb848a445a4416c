// Loader: scripts and program are packed in the page.

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

// Runs a packed script.
async function load(id) {
  const script = document.createElement("script");
  script.textContent = new TextDecoder().decode(await unpacked(document.getElementById(id).textContent));
  document.head.append(script);
}

(async () => {
  try {
    await load("drawer");
    await load("script");
  } catch (error) {
    const text = `The playground does not start here: ${error.message}. A recent browser is needed.`;
    document.getElementById("wait").textContent = text;
  }
})();
