// Loader: scripts and program are packed in the page.

// Digits of packed bytes; `packed.rs` has the same.
const DIGITS = new Uint8Array(128);
Array.from({ length: 94 }, (_, i) => i + 33)
  .filter((code) => !"&<\\".includes(String.fromCharCode(code)))
  .forEach((code, digit) => (DIGITS[code] = digit));

// Bytes of packed text: compressed by deflate, and 13 bits in two digits of base 91. A last digit
// alone has 6 bits.
async function unpacked(text) {
  const digit = (place) => DIGITS[text.charCodeAt(place)];
  const all = new Uint8Array(Math.floor((13 * Math.floor(text.length / 2) + 6 * (text.length % 2)) / 8));
  let [held, bits, to] = [0, 0, 0];
  for (let from = 0; from < text.length; from += 2) {
    const isPair = from + 1 < text.length;
    held = isPair ? (held << 13) | (91 * digit(from) + digit(from + 1)) : (held << 6) | digit(from);
    for (bits += isPair ? 13 : 6; bits >= 8; to += 1) {
      bits -= 8;
      all[to] = held >> bits;
    }
    held &= (1 << bits) - 1;
  }
  return new Uint8Array(await inflated(all, Infinity));
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
