// SPDX-License-Identifier: Apache-2.0
// Tests of the parts of the page that need no browser: node --test
import assert from 'node:assert/strict';
import test from 'node:test';
import { decode, forEachRun } from './messages.js';
import { indexAt, lower, path, pathLength, pointAt, pushFrame, setPath } from './path.js';
import { changeText, countText, firstOf, msText, nameOf, zonesYaml } from './text.js';
import { addDynamics, rowsOf, textsBetween } from './time_rows.js';
import { alarmsOf, barsOf, byMover, isActive, liveText, nearestOf, recordedText, unknownOf } from './warnings.js';

// Returns the bytes of values, each written by a function of DataView.
function bytes(...values) {
  const sizes = { setUint8: 1, setUint16: 2, setInt32: 4, setUint32: 4, setFloat32: 4, setFloat64: 8 };
  const view = new DataView(new ArrayBuffer(values.reduce((sum, [write]) => sum + sizes[write], 0)));
  let at = 0;
  for (const [write, value] of values) {
    view[write](at, value, true);
    at += sizes[write];
  }
  return view.buffer;
}
const setFrames = (...times) => setPath({ n: times.length, t: Float64Array.from(times), p: Float32Array.from(times.flatMap((t) => [t, 0, 0, 0, 0, 0, 1])), s: new Uint8Array(times.length) });

test('a cube of the map has its index, edge, points and colors', () => {
  const head = [['setUint32', 1], ['setInt32', -1], ['setInt32', 0], ['setInt32', 2], ['setFloat32', 0.5], ['setUint32', 1]];
  const point = [10, 20, 30, 4].map((x) => ['setUint16', x]), color = [1, 2, 3, 255].map((x) => ['setUint8', x]);
  const chunk = decode(bytes(...head, ...point, ...color));
  assert.deepEqual([chunk.type, chunk.cell, chunk.edge, chunk.count], ['chunk', [-1, 0, 2], 0.5, 1]);
  assert.deepEqual([[...chunk.positions], [...chunk.colors]], [[10, 20, 30, 4], [1, 2, 3, 255]]);
});

test('an image has its frame and a JPEG file', () => {
  const image = decode(bytes(['setUint32', 2], ['setUint32', 7], ['setUint8', 255], ['setUint8', 216]));
  assert.deepEqual([image.type, image.frame, [...image.jpeg]], ['image', 7, [255, 216]]);
});

test('a path has times, poses and states', () => {
  const frame = (t, x, s) => [t, x, 2, 3, 0, 0, 0, 1].map((v) => ['setFloat32', v]).concat([['setUint32', s]]);
  const message = decode(bytes(['setUint32', 3], ['setUint32', 2], ['setFloat64', 1e9], ...frame(0, 1, 0), ...frame(0.5, 4, 3)));
  assert.deepEqual([message.type, message.n, [...message.t], [...message.s]], ['path', 2, [1e9, 1e9 + 0.5], [0, 3]]);
  setPath(message);
  assert.deepEqual(pointAt(1), [4, 2, 3]);
  assert.equal(pathLength(), 3);
});

test('a mesh has the triangles, points, texture places and JPEG file of a GLB file', () => {
  const view = (byteOffset, byteLength) => ({ byteOffset, byteLength });
  let json = JSON.stringify({ images: [{}], bufferViews: [view(0, 12), view(12, 36), view(48, 24), view(72, 3)] });
  json += ' '.repeat((4 - json.length % 4) % 4);
  const words = (write, ...values) => values.map((value) => [write, value]), text = words('setUint8', ...[...json].map((c) => c.charCodeAt(0)));
  const points = [0, 0, 0, 1, 0, 0, 0, 1, 0.5], places = [0, 0, 1, 0, 0, 1];
  const glb = [...words('setUint32', 4, 0x46546C67, 2, 0, json.length, 0x4E4F534A), ...text, ...words('setUint32', 76, 0x4E4942),
    ...words('setUint32', 0, 1, 2), ...words('setFloat32', ...points, ...places), ...words('setUint8', 255, 216, 255, 0)];
  const mesh = decode(bytes(...glb));
  assert.deepEqual([mesh.type, [...mesh.triangles], [...mesh.positions], [...mesh.places], [...mesh.jpeg]], ['mesh', [0, 1, 2], points, places, [255, 216, 255]]);
  assert.equal(decode(bytes(...glb.map(([write, value], i) => [write, i > 5 && value === 105 ? 106 : value]))).type, 'no-mesh');
});

