// Opens the page of `palpate serve` in Chromium, sees it draw, kills the server, starts it anew, and sees the page
// come back by itself; of two fingers that their numbers are chosen.
//   node browser.mjs PROGRAM CHROMIUM PORT FOLDER [pair]
// What is found goes to stdout as JSON; the exit code is 1 where something differs, 2 where Chromium does not start.
import { spawn } from "node:child_process";
import { writeFileSync } from "node:fs";
import WebSocket from "ws";

const [program, chromium, port, folder, pair] = process.argv.slice(2);
const wait = (ms) => new Promise((done) => setTimeout(done, ms));
const grip = (side) => [`--${side}`, `synthetic:grip?size=160x120&rate=30&repeat=0&weight_N=0.6&side=${side}`];
const inputs = pair ? [...grip("left"), ...grip("right")] : ["synthetic:palpation?size=160x120&rate=30&repeat=0"];
const serve = () =>
  spawn(program, ["serve", ...inputs, "--port", port], { stdio: "ignore" });

async function devtools() {
  const flags = ["--headless=new", "--no-sandbox", "--remote-debugging-port=0", `--user-data-dir=${folder}/chromium`];
  const browser = spawn(chromium, [...flags, "--enable-unsafe-swiftshader", "about:blank"], { stdio: ["ignore", "ignore", "pipe"] });
  let said = "";
  const address = await new Promise((done) => {
    browser.stderr.on("data", (data) => {
      said += data;
      const found = /DevTools listening on (ws:\S+)/.exec(said);
      if (found) done(found[1]);
    });
    browser.on("exit", () => done(""));
  });
  if (!address) process.exit(2);
  const pages = await (await fetch(`http://${new URL(address).host}/json`)).json();
  const socket = new WebSocket(pages.find(({ type }) => type === "page").webSocketDebuggerUrl);
  await new Promise((done) => socket.on("open", done));
  const waiting = new Map(), faults = [];
  let last = 0;
  socket.on("message", (data) => {
    const { id, result, method, params } = JSON.parse(data);
    if (id) waiting.get(id)?.(result);
    else if (method === "Runtime.exceptionThrown") faults.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
  });
  const call = (method, params = {}) =>
    new Promise((done) => {
      waiting.set(++last, done);
      socket.send(JSON.stringify({ id: last, method, params }));
    });
  const ask = async (expression) => (await call("Runtime.evaluate", { expression, returnByValue: true })).result?.value;
  return { browser, call, ask, faults };
}

async function until(ask, expression) {
  for (let tries = 0; tries < 3000; ++tries) {
    const value = await ask(expression);
    if (value) return value;
    await wait(100);
  }
  return false;
}

// Colours of the surface as it is drawn.
const kColours = `(() => {
  const surface = [...fingers.values()][0].surface, gl = surface.gl;
  if (!gl || !surface.depth) return 0;
  surface.dirty = true;
  surface.draw([], 0, 160);
  const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
  gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return new Set(new Uint32Array(pixels.buffer)).size;
})()`;

let server = serve();
const { browser, call, ask, faults } = await devtools();
await call("Runtime.enable");
await call("Page.enable");
await call("Emulation.setDeviceMetricsOverride", { width: 375, height: 812, deviceScaleFactor: 1, mobile: true });
const found = {};
for (let tries = 0; tries < 600; ++tries) {
  await call("Page.navigate", { url: `http://localhost:${port}/` });
  await wait(300);
  if (await ask("typeof palpate === 'object'")) break;
}
found.drew = (await until(ask, "palpate.updates > 20")) !== false;
found.colours = await until(ask, `(${kColours}) > 20 ? ${kColours} : 0`);
found.force = await until(ask, "[...document.querySelectorAll('.card')].map(c => c.textContent).find(t => /^force.*N$/.test(t))");
found.wide = await ask("document.documentElement.scrollWidth <= innerWidth");
if (pair) {
  found.grip = await until(ask, "[...document.querySelectorAll('.grip .card')].map(c => c.textContent).find(t => /^grip force.*N$/.test(t))");
  found.surfaces = await ask("[...fingers.values()].filter(f => f.surface.depth).length");
  const shownDetails = "[...fingers.values()].filter(f => f.details.offsetParent).map(f => f.side).join()";
  found.chosen = [await ask(shownDetails)];
  for (const side of ["right", "both"]) {
    await ask(`[...document.querySelectorAll(".choice button")].find(b => b.textContent === "${side}").click()`);
    found.chosen.push(await ask(shownDetails));
  }
  found.pair = found.grip && found.surfaces === 2 && found.chosen.join(" ") === "left right left,right";
  found.pictures = (await until(ask, "[...fingers.values()].every(f => f.pictured)")) !== false;
}
server.kill("SIGKILL");
found.told = await until(ask, "/no connection/.test(document.querySelector('#state').textContent)");
const before = await ask("palpate.updates");
server = serve();
found.connections = await until(ask, "palpate.connections >= 2 && palpate.connections");
found.drewAgain = (await until(ask, `palpate.updates > ${before} + 20`)) !== false;
found.faults = faults;
const shot = await call("Page.captureScreenshot", { format: "png" });
writeFileSync(`${folder}/page.png`, Buffer.from(shot.data, "base64"));
server.kill("SIGINT");
browser.kill();
await new Promise((done) => browser.on("exit", done));  // it writes to its folder until then
console.log(JSON.stringify(found));
const right = found.drew && found.colours && found.force && found.wide && found.told && found.connections && found.drewAgain && faults.length === 0 &&
  (!pair || (found.pair && found.pictures));
process.exit(right ? 0 : 1);
