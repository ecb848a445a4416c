// Sharing: the scene in the address, and as a file.

// Largest text in an address (bytes), as for a scenario file.
const LARGEST_TEXT = 4 << 20;

const encoded = (raw) => {
  let text = "";
  for (const byte of raw) text += String.fromCharCode(byte);
  return btoa(text).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
};

// Fragment of a text: `#z=` and the compressed text.
async function fragmentOf(text) {
  const stream = new Blob([text]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  return `#z=${encoded(new Uint8Array(await new Response(stream).arrayBuffer()))}`;
}

// Largest part of an address in a message (characters).
const MOST_SHOWN = 20;

// Text of a fragment: `#z=` compressed, `#text=` plain. Null without a fragment.
async function textOf(fragment) {
  if (fragment.length < 2) return null;
  const [, kind, content] = /^#(z|text)=(.*)$/s.exec(fragment) ?? [];
  if (kind === undefined) {
    const shown = fragment.length > MOST_SHOWN ? `${fragment.slice(0, MOST_SHOWN)}…` : fragment;
    throw new Error(`The address ends in ${shown}, which is no scene. A scene begins with #z= or #text=.`);
  }
  try {
    if (kind === "text") return decodeURIComponent(content);
    const packed = bytes(content.replaceAll("-", "+").replaceAll("_", "/"));
    const raw = await inflated(packed, LARGEST_TEXT);
    if (raw === null) throw new Error("too long");
    return new TextDecoder("utf-8", { fatal: true }).decode(raw);
  } catch {
    throw new Error("The address holds no scene: it is damaged or cut off. Copy the whole link.");
  }
}

async function openSharing() {
  const text = await presentText();
  if (text === null) return;
  if (isLive) {
    $("sharing").showModal();
    return;
  }
  const fragment = await fragmentOf(text);
  history.replaceState(null, "", fragment);
  $("link").value = location.href;
  const kilobytes = Math.ceil(location.href.length / 1000);
  const isLong = kilobytes > 30;
  put($("link-note"), isLong ? `The link has ${kilobytes} kB, too long for some programs; the file is safer.` : "");
  $("sharing").showModal();
  $("link").select();
}

async function copyLink() {
  $("link").select();
  try {
    await navigator.clipboard.writeText($("link").value);
    put($("link-note"), "The link is copied.");
  } catch {
    put($("link-note"), "The browser does not copy here. The link is selected: copy it by keyboard.");
  }
}

async function download() {
  const text = await presentText();
  if (text === null) return;
  const link = element("a", { download: "scene.toml" });
  link.href = URL.createObjectURL(new Blob([text], { type: "text/plain" }));
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// Text of the scene with its pulls; null after a failure.
async function presentText() {
  const { text } = await asked({ do: "export" });
  return text ?? null;
}