test('text messages are JSON', () => assert.deepEqual(decode('{"type": "finished"}'), { type: 'finished' }));

test('runs of cells give the first index and the number', () => {
  const runs = [];
  forEachRun([0, 3, 1, 2, 2, 1, 1, 4], 1, (first, count) => runs.push([first, count]));
  assert.deepEqual(runs, [[3, 2], [6, 4]]);
});

test('a path grows, and keeps its newest frame if an older path comes', () => {
  setFrames();
  for (let i = 0; i < 3000; ++i) pushFrame(i, [i, 0, 0, 0, 0, 0, 1], 0);
  assert.deepEqual([path.n, pointAt(2999)], [3000, [2999, 0, 0]]);
  setPath({ n: 2, t: Float64Array.of(0, 1), p: new Float32Array(14), s: new Uint8Array(2) }, true);
  assert.deepEqual([path.n, path.t[2], pointAt(2)], [3, 2999, [2999, 0, 0]]);
});

test('times are found in a path', () => {
  setFrames(1, 2, 3);
  assert.deepEqual([0, 2, 2.5, 9].map(indexAt), [0, 1, 2, 2]);
  assert.deepEqual([lower([1, 2, 3], 3, 9), lower([], 0, 1)], [3, 0]);
});

test('numbers are short', () => {
  assert.deepEqual([999, 12345, 2345678].map(countText), ['999', '12 k', '2.35 M']);
  assert.deepEqual([1.23, 45.6, 1234].map(msText), ['1.2 ms', '46 ms', '1.2 s']);
});

test('names have the number if there is one', () => {
  assert.deepEqual([nameOf({ class: 'person', id: 3 }), nameOf({ class: 'unknown', id: 4 }), nameOf({ class: 'person', id: -2 })], ['person 3', 'object 4', 'person']);
  assert.deepEqual([firstOf(['a', 'b', 'c'], 2), firstOf(['a', 'b', 'c', 'd'], 2)], ['a, b, c', 'a, b and 2 more']);
});

test('a change tells what happened, and how far an object was moved', () => {
  const box = (x, y) => ({ min: [x, y, 0], max: [x + 2, y + 2, 2] });
  assert.equal(changeText({ kind: 'moved', before: box(0, 0), after: { min: [2.5, 3.5, 0.5], max: [4.5, 5.5, 1.5] } }), 'moved 4.30 m');
  assert.equal(changeText({ kind: 'appeared', after: box(0, 0) }), 'appeared');
});

test('zones are saved as YAML', () => {
  const text = zonesYaml([{ name: 'zone 1', polygon: [[0, 1, 2]], height: [0, 2.5] }], [0, -1, 0], true);
  assert.match(text, /up is a guess/);
  assert.match(text, /\nup: \[0, -1, 0\]\nzones:\n {2}- name: zone 1\n {4}polygon: \[\[0.000, 1.000, 2.000\]\]\n {4}height: \[0, 2.5\]\n$/);
});

const near = { id: 1, kind: 'near', rule: 'caution', mover: 3, class: 'person', distance: 1.5, timestamp: 1, end: 2, text: 'caution: person 3 is 1.5 m from the camera' };
const zone = { id: 2, kind: 'zone', rule: 'gate', mover: 3, class: 'person', timestamp: 1.5, end: null, text: "person 3 is in zone 'gate'" };
const far = { id: 3, kind: 'course', rule: 'caution', mover: 4, class: 'unknown', distance: 0.5, timestamp: 1, end: 2, text: 'object 4 will be' };
const unknown = { id: 4, kind: 'unknown', rule: 'the camera is lost', timestamp: 1, end: 2, text: 'not known: the camera is lost' };
const unseen = { id: 5, kind: 'unseen', rule: 'gate', timestamp: 1, end: 2, text: "zone 'gate' is not in view" };

test('warnings of one moving object are one bar, and those without one are bars of their own', () => {
  assert.deepEqual(byMover([near, unknown, zone, { ...unknown, id: 9 }]).map((group) => group.map((w) => w.id)), [[1, 2], [4], [9]]);
});

