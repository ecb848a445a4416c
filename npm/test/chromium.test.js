// The package in Chromium: the bits of Node.js.

import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { once } from "node:events";
import { mkdtempSync, rmSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { setTimeout } from "node:timers/promises";
import { init, Simulation } from "tumble-sim";
import { bits, scene } from "./support.js";

const PACKAGE = new URL("../", import.meta.url);
const STEPS = 999;
// Time in which the page must answer (ms).
const LIMIT = 120_000;
const TYPES = { js: "text/javascript", wasm: "application/wasm" };
const PAGE = `<!doctype html><script type="module">
  let found;
  try {
    const { init, Simulation } = await import("/index.js");
    await init();
    const simulation = new Simulation(await (await fetch("/scene")).text());
    const states = [];
    for (let k = 0; k < ${STEPS}; k += 1) states.push(...simulation.step().states);
    found = { bits: Array.from(new BigUint64Array(Float64Array.from(states).buffer), String) };
  } catch (error) {
    found = { error: String(error) };
  }
  await fetch("/result", { method: "POST", body: JSON.stringify(found) });
</script>`;

// Serves the page, its scene and the files of the package. `receive` gets what the page posts.
function serve(receive) {
  return createServer(async (request, response) => {
    try {
      if (request.url === "/result") {
        const parts = await request.toArray();
        receive(JSON.parse(Buffer.concat(parts).toString()));
        response.end();
      } else if (request.url === "/") {
        response.setHeader("content-type", "text/html").end(PAGE);
      } else if (request.url === "/scene") {
        response.end(scene("drop"));
      } else {
        const [name, kind] = /^\/([a-z]+\.(js|wasm))$/.exec(request.url).slice(1);
        response.setHeader("content-type", TYPES[kind]).end(await readFile(new URL(name, PACKAGE)));
      }
    } catch {
      response.writeHead(404).end();
    }
  });
}

const isMissing = spawnSync("chromium", ["--version"]).error !== undefined;
const skip = isMissing && "chromium is not installed; scripts/setup --browser";

test("999 steps of drop have the same bits in Chromium", { skip }, async () => {
  let receive;
  const result = new Promise((resolve) => (receive = resolve));
  const server = serve(receive).listen(0, "127.0.0.1");
  await once(server, "listening");
  const profile = mkdtempSync(join(tmpdir(), "tumble-chromium-"));
  const address = `http://127.0.0.1:${server.address().port}/`;
  const options = ["--headless", "--no-sandbox", "--disable-gpu", `--user-data-dir=${profile}`, "--remote-debugging-port=0"];
  const browser = spawn("chromium", [...options, address], { stdio: "ignore" });
  try {
    const found = await Promise.race([result, setTimeout(LIMIT, { error: "no answer" }, { ref: false })]);
    assert.equal(found.error, undefined);
    await init();
    const simulation = new Simulation(scene("drop"));
    const states = [];
    for (let k = 0; k < STEPS; k += 1) states.push(...simulation.step().states);
    assert.equal(found.bits.length, 13 * STEPS);
    assert.deepEqual(found.bits, bits(states));
  } finally {
    const ended = once(browser, "exit");
    browser.kill();
    await ended;
    server.close();
    server.closeAllConnections();
    rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
  }
});
