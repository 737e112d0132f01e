// Takes every topic of a running `palpate serve` with Foxglove's own client until the server ends, and compares
// the touches with the table that it wrote.
//   node live.mjs PORT TABLE
// What is found goes to stdout as JSON; the exit code is 1 where something differs.
import protocol from "@foxglove/ws-protocol";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import WebSocket from "ws";
import { check, compareTouch, problems, rowsOf } from "./table.mjs";

const [port, table] = process.argv.slice(2);
const { FoxgloveClient } = protocol;
const found = { topics: {}, cells: 0, services: [], answers: {}, events: [] };
const touches = [];
const wrenches = new Map();
let depth;

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
    for (const { id, name } of services.filter(({ name }) => /mark|stop/.test(name)))
      setTimeout(() => client.sendServiceCallRequest({ serviceId: id, callId: id, encoding: "json", data: new TextEncoder().encode(name.endsWith("mark") ? '{"text":"here"}' : "{}") }), 1500);
  });
  client.on("serviceCallResponse", ({ callId, data }) => { found.answers[callId] = JSON.parse(new TextDecoder().decode(data)); });
  client.on("serviceCallFailure", ({ callId, message }) => { found.answers[callId] = message; });
  client.on("message", ({ subscriptionId, data }) => {
    const topic = topics.get(subscriptionId), reader = readers.get(subscriptionId);
    ++found.topics[topic];
    if (reader instanceof MessageReader) return take(topic, reader.readMessage(data));
    const message = JSON.parse(new TextDecoder().decode(data));
    for (const key of Object.keys(message)) check(key in reader.properties, `${key} is not in the schema`);
    (topic.endsWith("/touch") ? touches : found.events).push(message);
  });
  client.on("error", (error) => check(false, String(error)));
  client.on("close", finish);
}

function finish() {
  const rows = rowsOf(table);
  for (const touch of touches) {
    compareTouch(touch, rows, false, found);
    const wrench = wrenches.get(`${touch.stamp.sec}.${touch.stamp.nanosec}`);
    if (wrench) check(wrench.force.z === touch.force_N.value, `frame ${touch.frame}: the wrench is not the force`);
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
