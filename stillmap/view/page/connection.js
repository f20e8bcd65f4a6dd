// SPDX-License-Identifier: Apache-2.0
// The connection to the program, and what the page itself knows of it.
import { $, on, send, setPill, state } from './page.js';
import { decode } from './messages.js';
import { LOST, RELOCALIZED } from './path.js';

const KINDS = { live: 'waiting for the first frame', run: 'finished run', map: 'saved map', cloud: 'cloud', changes: 'changes' };

// The messages of a program that has nothing to show, with which each connection begins.
const NOTHING = [
  { type: 'path', n: 0, t: new Float64Array(0), p: new Float32Array(0), s: new Uint8Array(0) }, { type: 'map', keyframes: [], events: [] },
  { type: 'movers', movers: [] }, { type: 'tracks', tracks: [] }, { type: 'objects', objects: [] }, { type: 'changes', changes: [], went: [], from: [] }, { type: 'palette', colors: [], names: [] }, { type: 'planner' },
  { type: 'zones', zones: [] }, { type: 'points', points: [] }, { type: 'warnings', active: [], count: 0 }, { type: 'events', events: [] }, { type: 'summary', summary: {} },
];

export const link = {
  connected: false,
  refused: '',  // why the program refuses its data; empty if it does not
  heard: 0, closed: 0,  // times of the newest image and of the end of the connection [ms]
  // Latency of the newest image; the least one, which contains the difference of the clocks; how far the newest is above it [ms].
  latency: 0, fastest: Infinity, late: 0,
};
let wait = 400;  // time until the next attempt [ms]

// A WebSocket does not tell why it was refused.
async function askWhy() {
  try {
    const answer = await fetch('/access' + location.search);
    link.refused = answer.status === 403 ? (await answer.text()).trim() : '';
  } catch (e) { /* the program does not answer at all */ }
  if (link.refused && !link.connected) setPill('no access', 'lost');
}
function opened() {
  Object.assign(link, { connected: true, refused: '', fastest: Infinity, late: 0, heard: performance.now() });
  state.connected = true;
  state.connections += 1;
  state.frames = state.images = 0;
  state.live = state.finished = false;
  wait = 400;
  setPill('connected');
  for (const message of NOTHING) send(message.type, message);
}
function closed() {
  if (link.connected || !link.closed) link.closed = performance.now();
  link.connected = state.connected = false;
  if (!state.finished) setPill(link.refused ? 'no access' : 'connection lost', 'lost');
  askWhy();
  setTimeout(connect, wait);
  wait = Math.min(5000, 1.6 * wait);
}
// Shows the messages in the page itself, if it is a file of `stillmap view --html`. Returns whether it is one.
function showOwnMessages() {
  const messages = document.querySelectorAll('script.message');
  if (!messages.length) return false;
  opened();
  for (const { textContent, dataset } of messages) {
    const bytes = Uint8Array.from(atob(textContent), (c) => c.charCodeAt(0));
    const message = decode(dataset.kind === 'binary' ? bytes.buffer : new TextDecoder().decode(bytes));
    send(message.type, message);
  }
  return true;
}
export function connect() {
  if (showOwnMessages()) return;
  const socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/data${location.search}`);
  socket.binaryType = 'arraybuffer';
  socket.onopen = opened;
  socket.onclose = closed;
  socket.onmessage = ({ data }) => {
    state.bytes += typeof data === 'string' ? data.length : data.byteLength;
    const message = decode(data);
    send(message.type, message);
  };
}

on('run', ({ live, kind, name }) => {
  link.heard = performance.now();
  Object.assign(state, { live, kind });
  document.title = name + ' – Stillmap';
  $('name').textContent = name;
  setPill(KINDS[kind]);
});
on('frame', (message) => {
  state.frame = message.index;
  state.frames += 1;
  link.heard = performance.now();
  link.latency = Date.now() - message.wall;
  link.fastest = Math.min(link.fastest, link.latency);
  link.late = link.latency - link.fastest;
  setPill({ [LOST]: 'camera lost', [RELOCALIZED]: 'relocalized' }[message.state] || 'live', message.state === LOST ? 'lost' : 'live');
});
on('finished', () => {
  state.live = false;
  state.finished = true;
  setPill('finished');
});
