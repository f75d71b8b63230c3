// Drops files on the page in headless Chromium, one after the other, through the DevTools protocol.
// usage: node tests/drop.js PAGE[#test-gl] SHOT.png FILE...   prints what the page answers to each, then takes a picture
"use strict";
const fs = require("fs"), os = require("os"), path = require("path");
const [page, shot, ...files] = process.argv.slice(2);
const profile = fs.mkdtempSync(path.join(os.tmpdir(), "drop-"));
const browser = require("child_process").spawn("chromium", ["--headless", "--no-sandbox", "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader", "--hide-scrollbars", "--user-data-dir=" + profile, "--remote-debugging-pipe"],
  {stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"]});
const waiting = new Map();
let count = 0, text = "", session;

browser.stdio[4].setEncoding("utf8").on("data", part => {
  const messages = (text + part).split("\0");
  text = messages.pop();
  for (const m of messages.map(JSON.parse)) if (waiting.has(m.id)) waiting.get(m.id)(m);
});

function send(method, params) {
  return new Promise((resolve, reject) => {
    waiting.set(++count, m => m.error ? reject(new Error(method + ": " + m.error.message)) : resolve(m.result));
    browser.stdio[3].write(JSON.stringify({id: count, method, params, sessionId: session}) + "\0");
  });
}

async function evaluate(expression) { return (await send("Runtime.evaluate", {expression, returnByValue: true})).result.value; }
async function until(expression) { while (!await evaluate(expression)) await new Promise(resolve => setTimeout(resolve, 100)); }

async function drop(file) {
  const data = {items: [], files: [path.resolve(file)], dragOperationsMask: 1};
  await evaluate("document.title = ''");
  for (const type of ["dragEnter", "dragOver", "drop"]) await send("Input.dispatchDragEvent", {type, x: 300, y: 200, data});
  await until("light.textContent.includes(" + JSON.stringify(path.basename(file)) + ") && document.title.endsWith('ms a frame')");
  console.log(await evaluate("light.className + ' ' + light.textContent"));
  await evaluate("document.body.className = ''"); // as without #test
  console.log(await evaluate("light.offsetHeight ? 'seen in ' + getComputedStyle(light).color : 'hidden'"));
  await evaluate("document.body.className = 'test'");
}

async function main() {
  const {targetId} = await send("Target.createTarget", {url: "file://" + path.resolve(page) + (page.includes("#") ? "" : "#test")});
  session = (await send("Target.attachToTarget", {targetId, flatten: true})).sessionId;
  await send("Emulation.setDeviceMetricsOverride", {width: 640, height: 360, deviceScaleFactor: 1, mobile: false});
  await until("document.title.endsWith('ms a frame')");
  for (const file of files) await drop(file);
  fs.writeFileSync(shot, Buffer.from((await send("Page.captureScreenshot", {format: "png"})).data, "base64"));
}

const limit = setTimeout(() => { console.log("no answer"); process.exitCode = 1; browser.kill("SIGKILL"); }, 120000);
browser.on("exit", () => { clearTimeout(limit); fs.rmSync(profile, {recursive: true, force: true, maxRetries: 5, retryDelay: 200}); process.exit(); });
main().catch(error => { console.log(error.message); process.exitCode = 1; }).finally(() => browser.kill());
