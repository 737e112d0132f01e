// Takes every topic of a running `palpate serve` with Foxglove's own client until the server ends, and compares
// the touches with the table that it wrote; of two fingers those of both and the grip with the session's tables.
//   node live.mjs PORT TABLE
//   node live.mjs PORT FOLDER pair     the session, or a folder with one
// What is found goes to stdout as JSON; the exit code is 1 where something differs.
import protocol from "@foxglove/ws-protocol";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { existsSync, readdirSync } from "node:fs";
import WebSocket from "ws";
import { check, compareTouch, problems, rowsOf } from "./table.mjs";

const [port, table, pair] = process.argv.slice(2);
const { FoxgloveClient } = protocol;
const found = { topics: {}, cells: 0, services: [], answers: {}, events: [] }, asked = {};
const touches = [], grips = [];
const roots = new Map();  // of a touch: its topic
const wrenches = new Map();
let depth, ask = () => {};

function take(topic, message) {
  if (topic.endsWith("/wrench")) wrenches.set(`${message.header.stamp.sec}.${message.header.stamp.nanosec}`, message.wrench);
  if (message.step) check(message.data.length === message.step * message.height, `${topic}: size of its pixels`);
  const floats = () => new Float32Array(message.data.slice().buffer);
  if (topic.endsWith("/depth")) depth = [message.header.stamp, floats()];
  if (topic.endsWith("/cloud")) {
    check(message.data.length === message.row_step * message.height, "size of the cloud");
    const points = floats(), [stamp, metres] = depth ?? [{}, []];
    if (stamp.sec === message.header.stamp.sec && stamp.nanosec === message.header.stamp.nanosec)
      check(metres.every((z, i) => Object.is(points[3 * i + 2], z)), "the cloud is not the depth");
  }
  if (topic.endsWith("/compressed")) check(message.data[0] === 0xff && message.data[1] === 0xd8, "no JPEG");
}

function listen(client) {
  const readers = new Map(), topics = new Map();
  client.on("advertise", (channels) => {
    for (const channel of channels) {
      found.topics[channel.topic] = 0;
      const id = client.subscribe(channel.id);
      topics.set(id, channel.topic);
      readers.set(id, channel.encoding === "cdr" ? new MessageReader(parse(channel.schema, { ros2: true })) : JSON.parse(channel.schema));
    }
  });
  client.on("advertiseServices", (services) => {
    found.services = services.map(({ name }) => name);
    const call = (name, argument) => {
      const { id } = services.find((one) => one.name.endsWith(`/${name}`));
      client.sendServiceCallRequest({ serviceId: id, callId: id, encoding: "json", data: new TextEncoder().encode(argument) });
    };
    ask = (name, argument = "{}") => { if (!(name in asked)) call(name, argument); asked[name] = true; };
    if (pair) return;
    setTimeout(() => call("mark", '{"text":"here"}'), 1500);
    setTimeout(() => call("stop", "{}"), 1500);
  });
  client.on("serviceCallResponse", ({ callId, data }) => { found.answers[callId] = JSON.parse(new TextDecoder().decode(data)); });
  client.on("serviceCallFailure", ({ callId, message }) => { found.answers[callId] = message; });
  client.on("message", ({ subscriptionId, data }) => {
    const topic = topics.get(subscriptionId), reader = readers.get(subscriptionId);
    ++found.topics[topic];
    if (reader instanceof MessageReader) return take(topic, reader.readMessage(data));
    const message = JSON.parse(new TextDecoder().decode(data));
    for (const key of Object.keys(message)) check(key in reader.properties, `${key} is not in the schema`);
    if (topic.endsWith("/touch")) roots.set(message, topic);
    (topic.endsWith("/touch") ? touches : topic === "/grip" ? grips : found.events).push(message);
    if (pair && touches.length > 20) ask("mark", '{"text":"here"}');
    // Held, and seen for a while as it is measured.
    if (grips.length > 60 && message.grip_force_N?.state === "valid" && message.grip_force_N.value > 0.1) ask("zero");
  });
  client.on("error", (error) => check(false, String(error)));
  client.on("close", ({ code }) => { found.code = code; finish(); });
}

// Rows of pairs.csv by their frames; what was sent after a zero is less than its row by the same all the time.
function compareGrips(folder) {
  const rows = rowsOf(`${folder}/pairs.csv`, ({ left_frame, right_frame }) => `${left_frame},${right_frame}`);
  const zeros = new Set();
  for (const grip of grips) {
    const frame = `${grip.left_frame.value ?? ""},${grip.right_frame.value ?? ""}`, { zeroed, stamp, ...fields } = grip;
    if (zeroed) {
      const force = fields.grip_force_N, row = rows.get(frame);
      if (force.state === "valid") zeros.add((Number(row.grip_force_N) - force.value).toFixed(3));
      for (const name of ["grip_force_N", "imbalance_N", "load_x_N", "load_y_N", "load_z_N"]) delete fields[name];
    }
    compareTouch({ frame, ...fields }, rows, false, found);
  }
  found.grips = grips.length;
  found.zeros = zeros.size;
  check([...zeros].every((zero) => Number(zero) > 0.09), `zeros ${[...zeros]}`);
}

function finish() {
  const session = !pair || existsSync(`${table}/pairs.csv`) ? table : `${table}/${readdirSync(table).find((name) => name.startsWith("session"))}`;
  const rows = pair ? { left: rowsOf(`${session}/left/frames.csv`), right: rowsOf(`${session}/right/frames.csv`) } : rowsOf(table);
  if (pair) compareGrips(session);
  for (const touch of touches) {
    if (touch.zeroed) continue;
    compareTouch(touch, pair ? rows[roots.get(touch).split("/")[1]] : rows, pair, found);
    const wrench = wrenches.get(`${touch.stamp.sec}.${touch.stamp.nanosec}`);
    if (wrench && !pair) check(wrench.force.z === touch.force_N.value, `frame ${touch.frame}: the wrench is not the force`);
  }
  console.log(JSON.stringify({ ...found, touches: touches.length, problems }));
  process.exit(problems.length === 0 ? 0 : 1);
}

function connect(tries) {
  const socket = new WebSocket(`ws://localhost:${port}`, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
  socket.on("error", () => {
    if (tries === 0) process.exit(2);
    setTimeout(() => connect(tries - 1), 100);
  });
  socket.on("open", () => socket.removeAllListeners("error"));
  const client = new FoxgloveClient({ ws: socket });
  client.on("open", () => listen(client));
}
connect(600);