test('the nearest bar is first, by the present distance if it is known', () => {
  const texts = (present) => barsOf([unknown, near, far], false, (id) => present[id]).map((bar) => bar.text);
  assert.deepEqual(texts({ 4: 9 }), ['person 3, 1.5 m away: caution', 'object 4, 9.0 m away: caution', 'not known: the camera is lost']);
  assert.deepEqual(texts({}), ['object 4, 0.5 m away: caution', 'person 3, 1.5 m away: caution', 'not known: the camera is lost']);
  assert.deepEqual(barsOf([unknown], true, () => undefined), [{ text: unknown.text, unknown: true }]);
});

test('texts tell all rules that are broken', () => {
  assert.equal(liveText([near, zone]), near.text + '; also: gate');
  assert.equal(liveText([near, { ...near, id: 8 }]), near.text);
  assert.equal(recordedText([near, zone], 2), 'person 3, 2.0 m away: caution, gate');
  assert.equal(recordedText([{ ...zone, mover: -3 }], Infinity), 'person: gate');
});

test('alarms name moving objects, zones and rules', () => {
  const alarms = alarmsOf([near, zone, unknown, unseen]);
  assert.deepEqual(Object.values(alarms).map((set) => [...set]), [[3], ['gate'], ['caution'], ['gate']]);
});

test('a warning is active from its begin to before its end', () => {
  assert.deepEqual([0.9, 1, 1.9, 2].map((t) => isActive(near, t)), [false, true, true, false]);
  assert.ok(isActive(zone, 1e9));
});

test('a moving object was nearest while one of its warnings lasted', () => {
  const samples = [0.5, 1, 1.5, 3].map((t) => ({ t, min: [t, 0, 0], max: [t + 0.1, 1, 1] }));
  assert.deepEqual(nearestOf([near], samples, () => [0, 0, 0]), { t: 1, distance: 1 });
  assert.deepEqual(nearestOf([near], [], () => [0, 0, 0]), { t: 1, distance: 1.5 });
});

test('silence, delay and a lost connection are not known to be clear', () => {
  const link = { connected: true, heard: 1000, late: 0, closed: 1000 };
  assert.equal(unknownOf(link, 2000), null);
  assert.equal(unknownOf(link, 4000).text, 'not known: no image for 3 s');
  assert.equal(unknownOf({ ...link, late: 1600 }, 1000).text, 'not known: this page is 1.6 s late');
  assert.equal(unknownOf({ ...link, connected: false }, 3000).pill, 'connection lost');
});

test('the time line has a row for what there is, with faint marks first', () => {
  setFrames(0, 1, 2, 3);
  path.s[1] = 1;
  const run = { path, mapEvents: [{ kind: 'loop', t: 2 }], warnings: [near, { ...zone, end: null }], summary: { findings: [{ code: 'focal-length', severity: 'untrusted', message: 'wrong', fix: null }, { code: 'late-frames', severity: 'note', message: 'late', fix: null }], skipped: [], frames: { uncertain_at: [2] } }, periods: [[0, 1]] };
  const rows = rowsOf(run), marks = (k) => rows[k].marks.map((m) => [m.text, m.begin, m.end]);
  assert.deepEqual(rows.map((row) => row.name), ['camera', 'warnings', 'findings', 'dynamics']);
  assert.deepEqual(marks(0), [['tracked', 0, 1], ['tracked', 2, 3], ['lost', 1, 2], ['loop closed', 2, 2]]);
  assert.deepEqual(marks(1).map((mark) => mark[2]), [2, 3]);
  assert.deepEqual(textsBetween(rows[2], 1.9, 2.1), ['uncertain pose', 'wrong']);
  assert.deepEqual(textsBetween(undefined, 0, 1), []);
  assert.deepEqual(rowsOf({ path, mapEvents: [], warnings: [], summary: {}, periods: [] }).map((row) => row.name), ['camera']);
});

test('highly dynamic periods grow while they last', () => {
  const periods = [];
  [[0, false], [1, true], [2, true], [3, false], [4, false], [5, true]].forEach(([t, high]) => addDynamics(periods, t, high));
  assert.deepEqual(periods.map(([begin, end]) => [begin, end]), [[1, 3], [5, 5]]);
});
