// Reads every message of an MCAP file with the libraries of its makers and compares it with a table.
//   node mcap.mjs FILE TABLE [--exact]     numbers of TABLE have all digits with --exact, else their own places
//       [--of /left/]                      the table is that of topics that begin so
//   node mcap.mjs FILE --cut N             reads what is left of the file where N cuts end it
// What is found goes to stdout as JSON; the exit code is 1 where something differs.
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { decompress } from "fzstd";
import { readFileSync } from "node:fs";
import { check, compareTouch, problems, rowsOf } from "./table.mjs";

const [file, table, ...rest] = process.argv.slice(2);
const begin = rest.includes("--of") ? rest[rest.indexOf("--of") + 1] : "/";
const bytes = new Uint8Array(readFileSync(file));
const decompressHandlers = { zstd: (packed, size) => decompress(packed, new Uint8Array(Number(size))) };

function checkMessage(topic, message, log, last) {
  if (message.header) {
    check(BigInt(message.header.stamp.sec) * 1000000000n + BigInt(message.header.stamp.nanosec) === log, "stamp");
    check(topic.startsWith(`/${message.header.frame_id}/`), `frame_id ${message.header.frame_id}`);
  }
  if (message.step) check(message.data.length === message.step * message.height, `${topic}: size of its pixels`);
  const floats = () => new Float32Array(message.data.slice().buffer);
  if (topic.endsWith("/depth")) last.depth = floats();
  if (topic.endsWith("/cloud")) {
    check(message.data.length === message.row_step * message.height, "size of the cloud");
    const points = floats();
    check(last.depth.every((z, i) => Object.is(points[3 * i + 2], z)), "the cloud is not the depth");
  }
}

async function readAll(rows, exact) {
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (at, size) => bytes.subarray(Number(at), Number(at + size)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const found = { profile: reader.header.profile, topics: {}, cells: 0, chunks: reader.chunkIndexes.length };
  const readers = new Map();
  const last = {};
  for await (const { channelId, logTime, data } of reader.readMessages()) {
    const { topic, messageEncoding, schemaId } = reader.channelsById.get(channelId);
    const schema = reader.schemasById.get(schemaId);
    const text = new TextDecoder().decode(schema.data);
    if (!readers.has(topic)) {
      found.topics[topic] = { type: schema.name, messages: 0 };
      readers.set(topic, messageEncoding === "cdr" ? new MessageReader(parse(text, { ros2: true })) : JSON.parse(text));
    }
    ++found.topics[topic].messages;
    if (messageEncoding === "cdr") {
      checkMessage(topic, readers.get(topic).readMessage(data), logTime, last);
    } else {
      const message = JSON.parse(new TextDecoder().decode(data));
      for (const key of Object.keys(message)) check(key in readers.get(topic).properties, `${key} is not in the schema`);
      if (topic.endsWith("/touch") && topic.startsWith(begin)) compareTouch(message, rows, exact, found);
    }
  }
  const counts = reader.statistics.channelMessageCounts;
  for (const [id, channel] of reader.channelsById)
    check(Number(counts.get(id) ?? 0n) === (found.topics[channel.topic]?.messages ?? 0), `count of ${channel.topic}`);
  found.attachments = [];
  for await (const attachment of reader.readAttachments()) {
    JSON.parse(new TextDecoder().decode(attachment.data));
    found.attachments.push(attachment.name);
  }
  found.metadata = {};
  for await (const record of reader.readMetadata()) found.metadata = Object.fromEntries(record.metadata);
  return found;
}

/// Messages that a reader finds in the first `end` bytes.
function messagesBefore(end) {
  const reader = new McapStreamReader({ decompressHandlers });
  reader.append(bytes.subarray(0, end));
  let messages = 0;
  for (let record; (record = reader.nextRecord()); ) messages += record.type === "Message";
  return messages;
}

/// Ends of the chunks and their messages, from the records' lengths alone.
function chunkEnds() {
  const reader = new McapStreamReader({ includeChunks: true, decompressHandlers });
  reader.append(bytes);
  const chunks = [];
  let at = 8;
  const view = new DataView(bytes.buffer);
  for (; at + 9 <= bytes.length - 8; at += 9 + Number(view.getBigUint64(at + 1, true)))
    if (bytes[at] === 6) chunks.push({ end: at + 9 + Number(view.getBigUint64(at + 1, true)), messages: 0 });
  let chunk = -1;
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Chunk") ++chunk;
    if (record.type === "Message") ++chunks[chunk].messages;
  }
  return chunks;
}

function readCut(cuts) {
  const chunks = chunkEnds();
  const ends = chunks.flatMap(({ end }) => [end - 1, end, end + 1]);
  for (let i = 0; i < cuts; ++i) ends.push(Math.floor(((i + 0.5) * bytes.length) / cuts));
  for (const end of ends) {
    const wanted = chunks.reduce((sum, chunk) => sum + (chunk.end <= end ? chunk.messages : 0), 0);
    const found = messagesBefore(end);
    check(found === wanted, `cut at ${end}: ${found} messages, not ${wanted}`);
  }
  return { chunks: chunks.length, cuts: ends.length };
}

const answer = table === "--cut" ? readCut(Number(rest[0])) : await readAll(rowsOf(table), rest.includes("--exact"));
console.log(JSON.stringify({ ...answer, problems }));
process.exitCode = problems.length === 0 ? 0 : 1;
