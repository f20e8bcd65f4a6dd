// SPDX-License-Identifier: Apache-2.0
// Moving objects with their trails, and the static objects.
import { css, on, send, setCount, state } from './page.js';
import { ground } from './ground.js';
import { lower } from './path.js';
import { addLines, boxEdges, color, colorOfId, dropLabels, empty, layers, redraw, setLabel } from './scene.js';
import { nameOf } from './text.js';

const TRAIL_SECONDS = 4, PREDICTED_SECONDS = 1.5;
const UNSURE = 0.3;  // confidence below which the class of a static object is shown with a question mark

export let movers = new Map();  // id -> moving object shown now
let trails = new Map();  // id -> [[t, x, y, z], ...]
let tracks = new Map();  // id -> track of a whole run
let alarmed = new Set();  // ids of those with warnings
let objects = [];  // static objects

export const hasMovers = () => trails.size + tracks.size > 0;
export const samplesOf = (id) => (tracks.has(id) ? tracks.get(id).samples : []);
export const shadeOf = (id) => (alarmed.has(id) ? color('lost') : colorOfId(id));

// Returns a box along the axes of the world as one that stands upright: each axis becomes the nearest one along or across the
// upward direction, which is the last.
export function standing({ min, max }) {
  const slopes = ground.up.map(Math.abs), last = slopes.indexOf(Math.max(...slopes)), order = [(last + 1) % 3, (last + 2) % 3, last];
  const axis = (k) => new THREE.Vector3().setComponent(k, Math.sign(ground.up[last]));
  const turn = new THREE.Quaternion().setFromUnitVectors(axis(last), new THREE.Vector3(...ground.up));
  return { center: min.map((low, k) => (low + max[k]) / 2), size: order.map((k) => max[k] - min[k]), axes: order.map((k) => axis(k).applyQuaternion(turn).toArray()) };
}
// Returns the middle of the upper face of an upright box.
export const topOf = ({ center, size, axes }) => center.map((c, k) => c + axes[2][k] * size[2] / 2);
function drawMover(m) {
  const shade = shadeOf(m.id), speed = Math.hypot(...m.v), trail = trails.get(m.id) || [], box = standing(m);
  addLines(layers.movers, boxEdges(box), { shade, opacity: m.observed ? 1 : 0.45 });
  addLines(layers.movers, trail.slice(1).flatMap((place, i) => [...trail[i].slice(1), ...place.slice(1)]), { shade, opacity: 0.55 });
  const way = [];  // dashed: predicted
  if (speed > 0.1) for (let k = 0; k < 8; ++k) for (const part of [k / 8, (k + 0.55) / 8]) way.push(...m.p.map((x, i) => x + m.v[i] * part * PREDICTED_SECONDS));
  addLines(layers.movers, way, { shade });
  setLabel('movers:' + m.id, topOf(box), [nameOf(m), m.observed ? `${speed.toFixed(1)} m/s` : 'predicted'], '#' + shade.getHexString(), alarmed.has(m.id) ? 'alarm' : 'mover');
}
function drawMovers() {
  empty(layers.movers);
  for (const m of movers.values()) drawMover(m);
  dropLabels('movers', new Set([...movers.keys()].map((id) => 'movers:' + id)));
  state.movers = movers.size;
  state.red = [...movers.keys()].filter((id) => alarmed.has(id)).length;
  setCount('movers', movers.size);
  send('movers-drawn');
  redraw();
}

on('movers', (message) => {
  for (const m of message.movers) {
    const trail = trails.get(m.id) || [];
    if (!trail.length || m.t > trail[trail.length - 1][0]) trail.push([m.t, ...m.p]);
    while (trail.length && trail[0][0] < m.t - TRAIL_SECONDS) trail.shift();
    trails.set(m.id, trail);
  }
  movers = new Map(message.movers.map((m) => [m.id, m]));
  drawMovers();
});
on('tracks', (message) => {
  tracks = new Map(message.tracks.map((track) => [track.id, { ...track, times: Float64Array.from(track.samples, (s) => s.t) }]));
});
on('timed', (t) => {
  movers = new Map();
  trails = new Map();
  for (const [id, track] of tracks) {
    const from = (time) => lower(track.times, track.times.length, time), sample = track.samples[from(t - 1e-4)];
    if (!sample || Math.abs(sample.t - t) >= 0.2) continue;
    movers.set(id, { ...sample, id, class: track.class });
    trails.set(id, track.samples.slice(from(t - TRAIL_SECONDS), from(t + 1e-4)).map((s) => [s.t, ...s.p]));
  }
  drawMovers();
});
on('alarmed', (alarms) => {
  alarmed = alarms.movers;
  drawMovers();
});
function drawObjects() {
  empty(layers.objects);
  dropLabels('objects');
  for (const object of objects) {
    const box = object.upright_box || standing(object.box), unsure = object.confidence < UNSURE;
    addLines(layers.objects, boxEdges(box), { shade: color('object'), opacity: unsure ? 0.2 : 0.6, width: unsure ? 1 : 1.5 });
    setLabel('objects:' + object.id, topOf(box), unsure ? [object.class + '?', `${Math.round(100 * object.confidence)} %`] : [object.class], css('object'), unsure ? 'object unsure' : 'object');
  }
  setCount('objects', objects.length);
  redraw();
}
on('objects', (message) => {
  objects = message.objects;
  drawObjects();
});
on('grounded', () => {
  drawMovers();
  drawObjects();
});
on('themed', drawMovers);
on('run', () => trails.clear());
